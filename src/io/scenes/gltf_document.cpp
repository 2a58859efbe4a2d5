// The text of a glTF file and the bytes that it names: data URIs, files beside it, the binary chunk of a .glb.

#include <filesystem>

#include "core/os/path.h"
#include "core/path_name.h"
#include "core/shown.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/reader.h"
#include "io/scenes/gltf.h"

namespace splat::io::gltf {
namespace {

constexpr std::string_view kData = "data:";

/// Data URIs of more bytes stand beside the JSON, whose parser takes kMaxJsonBytes and copies each string.
constexpr std::size_t kLongUri = 1000;

/// The end of a string that starts behind a quote at `at`, and whether it holds escapes.
std::pair<std::size_t, bool> string_end(std::string_view json, std::size_t at) {
    bool escapes = false;
    for (;;) {
        at = json.find_first_of("\"\\", at);
        if (at == json.npos || json[at] == '"') return {at, escapes};
        escapes = true;
        at = std::min(at + 2, json.size());
    }
}

/// The JSON with "#0", "#1"... instead of long data URIs, which are views of it.
std::string without_data(std::string_view json, std::vector<std::string_view>& uris) {
    std::string text;
    std::size_t copied = 0;
    for (std::size_t start = json.find('"'); start != json.npos;) {
        const auto [end, escapes] = string_end(json, start + 1);
        if (end == json.npos) break;
        const std::string_view string = json.substr(start + 1, end - start - 1);
        if (string.size() > kLongUri && string.starts_with(kData) && !escapes) {
            text += json.substr(copied, start - copied);
            text += "\"#" + std::to_string(uris.size()) + "\"";
            uris.push_back(string);
            copied = end + 1;
        }
        start = json.find('"', end + 1);
    }
    return text.append(json.substr(copied));
}

Result<Buffer> decode_data_uri(std::string_view uri, const std::string& where) {
    const std::size_t comma = uri.find(',');
    const std::string_view head = uri.substr(0, std::min(comma, uri.size()));
    if (comma == uri.npos || !head.ends_with(";base64"))
        return damaged("gltf: %s: a data URI '%s', expected 'data:<type>;base64,<data>'",
                       where.c_str(), shown(head, 60).c_str());
    return from_base64(uri.substr(comma + 1), where);
}

/// A URI's path with its %XX decoded, relative to the document. Errors: kFormat for any that may lead elsewhere.
Result<std::string> relative_path(const std::string& uri, const std::string& where) {
    const auto refused = [&](const char* reason) {
        return damaged(
            "gltf: %s: the uri '%s' %s, expected a data URI or a path below the file's folder",
            where.c_str(), shown(uri, 80).c_str(), reason);
    };
    if (uri.find(':') != uri.npos) return refused("has a scheme");
    std::string path;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        if (uri[i] != '%') {
            path += uri[i];
            continue;
        }
        unsigned byte = 0;
        const char* const digits = uri.c_str() + i + 1;
        const char* const end = digits + std::min<std::size_t>(2, uri.size() - i - 1);
        const auto [stop, failed] = std::from_chars(digits, end, byte, 16);
        if (failed != std::errc() || stop != digits + 2) return refused("has a '%' without digits");
        path += static_cast<char>(byte);
        i += 2;
    }
    if (path.find('\\') != path.npos) return refused("has a backslash");
    if (!check_below(path).ok()) return refused("leads out of the folder");
    return os::text_of(os::path_of(path).lexically_normal());
}

}  // namespace

Result<std::uint64_t> whole_number(const JsonTree& object, const char* member,
                                   const std::string& where, std::optional<std::uint64_t> usual) {
    const JsonTree* const found = object.find(member);
    if (found == nullptr && usual) return *usual;
    const auto count = found == nullptr ? std::nullopt : found->count();
    if (count) return *count;
    return damaged("gltf: %s: %s %s, expected a whole number from 0 to 2^53", where.c_str(), member,
                   found == nullptr ? "is missing" : "is none");
}

Result<Document> Document::open(std::string_view json, std::optional<Bytes> binary,
                                const LoadOptions& options) {
    Document document;
    document.binary_ = binary;
    document.folder_ = options.folder;
    document.file_bytes_ = json.size() + (binary ? binary->size() : 0);
    const std::string text = without_data(json, document.data_uris_);
    SPLAT_SET(document.json_, from_file(parse_json_tree(text, "gltf")));
    const JsonTree& version = document.json_["asset"]["version"];
    if (version.text() == nullptr)
        return damaged("gltf: there is no asset.version, expected \"2.0\"; is it a glTF file?");
    if (!version.text()->starts_with("2."))
        return unsupported("gltf: version '%s', expected 2.0", shown(*version.text(), 20).c_str());
    return document;
}

Result<const JsonTree*> Document::element(const char* array, std::uint64_t index) const {
    const JsonTree*& found = arrays_[array];
    if (found == nullptr) found = &json_[array];
    const JsonTree::List& list = found->items();
    if (index < list.size()) return &list[static_cast<std::size_t>(index)];
    return damaged("gltf: %s[%llu] is named, but there are %zu", array, llu(index), list.size());
}

Result<Bytes> Document::resource(const std::string& uri, const std::string& where) {
    if (const auto found = resources_.find(uri); found != resources_.end())
        return Bytes(found->second);
    std::string_view data = uri;
    if (uri.starts_with('#')) {
        const auto number = number_in<std::size_t>(data.substr(1));
        if (!number || *number >= data_uris_.size())
            return damaged("gltf: %s: the uri '%s' names no bytes", where.c_str(),
                           shown(uri, 40).c_str());
        data = data_uris_[*number];
    }
    if (data.starts_with(kData)) {
        SPLAT_ASSIGN(Buffer bytes, decode_data_uri(data, where));
        return Bytes(resources_[uri] = std::move(bytes));
    }
    SPLAT_ASSIGN(const std::string path, relative_path(uri, where));
    if (!folder_)
        return unsupported(
            "gltf: %s is the file '%s', but the scene is read from memory; read it by its path, "
            "or make it a .glb",
            where.c_str(), shown(path, 80).c_str());
    if (const auto found = resources_.find(path); found != resources_.end())
        return Bytes(found->second);
    SPLAT_TRY(check_no_links(*folder_, path, "gltf: " + where));
    SPLAT_ASSIGN(Buffer bytes, read_file(os::text_of(os::path_of(*folder_) / path)));
    file_bytes_ += bytes.size();
    return Bytes(resources_[path] = std::move(bytes));
}

Result<Bytes> Document::buffer(std::uint64_t index) {
    SPLAT_ASSIGN(const JsonTree* const json, element("buffers", index));
    const std::string where = format("buffers[%llu]", llu(index));
    SPLAT_ASSIGN(const std::uint64_t bytes, whole_number(*json, "byteLength", where));
    const std::string* const uri = (*json)["uri"].text();
    if (uri == nullptr && (index != 0 || !binary_))
        return damaged("gltf: %s has no uri, and is not the first of a .glb with a binary chunk",
                       where.c_str());
    Bytes held;
    if (uri == nullptr)
        held = *binary_;
    else
        SPLAT_SET(held, resource(*uri, where));
    if (bytes <= held.size()) return held.first(static_cast<std::size_t>(bytes));
    return damaged(
        "gltf: %s: byteLength %llu, but only %zu bytes are there; it is truncated or wrong",
        where.c_str(), llu(bytes), held.size());
}

Result<View> Document::view(std::uint64_t index) {
    SPLAT_ASSIGN(const JsonTree* const json, element("bufferViews", index));
    const std::string where = format("bufferViews[%llu]", llu(index));
    SPLAT_ASSIGN(const std::uint64_t buffer_index, whole_number(*json, "buffer", where));
    SPLAT_ASSIGN(const std::uint64_t offset, whole_number(*json, "byteOffset", where, 0));
    SPLAT_ASSIGN(const std::uint64_t bytes, whole_number(*json, "byteLength", where));
    SPLAT_ASSIGN(const std::uint64_t stride, whole_number(*json, "byteStride", where, 0));
    if (json->find("byteStride") != nullptr && (stride < 4 || stride > 252 || stride % 4 != 0))
        return damaged("gltf: %s: byteStride %llu, expected 4 to 252 in steps of 4", where.c_str(),
                       llu(stride));
    SPLAT_ASSIGN(const Bytes held, buffer(buffer_index));
    if (offset > held.size() || bytes > held.size() - offset)
        return damaged("gltf: %s: %llu bytes from %llu on, but buffers[%llu] has %zu",
                       where.c_str(), llu(bytes), llu(offset), llu(buffer_index), held.size());
    return View{held.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(bytes)),
                stride};
}

Result<Bytes> Document::image(std::uint64_t index) {
    SPLAT_ASSIGN(const JsonTree* const json, element("images", index));
    const std::string where = format("images[%llu]", llu(index));
    if (const std::string* const uri = (*json)["uri"].text()) return resource(*uri, where);
    SPLAT_ASSIGN(const std::uint64_t number, whole_number(*json, "bufferView", where));
    SPLAT_ASSIGN(const View held, view(number));
    return held.bytes;
}

}  // namespace splat::io::gltf
