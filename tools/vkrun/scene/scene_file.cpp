#include "vkrun/scene/scene_file.h"

#include <algorithm>
#include <vector>

#include "vkrun/cli/table.h"

namespace vkrun {

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

splat_frame frame_of(const std::string& name) {
    const char* names[] = {"auto", "RDF", "RUB", "LUF", "RUF", "LDB", "RDB", "LUB", "LDF"};
    for (splat_frame frame = 0; frame <= SPLAT_FRAME_LDF; ++frame)
        if (name == names[frame]) return frame;
    throw Failure(kUsageError,
                  "no frame '" + name + "'; there are: RDF, RUB, LUF, RUF, LDB, RDB, LUB, LDF");
}

}  // namespace vkrun
