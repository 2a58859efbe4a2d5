#include "data/co3d_raw.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>

#include "core/decode_budget.h"
#include "core/json_tree.h"
#include "core/os/path.h"
#include "core/path_name.h"
#include "core/shown.h"
#include "data/folder.h"
#include "io/compress.h"
#include "io/file.h"
#include "io/reader.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxAnnotationBytes = std::uint64_t{1} << 32;
constexpr std::size_t kGzipTail = 4;  ///< last bytes: the length modulo 2^32

/// A file's text, and what its parts may cost.
struct Annotations {
    io::Buffer text;
    DecodeBudget budget;
};

Result<Annotations> read_annotations(const std::string& path) {
    SPLAT_ASSIGN(io::Buffer file, io::read_file(path, kMaxAnnotationBytes));
    DecodeBudget budget(file.size());
    if (!io::is_gzip(file) || file.size() < kGzipTail) return Annotations{std::move(file), budget};
    const auto bytes = io::number<std::uint32_t>(file.data() + file.size() - kGzipTail);
    SPLAT_TRY(budget.take(bytes, 1, "'" + path + "'"));
    SPLAT_ASSIGN(file, io::gunzip(file, bytes, "'" + path + "'"));
    return Annotations{std::move(file), budget};
}

/// Parses one element. Its tree takes memory of the budget, for as long as it lives.
Result<JsonTree> element_of(std::string_view text, DecodeBudget budget) {
    constexpr std::size_t kGrowth = 3;  // while a list grows, its old and its new place exist
    const auto starts = [](char c) { return c == ',' || c == ':' || c == '[' || c == '{'; };
    const auto values = std::ranges::count_if(text, starts);
    SPLAT_TRY(
        budget.take(static_cast<std::uint64_t>(values), kGrowth * sizeof(JsonTree), "JSON values"));
    return io::from_file(parse_json_tree(text, "element"));
}

/// Calls `each` for every element of a JSON array of any size, whose elements are parsed one by one.
Status each_element(std::string_view text, const DecodeBudget& budget,
                    const std::function<Status(const JsonTree&)>& each) {
    const auto broken = [](std::size_t at) { return damaged("no JSON array: byte %zu", at); };
    std::size_t at = text.find_first_not_of(" \t\r\n");
    if (at == std::string_view::npos || text[at] != '[') return broken(0);
    std::size_t start = ++at;
    std::size_t depth = 0;
    for (bool quoted = false; at < text.size(); ++at) {
        const char c = text[at];
        if (quoted) {
            if (c == '\\') ++at;
            quoted = c != '"';
            continue;
        }
        if (c == '"') quoted = true;
        if (c == '[' || c == '{') ++depth;
        const bool ends = depth == 0 && (c == ',' || c == ']');
        if (ends) {
            const std::string_view element = text.substr(start, at - start);
            const bool empty = element.find_first_not_of(" \t\r\n") == std::string_view::npos;
            if (!empty) {
                const auto tree = element_of(element, budget);
                if (!tree.ok())
                    return damaged("byte %zu: %s", start, tree.status().message().c_str());
                SPLAT_TRY(each(tree.value()));
            }
            if (c == ']') return {};
            start = at + 1;
        } else if (c == ']' || c == '}') {
            if (depth-- == 0) return broken(at);
        }
    }
    return broken(text.size());
}

Status no_member(const char* name) {
    return damaged("an annotation without a valid '%s'", name);
}

/// The member at "a.b"; a JSON null if it is not there.
const JsonTree& at_path(const JsonTree& tree, std::string_view path) {
    const std::size_t dot = path.find('.');
    const JsonTree& at = tree[path.substr(0, dot)];
    return dot == path.npos ? at : at_path(at, path.substr(dot + 1));
}

Result<std::string> text_at(const JsonTree& tree, const char* path) {
    const std::string* const found = at_path(tree, path).text();
    if (found == nullptr) return no_member(path);
    return *found;
}

Result<double> number_at(const JsonTree& tree, const char* path) {
    const auto found = at_path(tree, path).number();
    if (!found) return no_member(path);
    return *found;
}

Result<std::int64_t> frame_number_of(const JsonTree& tree) {
    const auto found = tree["frame_number"].count();
    if (!found) return no_member("frame_number");
    return static_cast<std::int64_t>(*found);
}

/// Numbers of a list, or of a list of lists.
template <std::size_t Count>
Result<std::array<double, Count>> numbers_at(const JsonTree& tree, const char* path) {
    std::vector<double> found;
    const std::function<bool(const JsonTree&)> add = [&](const JsonTree& each) {
        if (const JsonTree::List* list = each.list()) return std::ranges::all_of(*list, add);
        if (each.number()) found.push_back(*each.number());
        return each.number().has_value();
    };
    const JsonTree& list = at_path(tree, path);
    if (list.list() == nullptr || !add(list) || found.size() != Count) return no_member(path);
    std::array<double, Count> numbers;
    std::ranges::copy(found, numbers.begin());
    return numbers;
}

/// Focal length and principal point in pixels. NDC: the shorter side is 2, x points left and y up; in the legacy
/// format "ndc_norm_image_bounds" both sides are 2.
Status read_lens(const JsonTree& tree, RawFrame& frame) {
    SPLAT_ASSIGN(const auto focal, (numbers_at<2>(tree, "viewpoint.focal_length")));
    SPLAT_ASSIGN(const auto point, (numbers_at<2>(tree, "viewpoint.principal_point")));
    const std::string* const format = at_path(tree, "viewpoint.intrinsics_format").text();
    const std::string name = format == nullptr ? "ndc_norm_image_bounds" : *format;
    const bool isotropic = name == "ndc_isotropic";
    if (!isotropic && name != "ndc_norm_image_bounds")
        return damaged(
            "the intrinsics_format '%s', expected ndc_isotropic or ndc_norm_image_bounds",
            shown(name).c_str());
    const double half[] = {frame.width / 2.0, frame.height / 2.0};
    for (std::size_t i = 0; i < 2; ++i) {
        const double scale = isotropic ? std::min(half[0], half[1]) : half[i];
        frame.focal[i] = focal[i] * scale;
        frame.principal_point[i] = half[i] - point[i] * scale;
    }
    return {};
}

Result<RawFrame> frame_of(const JsonTree& tree) {
    RawFrame frame;
    SPLAT_ASSIGN(frame.number, frame_number_of(tree));
    SPLAT_ASSIGN(frame.time, number_at(tree, "frame_timestamp"));
    SPLAT_ASSIGN(frame.image, text_at(tree, "image.path"));
    SPLAT_ASSIGN(frame.mask, text_at(tree, "mask.path"));
    SPLAT_TRY(check_below(frame.image));
    SPLAT_TRY(check_below(frame.mask));
    SPLAT_ASSIGN(const auto size, (numbers_at<2>(tree, "image.size")));  // height, width
    if (!(size[0] >= 1 && size[1] >= 1 && size[0] < 65536 && size[1] < 65536))
        return no_member("image.size");
    frame.height = static_cast<std::uint32_t>(size[0]);
    frame.width = static_cast<std::uint32_t>(size[1]);
    if (!at_path(tree, "mask.bounding_box_xywh").is_null()) {
        SPLAT_ASSIGN(const auto found, (numbers_at<4>(tree, "mask.bounding_box_xywh")));
        frame.box.emplace();
        for (std::size_t i = 0; i < 4; ++i) (*frame.box)[i] = static_cast<float>(found[i]);
    }
    SPLAT_ASSIGN(frame.rotation, (numbers_at<9>(tree, "viewpoint.R")));
    SPLAT_ASSIGN(frame.translation, (numbers_at<3>(tree, "viewpoint.T")));
    SPLAT_TRY(read_lens(tree, frame));
    return frame;
}

using FrameKey = std::pair<std::string, std::int64_t>;

/// The frames of a split with their places: elements [sequence, frame number, path].
Result<std::map<FrameKey, std::size_t>> read_split(const std::string& path,
                                                   const std::string& split) {
    SPLAT_ASSIGN(const Annotations file, read_annotations(path));
    const std::string_view text = io::as_text(file.text);
    std::map<FrameKey, std::size_t> places;
    const std::size_t key = text.find("\"" + split + "\"");
    const std::size_t start = key == std::string_view::npos ? key : text.find('[', key);
    if (start == std::string_view::npos)
        return damaged("'%s' has no list '%s'", path.c_str(), split.c_str());
    const auto add = [&](const JsonTree& element) -> Status {
        const JsonTree::List* list = element.list();
        if (list == nullptr || list->size() < 2 || (*list)[0].text() == nullptr ||
            !(*list)[1].count())
            return damaged("element %zu is not [sequence, frame number, path]", places.size());
        places.emplace(FrameKey{*(*list)[0].text(), static_cast<std::int64_t>(*(*list)[1].count())},
                       places.size());
        return {};
    };
    SPLAT_TRY(in_file(each_element(text.substr(start), file.budget, add), path));
    return places;
}

}  // namespace

Result<std::vector<RawSequence>> read_raw_co3d(const std::string& root, const std::string& category,
                                               const std::string& subset,
                                               const std::string& split) {
    const fs::path folder = os::path_of(root) / category;
    SPLAT_ASSIGN(
        const auto places,
        read_split(os::text_of(folder / "set_lists" / ("set_lists_" + subset + ".json")), split));
    std::map<std::string, RawSequence> sequences;
    const std::string frames_path = os::text_of(folder / "frame_annotations.jgz");
    SPLAT_ASSIGN(const Annotations frames, read_annotations(frames_path));
    std::size_t found = 0;
    const auto add_frame = [&](const JsonTree& tree) -> Status {
        SPLAT_ASSIGN(const std::string name, text_at(tree, "sequence_name"));
        SPLAT_ASSIGN(const std::int64_t number, frame_number_of(tree));
        const auto place = places.find({name, number});
        if (place == places.end()) return {};
        SPLAT_ASSIGN(auto frame,
                     in_file(frame_of(tree), shown(name) + ", frame " + std::to_string(number)));
        frame.place = place->second;
        sequences[name].frames.push_back(std::move(frame));
        ++found;
        return {};
    };
    SPLAT_TRY(
        in_file(each_element(io::as_text(frames.text), frames.budget, add_frame), frames_path));
    if (found != places.size())
        return damaged("'%s' has %zu of the %zu frames of the split '%s'", frames_path.c_str(),
                       found, places.size(), split.c_str());
    const std::string sequences_path = os::text_of(folder / "sequence_annotations.jgz");
    SPLAT_ASSIGN(const Annotations file, read_annotations(sequences_path));
    const auto name_sequence = [&](const JsonTree& tree) -> Status {
        SPLAT_ASSIGN(const std::string name, text_at(tree, "sequence_name"));
        const auto sequence = sequences.find(name);
        if (sequence == sequences.end()) return {};
        sequence->second.name = name;
        const std::string* const points = at_path(tree, "point_cloud.path").text();
        if (points != nullptr) sequence->second.points = *points;
        return {};
    };
    SPLAT_TRY(
        in_file(each_element(io::as_text(file.text), file.budget, name_sequence), sequences_path));
    std::vector<RawSequence> all;
    for (auto& [name, sequence] : sequences) {
        if (sequence.name.empty())
            return damaged("'%s' has no sequence '%s'", sequences_path.c_str(), name.c_str());
        std::ranges::sort(sequence.frames, [](const RawFrame& a, const RawFrame& b) {
            return std::tie(a.time, a.number) < std::tie(b.time, b.number);
        });
        all.push_back(std::move(sequence));
    }
    return all;
}

}  // namespace splat::data
