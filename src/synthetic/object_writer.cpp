#include "synthetic/object_writer.h"

#include <filesystem>
#include <numbers>

#include "core/json_writer.h"
#include "core/os/path.h"
#include "core/os/process.h"
#include "io/file.h"
#include "io/folder.h"
#include "scene/camera_pose.h"
#include "synthetic/ray_caster.h"

namespace splat::synthetic {
namespace {

namespace fs = std::filesystem;

constexpr double kDistance = 1.3;
constexpr double kFocal = 131.25;  ///< at kFocalSize pixels
constexpr double kFocalSize = 128;
constexpr double kFar = 1.8;
constexpr double kSpiralTurns = 4;
/// Where on the spiral the front of the object is at 45 degrees: view 64 of 251, the one that the
/// reference conditions on.
constexpr double kSpiralFront = 64.0 / 251;
constexpr std::uint32_t kShapeStream = 0;
constexpr std::uint32_t kCameraStream = 1;  ///< the first of one stream for each view

std::string text_of(const double* values, std::size_t count) {
    std::string text;
    for (std::size_t i = 0; i < count; ++i) {
        if (i > 0) text += ' ';
        text += format("%.9g", values[i]);
    }
    return text + "\n";
}

/// Row-major camera-to-world, as SRN stores it.
std::string pose_text(const scene::Camera& camera) {
    const scene::Mat3 turn = glm::transpose(scene::rotation_of(camera.world_to_camera));
    return text_of(scene::make_pose(turn, scene::camera_center(camera)).data(), 16);
}

std::string intrinsics_text(const WriterDesc& desc) {
    const double focal = kFocal * desc.resolution / kFocalSize;
    const double middle = desc.resolution / 2.0;
    const double first[] = {focal, middle, middle, 0};
    return text_of(first, 4) + "0 0 0\n1\n" + format("%u %u\n", desc.resolution, desc.resolution);
}

/// All values that decide the bytes of an object.
std::string manifest_text(const WriterDesc& desc) {
    JsonWriter json;
    json.begin_object().member("made_by", "splat_synthetic_write").member("version", 1);
    json.member("category", desc.category).member("seed", desc.seed);
    json.member("resolution", desc.resolution).member("train_views", desc.train_views);
    json.member("test_views", desc.test_views).end();
    return json.text() + "\n";
}

/// Checks that the folder holds nothing made with other values.
Status check_manifest(const WriterDesc& desc, const fs::path& folder) {
    const fs::path path = folder / "synthetic.json";
    const std::string expected = manifest_text(desc);
    std::error_code code;
    if (!fs::exists(path, code)) return io::write_file(os::text_of(path), io::as_bytes(expected));
    SPLAT_ASSIGN(const io::Buffer found, io::read_file(os::text_of(path), 1U << 16));
    if (io::as_text(found) == expected) return {};
    return invalid(
        "'%s' holds data made with other values: %.*sexpected: %suse another folder, "
        "or the same values to add objects",
        os::text_of(folder).c_str(), static_cast<int>(found.size()), io::as_text(found).data(),
        expected.c_str());
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

/// Removes folders of this object that killed processes left: ".<name>.<process>-<number>.tmp".
void remove_stale(const fs::path& folder, const std::string& name) {
    std::error_code code;
    const std::string prefix = "." + name + ".";
    for (const auto& entry : fs::directory_iterator(folder, code)) {
        const std::string found = os::text_of(entry.path().filename());
        if (found.compare(0, prefix.size(), prefix) != 0) continue;
        const int process = std::atoi(found.c_str() + prefix.size());
        if (process > 0 && !os::may_run(process)) fs::remove_all(entry, code);
    }
}

Status write_view(const fs::path& folder, const Solids& solids, const scene::Camera& camera,
                  std::uint32_t view) {
    const Picture picture = cast(solids, camera);
    const io::Image rgb = io::image_from_floats(picture.rgb, picture.width, picture.height, 3);
    const std::string name = format("%06u", view);
    const std::pair<const char*, io::Image> images[] = {{"rgb", rgb},
                                                        {"depth", depth_image(picture, kFar)},
                                                        {"normal", normal_image(picture)},
                                                        {"mask", mask_image(picture)}};
    for (const auto& [kind, image] : images) {
        SPLAT_ASSIGN(const io::Buffer file, io::write_png(image, io::PngEffort::kFast));
        SPLAT_TRY(io::write_new_file(os::text_of(folder / kind / (name + ".png")), file));
    }
    return io::write_new_file(os::text_of(folder / "pose" / (name + ".txt")),
                              io::as_bytes(pose_text(camera)));
}

Status write_views(const WriterDesc& desc, const Place& place, const Solids& solids,
                   const fs::path& folder) {
    for (const char* kind : {"rgb", "depth", "normal", "mask", "pose"})
        SPLAT_TRY(io::make_folders(folder / kind));
    const std::uint32_t views = place.split == Split::kTrain ? desc.train_views : desc.test_views;
    for (std::uint32_t view = 0; view < views; ++view)
        SPLAT_TRY(
            write_view(folder, solids, view_camera(desc, place.split, place.object, view), view));
    return io::write_new_file(os::text_of(folder / "intrinsics.txt"),
                              io::as_bytes(intrinsics_text(desc)));
}

/// Directions from the object to the cameras.
Vec3 view_direction(const WriterDesc& desc, Split split, std::uint32_t object, std::uint32_t view) {
    double height = 0;
    double azimuth = 0;
    if (split == Split::kTrain) {
        Random random(desc.seed, static_cast<std::uint32_t>(split), object, kCameraStream + view);
        height = random.between(-0.9999, 0.9999);  // away from the poles, where "up" is undefined
        azimuth = random.between(0, 2 * std::numbers::pi);
    } else {
        const double part = (view + 0.5) / desc.test_views;
        height = std::sin(part * std::numbers::pi / 2 * 0.999);
        azimuth = 2 * std::numbers::pi * (kSpiralTurns * (part - kSpiralFront) + 0.125);
    }
    const double flat = std::sqrt(1 - height * height);
    return {flat * std::cos(azimuth), flat * std::sin(azimuth), height};
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
    SPLAT_TRY(check_manifest(desc, root));
    const Shape shape = shape_of(desc, place);
    const std::string name = format("%06u_%s", place.object, shape.kind.c_str());
    std::error_code code;
    if (fs::exists(folder / name, code)) return {};
    remove_stale(folder, name);
    const Status status = io::write_folder(
        folder / name, io::temporary_of(folder / name),
        [&](const fs::path& to) { return write_views(desc, place, shape.solids, to); });
    return fs::exists(folder / name, code) ? Status() : status;  // another writer may be faster
}

}  // namespace splat::synthetic
