#include <algorithm>

#include "api/api_guard.h"
#include "api/handles.h"
#include "core/json_writer.h"
#include "core/log.h"
#include "io/file.h"
#include "io/scene_file.h"
#include "io/scene_formats.h"
#include "scene/arrays.h"

using namespace splat;

namespace {

static_assert(static_cast<int>(scene::Frame::kRdf) + 1 == SPLAT_FRAME_RDF);
static_assert(static_cast<int>(scene::Frame::kRub) + 1 == SPLAT_FRAME_RUB);
static_assert(static_cast<int>(scene::Frame::kLdf) + 1 == SPLAT_FRAME_LDF);

Status check_range(const char* field, std::int64_t value, std::int64_t least, std::int64_t most) {
    if (value >= least && value <= most) return {};
    return invalid("splat_scene_file_desc.%s is %lld, expected %lld to %lld", field, lld(value),
                   lld(least), lld(most));
}

/// The caller's desc, or the default one.
Result<splat_scene_file_desc> complete(const splat_scene_file_desc* desc) {
    splat_scene_file_desc full{};
    if (desc == nullptr) return full;
    SPLAT_TRY(api::check_desc(desc, SPLAT_SCENE_LENIENT | SPLAT_SCENE_CLAMP));
    SPLAT_TRY(check_range("format", desc->format, 0, std::ssize(io::scene_formats())));
    SPLAT_TRY(check_range("frame", desc->frame, 0, SPLAT_FRAME_LDF));
    SPLAT_TRY(check_range("sh_degree", desc->sh_degree, SPLAT_SH_CONSTANT, scene::kMaxShDegree));
    if (desc->spz_version != 0) SPLAT_TRY(check_range("spz_version", desc->spz_version, 3, 4));
    return *desc;
}

/// Null where the desc leaves it open.
const io::SceneFormat* format_of(const splat_scene_file_desc& desc) {
    if (desc.format == 0) return nullptr;
    return &io::scene_formats()[static_cast<std::size_t>(desc.format - 1)];
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
    JsonWriter json;
    json.begin_object().member("format", report.format).member("version", report.version);
    json.member("count", report.count).member("sh_degree", report.sh_degree);
    json.member("frame", scene::frame_name(report.frame)).key("ignored").list(report.ignored);
    json.member("non_finite_values", report.non_finite_values);
    json.member("bad_rotations", report.bad_rotations).key("drawn_as");
    json.list(scene::drawn_as_names(report.drawn_as)).end();
    return json.text();
}

std::string formats_text() {
    JsonWriter json;
    json.begin_array();
    for (const io::SceneFormat& format : io::scene_formats()) {
        json.newline(1).begin_object().member("name", format.name);
        json.member("id", format.id);
        json.member("extension", format.extension).member("holds", format.holds);
        json.member("frame", scene::frame_name(format.frame));
        json.member("max_sh_degree", format.max_sh_degree);
        json.member("written", format.write != nullptr).end();
    }
    return json.end().text();
}

io::LoadOptions load_options(const splat_scene_file_desc& desc) {
    io::LoadOptions options;
    options.frame = frame_of(desc);
    if (desc.max_count != 0) options.max_count = desc.max_count;
    options.lenient = (desc.flags & SPLAT_SCENE_LENIENT) != 0;
    return options;
}

api::Scenes::Made make_scene(io::LoadedScene loaded, const char* name,
                             const splat_scene_file_desc& desc) {
    if (!loaded.report.left_out.empty()) {
        log(LogLevel::kWarning,
            format("'%s': %s are left out", name, loaded.report.left_out.c_str()));
        loaded.report.ignored.push_back(loaded.report.left_out);
    }
    auto object = std::make_shared<api::SceneObject>();
    object->report = report_text(loaded.report);
    if (const auto degree = degree_of(desc))
        object->gaussians = scene::with_sh_degree(std::move(loaded.gaussians), *degree);
    else
        object->gaussians = std::move(loaded.gaussians);
    return object;
}

/// Errors: kInvalidArgument for a version that is not of the format.
Result<io::SaveOptions> save_options(const io::SceneFormat& format,
                                     const splat_scene_file_desc& desc) {
    if (desc.spz_version != 0 && format.write != io::put_spz)
        return invalid("splat_scene_file_desc.spz_version is %u, but the file is a %s; leave it 0",
                       desc.spz_version, format.name);
    io::SaveOptions options;
    options.frame = frame_of(desc);
    options.sh_degree = degree_of(desc);
    if (desc.spz_version != 0) options.spz_version = desc.spz_version;
    options.clamp = (desc.flags & SPLAT_SCENE_CLAMP) != 0;
    return options;
}

}  // namespace

splat_result splat_scene_formats(char* buffer, size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [] { return formats_text(); });
}

splat_result splat_scene_load(const char* path, const splat_scene_file_desc* desc,
                              splat_scene* scene) {
    return api::create(scene, [&]() -> api::Scenes::Made {
        SPLAT_TRY(api::require(path, "path"));
        SPLAT_ASSIGN(const splat_scene_file_desc full, complete(desc));
        SPLAT_ASSIGN(io::LoadedScene loaded,
                     io::load_scene(path, load_options(full), format_of(full)));
        return make_scene(std::move(loaded), path, full);
    });
}

splat_result splat_scene_peek(const char* path, const splat_scene_file_desc* desc, uint64_t* count,
                              uint32_t* sh_degree) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(path, "path", count, "count", sh_degree, "sh_degree"));
        SPLAT_ASSIGN(const splat_scene_file_desc full, complete(desc));
        SPLAT_ASSIGN(const io::SceneHead head,
                     io::load_scene_head(path, load_options(full), format_of(full)));
        *count = head.count;
        *sh_degree = degree_of(full).value_or(head.sh_degree);
        return {};
    });
}

splat_result splat_scene_load_memory(const void* data, size_t bytes,
                                     const splat_scene_file_desc* desc, splat_scene* scene) {
    return api::create(scene, [&]() -> api::Scenes::Made {
        SPLAT_TRY(api::require(data, "data"));
        SPLAT_ASSIGN(const splat_scene_file_desc full, complete(desc));
        const io::Bytes file(static_cast<const std::byte*>(data), bytes);
        SPLAT_ASSIGN(io::LoadedScene loaded,
                     io::read_scene(file, "memory", load_options(full), format_of(full)));
        return make_scene(std::move(loaded), "memory", full);
    });
}

splat_result splat_scene_save(splat_scene scene, const char* path,
                              const splat_scene_file_desc* desc) {
    return api::with(scene, [&](const auto& object) -> Status {
        SPLAT_TRY(api::require(path, "path"));
        SPLAT_ASSIGN(const splat_scene_file_desc full, complete(desc));
        const io::SceneFormat* format = format_of(full);
        if (format == nullptr) SPLAT_SET(format, io::written_scene_format(path));
        SPLAT_ASSIGN(const io::SaveOptions options, save_options(*format, full));
        return io::write_file(path, [&](io::ByteSink& to) {
            const std::shared_lock lock(object->mutex);
            return io::put_scene(object->gaussians, *format, options, to);
        });
    });
}

splat_result splat_scene_save_memory(splat_scene scene, const splat_scene_file_desc* desc,
                                     void* buffer, size_t capacity, size_t* needed) {
    return api::guarded_bytes(buffer, capacity, needed, [&](auto give) -> Status {
        SPLAT_ASSIGN(const auto object, api::find(scene));
        SPLAT_ASSIGN(const splat_scene_file_desc full, complete(desc));
        const io::SceneFormat* const format = format_of(full);
        if (format == nullptr)
            return invalid(
                "splat_scene_file_desc.format is 0, but memory has no extension; name a "
                "SPLAT_SCENE_ format");
        io::BufferSink to;
        SPLAT_ASSIGN(const io::SaveOptions options, save_options(*format, full));
        {
            const std::shared_lock lock(object->mutex);
            SPLAT_TRY(io::put_scene(object->gaussians, *format, options, to));
        }
        return give(to.file);
    });
}
