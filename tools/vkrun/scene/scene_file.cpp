#include "vkrun/scene/scene_file.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "core/os/path.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/table.h"

namespace vkrun {
namespace {

struct DrawnName {
    std::uint32_t bit;
    const char* name;
};
constexpr const char* kFrameNames[] = {"auto", "RDF", "RUB", "LUF", "RUF",
                                       "LDB",  "RDB", "LUB", "LDF"};
constexpr DrawnName kDrawnNames[] = {{SPLAT_DRAWN_ANTIALIASED, "antialiased"},
                                     {SPLAT_DRAWN_BY_DISTANCE, "by distance"},
                                     {SPLAT_DRAWN_CUT_3_SIGMA, "3 sigma"},
                                     {SPLAT_DRAWN_LINEAR_COLORS, "linear colours"}};

/// "by-distance": a name as a word of the command line.
std::string word_of(std::string name) {
    std::replace(name.begin(), name.end(), ' ', '-');
    return name;
}

}  // namespace

const Json& scene_formats() {
    static const Json formats = library_json(splat_scene_formats);
    return formats;
}

std::string scene_extensions(bool written) {
    std::vector<std::string> extensions;
    for (const Json& format : scene_formats()) {
        if (written && !format.at("written").get<bool>()) continue;
        const auto extension = format.at("extension").get<std::string>();
        if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end())
            extensions.push_back(extension);
    }
    std::string list = extensions.front();
    for (std::size_t i = 1; i < extensions.size(); ++i)
        list += (i + 1 == extensions.size() ? " or " : ", ") + extensions[i];
    return list;
}

const Json* named_format(const std::string& path, bool written) {
    std::string name = splat::os::text_of(splat::os::path_of(path).filename());
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    const Json* found = nullptr;
    std::size_t length = 0;
    for (const Json& format : scene_formats()) {
        const auto extension = format.at("extension").get<std::string>();
        if ((written && !format.at("written").get<bool>()) || !name.ends_with(extension)) continue;
        if (extension.size() > length) found = &format;
        length = std::max(length, extension.size());
    }
    return found;
}

bool is_unpacked_sog(const std::string& path) {
    std::error_code none;
    return splat::os::path_of(path).filename() == "meta.json" ||
           (std::filesystem::is_directory(splat::os::path_of(path), none) &&
            std::filesystem::exists(splat::os::path_of(path) / "meta.json", none));
}

std::uint64_t scene_bytes(const std::string& path) {
    namespace fs = std::filesystem;
    std::error_code none;
    const auto bytes_of = [&none](const fs::path& file) -> std::uint64_t {
        return fs::is_regular_file(file, none) ? fs::file_size(file, none) : 0;
    };
    if (!is_unpacked_sog(path)) return bytes_of(splat::os::path_of(path));
    const fs::path folder = fs::is_directory(splat::os::path_of(path), none)
                                ? splat::os::path_of(path)
                                : fs::absolute(splat::os::path_of(path), none).parent_path();
    std::uint64_t bytes = 0;
    for (const auto& entry : fs::directory_iterator(folder, none)) bytes += bytes_of(entry.path());
    return bytes;
}

std::string plain_ply_name(const std::string& path) {
    const std::string name = splat::os::text_of(splat::os::path_of(path).filename());
    const Json* const format = named_format(path);
    if (format == nullptr) return splat::os::text_of(splat::os::path_of(path).stem()) + ".ply";
    return name.substr(0, name.size() - format->at("extension").get<std::string>().size()) + ".ply";
}

std::string scene_formats_text() {
    Table table({"format", "extension", "frame", "holds"});
    for (const Json& format : scene_formats())
        table.add({format.at("name"), format.at("extension"), format.at("frame"),
                   format.at("holds").get<std::string>() +
                       (format.at("written").get<bool>() ? "" : "; read only")});
    return table.text();
}

splat_scene_file_desc scene_file_desc(bool lenient) {
    auto desc = sized<splat_scene_file_desc>();
    if (lenient) desc.flags |= SPLAT_SCENE_LENIENT;
    return desc;
}

SceneFile load_scene(const std::string& path, const splat_scene_file_desc* desc) {
    SceneFile file;
    try {
        check(splat_scene_load(path.c_str(), desc, file.scene.out()), kBadData);
    } catch (const Failure& failure) {
        // Commands that have no option --lenient give no desc.
        throw with_advice(failure, "; a lenient reader leaves them out",
                          desc == nullptr ? "" : "; --lenient leaves them out");
    }
    file.info = sized<splat_scene_info>();
    check(splat_scene_get_info(file.scene.get(), &file.info));
    file.report = library_json(splat_scene_load_report, file.scene.get());
    return file;
}

void warn_ignored(const SceneFile& file, const std::string& path) {
    for (const Json& name : file.report.at("ignored"))
        std::fprintf(stderr, "vkrun: warning: '%s' of %s is not kept\n",
                     name.get<std::string>().c_str(), path.c_str());
}

const char* frame_name(splat_frame frame) {
    return kFrameNames[frame];
}

std::vector<std::string> frame_names() {
    return {std::begin(kFrameNames), std::end(kFrameNames)};
}

std::vector<std::string> drawn_names(std::uint32_t bits) {
    std::vector<std::string> names;
    for (const auto& [bit, name] : kDrawnNames)
        if ((bits & bit) != 0) names.emplace_back(name);
    return names;
}

std::string drawn_as_text(const SceneFile& file) {
    std::string text;
    for (const std::string& name : drawn_names(file.info.drawn_as))
        text += (text.empty() ? "" : ", ") + name;
    return text.empty() ? "plain 3DGS" : text;
}

void add_drawn_as_option(CLI::App& command, std::vector<std::string>& words) {
    std::vector<std::string> known = {"file", "plain"};
    for (const auto& [bit, name] : kDrawnNames) known.push_back(word_of(name));
    command
        .add_option("--drawn-as", words,
                    "How to draw: as the scene's file says (file), plain, or\nany of antialiased, "
                    "by-distance, 3-sigma and\nlinear-colours")
        ->type_name("NAME[,NAME]...")
        ->default_str("file")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(one_of(known));
}

std::uint32_t drawn_bits(const std::vector<std::string>& words, std::uint32_t of_file) {
    std::uint32_t bits = 0;
    for (const std::string& word : words) {
        if ((word == "file" || word == "plain") && words.size() > 1)
            throw Failure(kUsageError, "--drawn-as is '" + word + "' alone, or names");
        if (word == "file") bits = of_file;
        for (const auto& [bit, name] : kDrawnNames)
            if (word == word_of(name)) bits |= bit;
    }
    return bits;
}

splat_frame frame_of(const std::string& name) {
    for (splat_frame frame = 0; frame <= SPLAT_FRAME_LDF; ++frame)
        if (name == frame_name(frame)) return frame;
    throw Failure(kUsageError,
                  "no frame '" + name + "'; there are: RDF, RUB, LUF, RUF, LDB, RDB, LUB, LDF");
}

}  // namespace vkrun
