#include <algorithm>
#include <cstring>

#include "api/api_guard.h"
#include "api/handles.h"
#include "core/json.h"
#include "io/file.h"
#include "io/scene_file.h"
#include "scene/arrays.h"

using namespace splat;

namespace {

static_assert(static_cast<int>(io::SceneFormat::kPly) + 1 == SPLAT_SCENE_PLY);
static_assert(static_cast<int>(io::SceneFormat::kSpz) + 1 == SPLAT_SCENE_SPZ);
static_assert(static_cast<int>(scene::Frame::kRdf) + 1 == SPLAT_FRAME_RDF);
static_assert(static_cast<int>(scene::Frame::kRub) + 1 == SPLAT_FRAME_RUB);
static_assert(static_cast<int>(scene::Frame::kLdf) + 1 == SPLAT_FRAME_LDF);

/// Names that make io write the format of the same index.
constexpr const char* kMemoryNames[] = {"memory", "memory.ply", "memory.ply", "memory.splat",
                                        "memory.spz"};

Status check_range(const char* field, std::int64_t value, std::int64_t least, std::int64_t most) {
    if (value >= least && value <= most) return {};
    return error(Code::kInvalidArgument, "splat_scene_file_desc.%s is %lld, expected %lld to %lld",
                 field, static_cast<long long>(value), static_cast<long long>(least),
                 static_cast<long long>(most));
}

/// The caller's desc, or the default one.
Result<splat_scene_file_desc> complete(const splat_scene_file_desc* desc) {
    splat_scene_file_desc full{};
    if (desc == nullptr) return full;
    SPLAT_TRY(api::check_desc(desc, "splat_scene_file_desc", sizeof full, 0));
    SPLAT_TRY(check_range("format", desc->format, 0, SPLAT_SCENE_SPZ));
    SPLAT_TRY(check_range("frame", desc->frame, 0, SPLAT_FRAME_LDF));
    SPLAT_TRY(check_range("sh_degree", desc->sh_degree, SPLAT_SH_CONSTANT, scene::kMaxShDegree));
    if (desc->spz_version != 0) SPLAT_TRY(check_range("spz_version", desc->spz_version, 3, 4));
    return *desc;
}

std::optional<scene::Frame> frame_of(const splat_scene_file_desc& desc) {
    if (desc.frame == 0) return std::nullopt;
    return static_cast<scene::Frame>(desc.frame - 1);
}

std::optional<std::uint32_t> degree_of(const splat_scene_file_desc& desc) {
    if (desc.sh_degree == 0) return std::nullopt;
    return static_cast<std::uint32_t>(std::max(desc.sh_degree, 0));
}

std::string report_text(const io::LoadReport& report) {
    std::string ignored;
    for (const std::string& name : report.ignored)
        ignored += (ignored.empty() ? "" : ", ") + json_quote(name);
    return format(
        "{\"format\": %s, \"version\": %u, \"count\": %llu, \"sh_degree\": %u, \"frame\": \"%s\", "
        "\"ignored\": [%s], \"non_finite_values\": %llu, \"bad_rotations\": %llu}",
        json_quote(report.format).c_str(), report.version,
        static_cast<unsigned long long>(report.count), report.sh_degree,
        scene::frame_name(report.frame), ignored.c_str(),
        static_cast<unsigned long long>(report.non_finite_values),
        static_cast<unsigned long long>(report.bad_rotations));
}

Result<splat_scene> load(io::Bytes file, const char* name, const splat_scene_file_desc& desc) {
    io::LoadOptions options;
    options.frame = frame_of(desc);
    if (desc.max_count != 0) options.max_count = desc.max_count;
    SPLAT_ASSIGN(io::LoadedScene loaded,
                 desc.format == 0 ? io::read_scene(file, name, options)
                                  : io::read_scene_as(static_cast<io::SceneFormat>(desc.format - 1),
                                                      file, name, options));
    auto object = std::make_shared<api::SceneObject>();
    object->report = report_text(loaded.report);
    if (const auto degree = degree_of(desc))
        object->gaussians = scene::with_sh_degree(loaded.gaussians, *degree);
    else
        object->gaussians = std::move(loaded.gaussians);
    return api::Scenes::add(std::move(object));
}

Result<io::Buffer> file_of(api::SceneObject& object, const char* name,
                           const splat_scene_file_desc& desc) {
    if (desc.format == SPLAT_SCENE_COMPRESSED_PLY)
        return error(Code::kUnsupported, "compressed .ply is read only; write .ply or .spz");
    io::SaveOptions options;
    options.frame = frame_of(desc);
    options.sh_degree = degree_of(desc);
    if (desc.spz_version != 0) options.spz_version = desc.spz_version;
    const std::lock_guard lock(object.mutex);
    return io::write_scene(object.gaussians, desc.format != 0 ? kMemoryNames[desc.format] : name,
                           options);
}

}  // namespace

splat_result splat_scene_load(const char* path, const splat_scene_file_desc* desc,
                              splat_scene* scene) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(scene, "scene"));
        SPLAT_TRY(api::require(path, "path"));
        SPLAT_ASSIGN(const splat_scene_file_desc full, complete(desc));
        SPLAT_ASSIGN(const io::Buffer file, io::read_file(path));
        SPLAT_ASSIGN(*scene, load(file, path, full));
        return {};
    });
}

splat_result splat_scene_load_memory(const void* data, size_t bytes,
                                     const splat_scene_file_desc* desc, splat_scene* scene) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(scene, "scene"));
        SPLAT_TRY(api::require(data, "data"));
        SPLAT_ASSIGN(const splat_scene_file_desc full, complete(desc));
        const io::Bytes file{static_cast<const std::byte*>(data), bytes};
        SPLAT_ASSIGN(*scene, load(file, "memory", full));
        return {};
    });
}

splat_result splat_scene_save(splat_scene scene, const char* path,
                              const splat_scene_file_desc* desc) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::Scenes::find(scene, "scene"));
        SPLAT_TRY(api::require(path, "path"));
        SPLAT_ASSIGN(const splat_scene_file_desc full, complete(desc));
        SPLAT_ASSIGN(const io::Buffer file, file_of(*object, path, full));
        return io::write_file(path, file);
    });
}

splat_result splat_scene_save_memory(splat_scene scene, const splat_scene_file_desc* desc,
                                     void* buffer, size_t capacity, size_t* needed) {
    splat_result given = SPLAT_OK;
    const splat_result result = api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::Scenes::find(scene, "scene"));
        SPLAT_ASSIGN(const splat_scene_file_desc full, complete(desc));
        if (full.format == 0)
            return error(Code::kInvalidArgument,
                         "splat_scene_file_desc.format is 0, but memory has no extension: say "
                         "which");
        SPLAT_ASSIGN(const io::Buffer file, file_of(*object, "", full));
        if (needed != nullptr) *needed = file.size();
        if (buffer == nullptr || capacity < file.size())
            given = SPLAT_INCOMPLETE;
        else
            std::memcpy(buffer, file.data(), file.size());
        return {};
    });
    return result != SPLAT_OK ? result : given;
}
