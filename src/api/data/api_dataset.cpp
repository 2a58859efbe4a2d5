#include "api/api_guard.h"
#include "api/handles.h"
#include "core/path_name.h"
#include "data/dataset_check.h"
#include "data/planes/plane_channels.h"
#include "synthetic/object_writer.h"

using namespace splat;

static_assert(SPLAT_DATA_DEPTH == data::flag_of(data::MapKind::kDepth));
static_assert(SPLAT_DATA_NORMAL == data::flag_of(data::MapKind::kNormal));
static_assert(SPLAT_DATA_MASK == data::flag_of(data::MapKind::kMask));
static_assert(SPLAT_DATA_PLANE == data::flag_of(data::MapKind::kPlane));

namespace {

constexpr std::uint32_t kMapFlags =
    SPLAT_DATA_DEPTH | SPLAT_DATA_NORMAL | SPLAT_DATA_MASK | SPLAT_DATA_PLANE;

std::uint32_t value_or(std::uint32_t value, std::uint32_t fallback) {
    return value != 0 ? value : fallback;
}

Result<synthetic::WriterDesc> synthetic_desc(const splat_synthetic_desc* desc) {
    SPLAT_TRY(api::check_desc(desc, 0));
    SPLAT_TRY(api::require(desc->path, "desc.path"));
    synthetic::WriterDesc value;
    value.path = desc->path;
    if (desc->category != nullptr) value.category = desc->category;
    SPLAT_COPY(value, *desc, seed, train_objects, val_objects, test_objects);
    value.resolution = value_or(desc->resolution, value.resolution);
    value.train_views = value_or(desc->train_views, value.train_views);
    value.test_views = value_or(desc->test_views, value.test_views);
    return value;
}

/// The arrays of `views` hold n views of R x R pixels.
Status check_views(const splat_dataset_views& views, std::uint64_t n, std::uint64_t resolution) {
    const std::uint64_t pixels = resolution * resolution;
    const struct {
        const char* name;
        const float* array;
        std::uint64_t length, each;
    } rows[] = {{"images", views.images, views.image_count, 3 * pixels},
                {"depths", views.depths, views.depth_count, pixels},
                {"normals", views.normals, views.normal_count, 3 * pixels},
                {"masks", views.masks, views.mask_count, pixels},
                {"view_to_world", views.view_to_world, views.view_to_world_count, 16},
                {"quaternions", views.quaternions, views.quaternion_count, 4},
                {"focals", views.focals, views.focal_count, 2},
                {"origin_distances", views.origin_distances, views.origin_distance_count, 1},
                {"planes", views.planes, views.plane_count, data::kPlaneChannels * pixels}};
    for (const auto& row : rows)
        if (row.array != nullptr && row.length != 0 && row.length < n * row.each)
            return invalid("splat_dataset_views.%s has %llu floats, %llu views take %llu", row.name,
                           llu(row.length), llu(n), llu(n * row.each));
    return {};
}

}  // namespace

splat_result splat_dataset_open(const splat_dataset_desc* desc, splat_dataset* dataset) {
    return api::create(dataset, [&]() -> api::Datasets::Made {
        SPLAT_TRY(api::check_desc(desc, kMapFlags | SPLAT_DATA_LENIENT | SPLAT_DATA_ALLOW_MISSING));
        SPLAT_TRY(api::require(desc->path, "desc.path"));
        data::DatasetDesc value;
        value.path = desc->path;
        if (desc->format != nullptr) value.format = desc->format;
        if (desc->split != nullptr) value.split = desc->split;
        if (desc->category != nullptr) value.category = desc->category;
        if (desc->objects_file != nullptr) value.objects_file = desc->objects_file;
        if (desc->excluded_file != nullptr) value.excluded_file = desc->excluded_file;
        if (desc->views_file != nullptr) value.views_file = desc->views_file;
        value.maps = desc->flags & kMapFlags;
        value.lenient = (desc->flags & SPLAT_DATA_LENIENT) != 0;
        value.allow_missing = (desc->flags & SPLAT_DATA_ALLOW_MISSING) != 0;
        SPLAT_COPY(value, *desc, resolution, limit, cache_bytes);
        for (std::size_t i = 0; i < 3; ++i) value.background[i] = desc->background[i];
        auto object = std::make_shared<api::DatasetObject>();
        SPLAT_ASSIGN(object->dataset, data::Dataset::open(value));
        object->report = data::report_text(*object->dataset);
        return object;
    });
}

splat_result splat_dataset_report(splat_dataset dataset, char* buffer, size_t capacity,
                                  size_t* needed) {
    return api::report(dataset, buffer, capacity, needed,
                       [](auto& object) { return object.report; });
}

splat_result splat_dataset_read(splat_dataset dataset, uint32_t object, const uint32_t* views,
                                uint32_t count, splat_dataset_views* out) {
    return api::with(dataset, [&](const auto& found) -> Status {
        if (count > 0) SPLAT_TRY(api::require(views, "views"));
        splat_dataset_views to{};
        SPLAT_TRY(api::take_input(out, "out", to));
        SPLAT_TRY(check_views(to, count, found->dataset->resolution()));
        data::ViewArrays arrays;
        SPLAT_COPY(arrays, to, images, depths, normals, masks, view_to_world, quaternions, focals,
                   origin_distances, planes);
        return found->dataset->read(object, {views, count}, arrays);
    });
}

splat_result splat_dataset_check(splat_dataset dataset, uint32_t object, char* buffer,
                                 size_t capacity, size_t* needed) {
    return api::report(dataset, buffer, capacity, needed,
                       [object](auto& found) { return data::check_text(*found.dataset, object); });
}

splat_result splat_path_name(const char* name, char* buffer, size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [&]() -> Result<std::string> {
        SPLAT_TRY(api::require(name, "name"));
        return PathName(name).text();
    });
}

splat_result splat_synthetic_write(const splat_synthetic_desc* desc, uint32_t index) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const synthetic::WriterDesc value, synthetic_desc(desc));
        return synthetic::write_object(value, index);
    });
}
