#include "io/colmap.h"

#include <filesystem>
#include <map>
#include <span>
#include <unordered_set>

#include "core/os/path.h"
#include "core/shown.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/reader.h"
#include "scene/camera_pose.h"

namespace splat::io {
namespace {

using scene::LensKind;

/// A lens model of COLMAP: how many parameters it has, in this order.
struct LensModel {
    std::int32_t id;
    std::string_view name;
    std::size_t parameters;
    bool one_focal;  ///< f cx cy instead of fx fy cx cy
    LensKind kind;
    std::span<const char* const> distortion;  ///< names of the parameters that follow
};

constexpr const char* kRadial1[] = {"k"};
constexpr const char* kRadial2[] = {"k1", "k2"};
constexpr const char* kOpenCv[] = {"k1", "k2", "p1", "p2"};
constexpr const char* kFullOpenCv[] = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};

constexpr const char* kFisheye[] = {"k1", "k2", "k3", "k4"};
constexpr const char* kThinPrism[] = {"k1", "k2", "p1", "p2", "k3", "k4", "sx1", "sy1"};
constexpr const char* kFov[] = {"omega"};

constexpr LensModel kLensModels[] = {
    {0, "SIMPLE_PINHOLE", 3, true, LensKind::kPerspective, {}},
    {1, "PINHOLE", 4, false, LensKind::kPerspective, {}},
    {2, "SIMPLE_RADIAL", 4, true, LensKind::kPerspective, kRadial1},
    {3, "RADIAL", 5, true, LensKind::kPerspective, kRadial2},
    {4, "OPENCV", 8, false, LensKind::kPerspective, kOpenCv},
    {5, "OPENCV_FISHEYE", 8, false, LensKind::kFisheye, kFisheye},
    {6, "FULL_OPENCV", 12, false, LensKind::kPerspective, kFullOpenCv},
    {7, "FOV", 5, false, LensKind::kFov, kFov},
    {8, "SIMPLE_RADIAL_FISHEYE", 4, true, LensKind::kFisheye, kRadial1},
    {9, "RADIAL_FISHEYE", 5, true, LensKind::kFisheye, kRadial2},
    {10, "THIN_PRISM_FISHEYE", 12, false, LensKind::kFisheye, kThinPrism}};

struct ColmapLens {
    const LensModel* model = nullptr;
    std::uint64_t width = 0;
    std::uint64_t height = 0;
    std::vector<double> parameters;
};

using Color = std::array<std::uint8_t, 3>;
using Lenses = std::map<std::uint64_t, ColmapLens>;

/// The line or record of an image.
struct ColmapPose {
    std::uint64_t camera = 0;
    std::string name;
    double rotation[4] = {};  ///< w x y z
    double translation[3] = {};
};

const LensModel* find_lens_model(std::int32_t id) {
    for (const LensModel& model : kLensModels)
        if (model.id == id) return &model;
    return nullptr;
}

const LensModel* find_lens_model(std::string_view name) {
    for (const LensModel& model : kLensModels)
        if (model.name == name) return &model;
    return nullptr;
}

Status add_camera(const Lenses& lenses, const ColmapPose& pose, const CameraOptions& options,
                  CameraSet& set) {
    const auto found = lenses.find(pose.camera);
    if (found == lenses.end())
        return damaged("COLMAP: image '%s' names camera %llu, which does not exist",
                       shown(pose.name).c_str(), llu(pose.camera));
    if (set.cameras.size() >= options.max_cameras)
        return unsupported("COLMAP: more than %llu images", llu(options.max_cameras));
    const ColmapLens& lens = found->second;
    const std::vector<double>& p = lens.parameters;
    if (lens.width > scene::kMaxImageSide || lens.height > scene::kMaxImageSide)
        return damaged("COLMAP: camera %llu of %llu x %llu pixels", llu(pose.camera),
                       llu(lens.width), llu(lens.height));
    const std::size_t center = lens.model->one_focal ? 1 : 2;
    scene::Camera camera;
    camera.name = pose.name;
    camera.width = static_cast<std::uint32_t>(lens.width);
    camera.height = static_cast<std::uint32_t>(lens.height);
    camera.fx = p[0];
    camera.fy = lens.model->one_focal ? p[0] : p[1];
    camera.cx = p[center];
    camera.cy = p[center + 1];
    const bool other_lens = lens.model->kind != LensKind::kPerspective;
    if (other_lens && !options.keep_lens)
        SPLAT_TRY(note_lens(pose.name, "model", "camera model " + std::string(lens.model->name),
                            options, set));
    scene::Lens distortion{.kind = lens.model->kind};
    for (std::size_t i = 0; i < lens.model->distortion.size(); ++i) {
        const char* const name = lens.model->distortion[i];
        const double value = p[center + 2 + i];
        scene::set_parameter(distortion, name, value);
        if (!other_lens) SPLAT_TRY(note_distortion(pose.name, name, value, options, set));
    }
    const auto matrix = scene::pose_from_quaternion(
        {pose.rotation[0], pose.rotation[1], pose.rotation[2], pose.rotation[3]},
        {pose.translation[0], pose.translation[1], pose.translation[2]});
    if (!matrix.ok())
        return damaged("COLMAP: image '%s': %s", shown(pose.name).c_str(),
                       matrix.status().message().c_str());
    camera.world_to_camera = matrix.value();
    SPLAT_TRY(from_file(scene::check_camera(camera)));
    set.cameras.push_back(std::move(camera));
    set.lenses.push_back(distortion);
    return {};
}

/// `count` numbers of one kind, from either form of the files.
template <class Source>
Status read_numbers(Source& source, std::span<double> numbers, const char* field) {
    for (double& number : numbers) SPLAT_TRY(source.read(number, field));
    return {};
}

/// The end of a camera's record: size and parameters of `lens`, whose model is known.
template <class Source>
Status read_lens_numbers(Source& source, ColmapLens& lens) {
    SPLAT_TRY(source.read(lens.width, "width"));
    SPLAT_TRY(source.read(lens.height, "height"));
    lens.parameters.resize(lens.model->parameters);
    return read_numbers(source, lens.parameters, "parameter");
}

template <class Source>
Status read_pose_numbers(Source& source, ColmapPose& pose) {
    SPLAT_TRY(read_numbers(source, pose.rotation, "quaternion"));
    return read_numbers(source, pose.translation, "translation");
}

Status unsupported_model(const std::string& name) {
    return unsupported("COLMAP: camera model %s, expected one of %s; undistort the images",
                       name.c_str(), joined(kLensModels, &LensModel::name).c_str());
}

Result<Lenses> read_text_lenses(Bytes file) {
    Lenses lenses;
    Lines lines(file, "COLMAP cameras.txt");
    std::string_view line;
    while (lines.next_record(line)) {
        Words words(line, lines);
        std::uint64_t id = 0;
        ColmapLens lens;
        SPLAT_TRY(words.read(id, "camera id"));
        SPLAT_ASSIGN(const std::string_view name, words.word("model"));
        lens.model = find_lens_model(name);
        if (lens.model == nullptr)
            return unsupported_model("'" + std::string(name.substr(0, 40)) + "'");
        SPLAT_TRY(read_lens_numbers(words, lens));
        if (!words.done())
            return lines.bad(format("more than the %zu parameters of %s", lens.model->parameters,
                                    std::string(name).c_str()));
        if (!lenses.emplace(id, std::move(lens)).second)
            return lines.bad("camera id " + std::to_string(id) + " appears twice");
    }
    return lenses;
}

Status need_count(const Reader& reader, std::uint64_t count, std::uint64_t least_each) {
    return reader.need(count, least_each, "records");
}

Status need_end(const Reader& reader, std::uint64_t count) {
    if (reader.left() == 0) return {};
    return damaged(
        "%s: %zu bytes after the last of %llu records, at byte %zu, expected none: the "
        "count is too small, or something was appended to the file",
        reader.what().c_str(), reader.left(), llu(count), reader.position());
}

Status appears_twice(const Reader& reader, const char* kind, std::uint32_t id, std::size_t at) {
    return damaged("%s: %s id %u, at byte %zu, appears twice", reader.what().c_str(), kind, id, at);
}

Result<Lenses> read_binary_lenses(Bytes file) {
    constexpr std::uint64_t kLeastBytes = 24 + 3 * 8;
    Reader reader(file, "COLMAP cameras.bin");
    std::uint64_t count = 0;
    SPLAT_TRY(reader.read(count, "count"));
    SPLAT_TRY(need_count(reader, count, kLeastBytes));
    Lenses lenses;
    for (std::uint64_t i = 0; i < count; ++i) {
        std::uint32_t id = 0;
        std::int32_t model = 0;
        ColmapLens lens;
        const std::size_t start = reader.position();
        SPLAT_TRY(reader.read(id, "camera id"));
        SPLAT_TRY(reader.read(model, "model"));
        lens.model = find_lens_model(model);
        if (lens.model == nullptr) return unsupported_model("number " + std::to_string(model));
        SPLAT_TRY(read_lens_numbers(reader, lens));
        if (!lenses.emplace(id, std::move(lens)).second)
            return appears_twice(reader, "camera", id, start);
    }
    SPLAT_TRY(need_end(reader, count));
    return lenses;
}

/// The line after that of an image: numbers X Y POINT3D_ID of each point, or nothing.
Status check_points(std::string_view line, const Lines& lines, const std::string& image) {
    Words words(line, lines);
    bool numbers = true;
    std::size_t count = 0;
    for (double number = 0; numbers && !words.done(); ++count)
        numbers = words.read(number, "point").ok();
    if (numbers && count % 3 == 0) return {};
    return lines.bad("expected the points of the image '" + shown(image) +
                     "', three numbers each, or an empty line: every image has two lines");
}

Status need_images(const CameraSet& set, const char* what) {
    return set.cameras.empty() ? damaged("%s: there is no image", what) : Status();
}

Result<ColoredPoints> read_binary_points(Bytes file) {
    constexpr std::uint64_t kLeastBytes = 8 + 3 * 8 + 3 + 8 + 8;
    constexpr std::uint64_t kSightBytes = 8;
    Reader reader(file, "COLMAP points3D.bin");
    std::uint64_t count = 0;
    SPLAT_TRY(reader.read(count, "count"));
    SPLAT_TRY(need_count(reader, count, kLeastBytes));
    ColoredPoints points{std::vector<scene::Vec3>(count), std::vector<Color>(count)};
    for (std::size_t i = 0; i < count; ++i) {
        std::uint64_t sights = 0;
        SPLAT_TRY(reader.take(8, "point id").status());
        SPLAT_TRY(read_numbers(reader, {glm::value_ptr(points.positions[i]), 3}, "position"));
        for (std::uint8_t& value : points.colors[i]) SPLAT_TRY(reader.read(value, "colour"));
        SPLAT_TRY(reader.take(8, "error").status());
        SPLAT_TRY(reader.read(sights, "length of the track"));
        SPLAT_TRY(reader.need(sights, kSightBytes, "track"));
        SPLAT_TRY(reader.take(sights * kSightBytes, "track").status());
    }
    SPLAT_TRY(need_end(reader, count));
    return points;
}

Result<ColoredPoints> read_text_points(Bytes file) {
    ColoredPoints points;
    Lines lines(file, "COLMAP points3D.txt");
    std::string_view line;
    while (lines.next_record(line)) {
        Words words(line, lines);
        std::uint64_t id = 0;
        scene::Vec3 point{};
        Color color{};
        SPLAT_TRY(words.read(id, "point id"));
        SPLAT_TRY(read_numbers(words, {glm::value_ptr(point), 3}, "position"));
        for (std::uint8_t& value : color) SPLAT_TRY(words.read(value, "colour"));
        points.positions.push_back(point);
        points.colors.push_back(color);
    }
    return points;
}

}  // namespace

Status note_lens(const std::string& camera, const std::string& kind, const std::string& what,
                 const CameraOptions& options, CameraSet& set) {
    if (!options.ignore_distortion)
        return unsupported(
            "camera '%s': %s, only pinhole cameras %sare supported: undistort the images "
            "('colmap image_undistorter' makes images and cameras of a COLMAP model)%s",
            shown(camera).c_str(), what.c_str(),
            options.keep_lens ? "and the lenses of COLMAP's models " : "",
            options.may_ignore ? ", or ignore it (SPLAT_CAMERA_IGNORE_DISTORTION)" : "");
    IgnoredLens& ignored =
        set.ignored.try_emplace(kind, IgnoredLens{what, camera, {}}).first->second;
    ignored.cameras.insert(set.cameras.size());
    return {};
}

Status note_distortion(const std::string& camera, const char* parameter, double value,
                       const CameraOptions& options, CameraSet& set) {
    if (value == 0 || options.keep_lens) return {};
    return note_lens(camera, parameter, format("distortion %s = %g", parameter, value), options,
                     set);
}

void warn_of_ignored(CameraSet& set) {
    if (set.ignored.empty()) return;
    std::set<std::size_t> cameras;
    std::string what;
    for (const auto& [kind, ignored] : set.ignored) {
        cameras.insert(ignored.cameras.begin(), ignored.cameras.end());
        what += (what.empty() ? "" : ", ") + ignored.what;
    }
    const std::string first = shown(set.ignored.begin()->second.camera);
    set.warnings.push_back(cameras.size() == 1
                               ? format("camera '%s': %s is ignored", first.c_str(), what.c_str())
                               : format("%zu cameras, such as '%s': %s is ignored", cameras.size(),
                                        first.c_str(), what.c_str()));
}

Result<CameraSet> read_colmap_text(Bytes cameras, Bytes images, const CameraOptions& options) {
    SPLAT_ASSIGN(const Lenses lenses, read_text_lenses(cameras));
    CameraSet set;
    std::unordered_set<std::uint64_t> ids;
    Lines lines(images, "COLMAP images.txt");
    std::string_view line;
    while (lines.next_record(line)) {
        Words words(line, lines);
        std::uint64_t id = 0;
        ColmapPose pose;
        SPLAT_TRY(words.read(id, "image id"));
        SPLAT_TRY(read_pose_numbers(words, pose));
        SPLAT_TRY(words.read(pose.camera, "camera id"));
        pose.name = words.rest();
        if (pose.name.empty()) return lines.bad("there is no name");
        if (pose.name.find('\0') != std::string::npos) return lines.bad("a NUL in the name");
        if (!ids.insert(id).second)
            return lines.bad("image id " + std::to_string(id) + " appears twice");
        SPLAT_TRY(add_camera(lenses, pose, options, set));
        if (lines.next(line)) SPLAT_TRY(check_points(line, lines, pose.name));
    }
    SPLAT_TRY(need_images(set, "COLMAP images.txt"));
    warn_of_ignored(set);
    return set;
}

Result<CameraSet> read_colmap_binary(Bytes cameras, Bytes images, const CameraOptions& options) {
    constexpr std::uint64_t kLeastBytes = 4 + 7 * 8 + 4 + 1 + 8;
    constexpr std::uint64_t kPointBytes = 24;
    SPLAT_ASSIGN(const Lenses lenses, read_binary_lenses(cameras));
    Reader reader(images, "COLMAP images.bin");
    std::uint64_t count = 0;
    SPLAT_TRY(reader.read(count, "count"));
    SPLAT_TRY(need_count(reader, count, kLeastBytes));
    CameraSet set;
    std::unordered_set<std::uint32_t> ids;
    for (std::uint64_t i = 0; i < count; ++i) {
        std::uint32_t id = 0;
        std::uint32_t camera = 0;
        std::uint64_t points = 0;
        ColmapPose pose;
        const std::size_t start = reader.position();
        SPLAT_TRY(reader.read(id, "image id"));
        SPLAT_TRY(read_pose_numbers(reader, pose));
        SPLAT_TRY(reader.read(camera, "camera id"));
        SPLAT_ASSIGN(pose.name, reader.take_string("name"));
        pose.camera = camera;
        SPLAT_TRY(reader.read(points, "count of points"));
        SPLAT_TRY(reader.need(points, kPointBytes, "points"));
        SPLAT_TRY(reader.take(points * kPointBytes, "points").status());
        if (!ids.insert(id).second) return appears_twice(reader, "image", id, start);
        SPLAT_TRY(add_camera(lenses, pose, options, set));
    }
    SPLAT_TRY(need_end(reader, count));
    SPLAT_TRY(need_images(set, "COLMAP images.bin"));
    warn_of_ignored(set);
    return set;
}

Result<CameraSet> read_colmap(Bytes cameras, Bytes images, const CameraOptions& options) {
    const std::string_view head = as_text(cameras).substr(0, sizeof(std::uint64_t));
    return head.find('\0') != std::string_view::npos ? read_colmap_binary(cameras, images, options)
                                                     : read_colmap_text(cameras, images, options);
}

Result<std::string> find_colmap(const std::string& folder) {
    for (const char* below : kColmapFolders)
        for (const char* name : {"cameras.bin", "cameras.txt"}) {
            std::string path = os::text_of(os::path_of(folder) / below / name);
            SPLAT_ASSIGN(const bool is_there, has_file(path));
            if (is_there) return path;
        }
    return std::string();
}

Result<CameraSet> load_colmap(const std::string& folder, const CameraOptions& options) {
    SPLAT_ASSIGN(const std::string stem, find_colmap(folder));
    if (stem.empty())
        return not_found(
            "'%s' holds no COLMAP model: neither cameras.bin nor cameras.txt, nor in "
            "sparse/0 or sparse",
            folder.c_str());
    const bool binary = stem.ends_with(".bin");
    const std::string place = stem.substr(0, stem.rfind('/'));
    SPLAT_ASSIGN(const Buffer cameras, read_file(stem));
    SPLAT_ASSIGN(const Buffer images, read_file(place + (binary ? "/images.bin" : "/images.txt")));
    return in_file(binary ? read_colmap_binary(cameras, images, options)
                          : read_colmap_text(cameras, images, options),
                   place);
}

Result<ColoredPoints> load_colmap_points(const std::string& folder) {
    SPLAT_ASSIGN(const std::string cameras, find_colmap(folder));
    const std::string path = cameras.substr(0, cameras.rfind('/') + 1) + "points3D" +
                             (cameras.ends_with(".bin") ? ".bin" : ".txt");
    SPLAT_ASSIGN(const bool is_there, has_file(path));
    if (cameras.empty() || !is_there) return ColoredPoints();
    SPLAT_ASSIGN(const Buffer file, read_file(path));
    return in_file(path.ends_with(".bin") ? read_binary_points(file) : read_text_points(file),
                   path);
}

}  // namespace splat::io
