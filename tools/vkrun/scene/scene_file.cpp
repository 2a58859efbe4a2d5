#include "vkrun/scene/scene_file.h"

namespace vkrun {

SceneFile load_scene(const std::string& path, const splat_scene_file_desc* desc) {
    SceneFile file;
    check(splat_scene_load(path.c_str(), desc, file.scene.out()), kBadData);
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
