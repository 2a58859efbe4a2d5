#include "synthetic/object_writer.h"

#include <filesystem>
#include <numbers>

#include "core/json_writer.h"
#include "core/os/path.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/maps/map_images.h"
#include "io/object_folder.h"
#include "scene/camera_pose.h"
#include "scene/view_places.h"
#include "synthetic/ray_caster.h"

namespace splat::synthetic {
namespace {

namespace fs = std::filesystem;

constexpr double kDistance = 1.3;
constexpr double kFocal = 131.25;  ///< at kFocalSize pixels
constexpr double kFocalSize = 128;
constexpr double kFar = 1.8;
constexpr std::uint32_t kShapeStream = 0;
constexpr std::uint32_t kCameraStream = 1;  ///< the first of one stream for each view

/// All values that decide the bytes of an object.
std::string manifest_text(const WriterDesc& desc) {
    JsonWriter json;
    json.begin_object().member("made_by", "splat_synthetic_write").member("version", 1);
    json.member("category", desc.category).member("seed", desc.seed);
    json.member("resolution", desc.resolution).member("train_views", desc.train_views);
    json.member("test_views", desc.test_views).end();
    return json.text() + "\n";
}

struct Place {
    Split split = Split::kTrain;
    std::uint32_t object = 0;  ///< in the split
};

Result<Place> place_of(const WriterDesc& desc, std::uint32_t index) {
    std::uint32_t object = index;
    const std::uint32_t counts[] = {desc.train_objects, desc.val_objects, desc.test_objects};
    for (const Split split : {Split::kTrain, Split::kVal, Split::kTest}) {
        const std::uint32_t count = counts[static_cast<std::size_t>(split)];
        if (object < count) return Place{split, object};
        object -= count;
    }
    return invalid("index is %u, expected less than %u + %u + %u, the objects", index,
                   desc.train_objects, desc.val_objects, desc.test_objects);
}

struct Shape {
    std::string kind;
    Solids solids;
};

Shape shape_of(const WriterDesc& desc, const Place& place) {
    Random random(desc.seed, static_cast<std::uint32_t>(place.split), place.object, kShapeStream);
    const bool mixed_car = random.chance(0.5);
    const bool car = desc.category == "cars" || (desc.category == "mixed" && mixed_car);
    return {car ? "car" : "chair", fitted(car ? make_car(random) : make_chair(random))};
}

Status write_view(const fs::path& folder, const Solids& solids, const scene::Camera& camera,
                  std::uint32_t view) {
    const Picture made = cast(solids, camera);
    const io::Image rgb = io::image_from_floats(made.rgb, made.width, made.height, 3);
    const std::string name = format("%06u", view);
    SPLAT_TRY(io::write_picture(folder, "rgb", name, rgb));
    SPLAT_TRY(io::write_picture(folder, "depth", name,
                                io::depth_image(made.depth, made.width, made.height, kFar)));
    SPLAT_TRY(io::write_picture(folder, "normal", name,
                                io::normal_image(made.normals, made.width, made.height)));
    SPLAT_TRY(io::write_picture(folder, "mask", name, mask_image(made)));
    return io::write_new_file(os::text_of(folder / "pose" / (name + ".txt")),
                              io::as_bytes(io::srn_pose(camera)));
}

Status write_views(const WriterDesc& desc, const Place& place, const Solids& solids,
                   const fs::path& folder) {
    for (const char* kind : {"rgb", "depth", "normal", "mask", "pose"})
        SPLAT_TRY(io::make_folders(folder / kind));
    const std::uint32_t views = place.split == Split::kTrain ? desc.train_views : desc.test_views;
    scene::Camera camera;
    for (std::uint32_t view = 0; view < views; ++view) {
        camera = view_camera(desc, place.split, place.object, view);
        SPLAT_TRY(write_view(folder, solids, camera, view));
    }
    return io::write_new_file(os::text_of(folder / "intrinsics.txt"),
                              io::as_bytes(io::srn_intrinsics(camera)));
}

/// Directions from the object to the cameras.
Vec3 view_direction(const WriterDesc& desc, Split split, std::uint32_t object, std::uint32_t view) {
    if (split != Split::kTrain) return scene::spiral_direction(view, desc.test_views);
    Random random(desc.seed, static_cast<std::uint32_t>(split), object, kCameraStream + view);
    const double height = random.between(-0.9999, 0.9999);  // "up" is undefined at the poles
    return scene::direction_at(height, random.between(0, 2 * std::numbers::pi));
}

}  // namespace

const char* split_name(Split split) {
    constexpr const char* kNames[] = {"train", "val", "test"};
    return kNames[static_cast<std::size_t>(split)];
}

Status check_desc(const WriterDesc& desc) {
    if (desc.path.empty()) return invalid("path is empty, expected a folder");
    if (desc.category != "cars" && desc.category != "chairs" && desc.category != "mixed")
        return invalid("category is '%s', expected cars, chairs or mixed", desc.category.c_str());
    if (desc.resolution < 8)
        return invalid("resolution is %u, expected 8 to 2048", desc.resolution);
    if (desc.resolution > 2048)
        return unsupported("resolution is %u, expected 8 to 2048", desc.resolution);
    for (const std::uint32_t views : {desc.train_views, desc.test_views})
        if (views < 1 || views > 100000)
            return invalid("%u views of an object, expected 1 to 100000", views);
    const std::uint64_t objects =
        std::uint64_t{desc.train_objects} + desc.val_objects + desc.test_objects;
    if (objects < 1 || objects > 1000000)
        return invalid("%llu objects, expected 1 to 1000000", llu(objects));
    return {};
}

scene::Camera view_camera(const WriterDesc& desc, Split split, std::uint32_t object,
                          std::uint32_t view) {
    scene::Camera camera;
    camera.name = format("%06u", view);
    camera.width = camera.height = desc.resolution;
    camera.fx = camera.fy = kFocal * desc.resolution / kFocalSize;
    camera.cx = camera.cy = desc.resolution / 2.0;
    const Vec3 eye = view_direction(desc, split, object, view) * kDistance;
    const auto pose = scene::look_at(eye, {0, 0, 0}, {0, 0, 1});
    SPLAT_ASSERT(pose.ok());
    camera.world_to_camera = pose.value();
    return camera;
}

Status write_object(const WriterDesc& desc, std::uint32_t index) {
    SPLAT_TRY(check_desc(desc));
    SPLAT_ASSIGN(const Place place, place_of(desc, index));
    const fs::path root = os::path_of(desc.path) / ("srn_" + desc.category);
    const fs::path folder = root / (desc.category + "_" + split_name(place.split));
    SPLAT_TRY(io::make_folders(folder));
    SPLAT_TRY(io::make_with(root, "synthetic.json", manifest_text(desc)));
    const Shape shape = shape_of(desc, place);
    const std::string name = format("%06u_%s", place.object, shape.kind.c_str());
    return io::write_once(folder / name, [&](const fs::path& to) {
        return write_views(desc, place, shape.solids, to);
    });
}

}  // namespace splat::synthetic
