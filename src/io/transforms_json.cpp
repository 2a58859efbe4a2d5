#include "io/transforms_json.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>

#include "core/json_tree.h"
#include "core/json_writer.h"
#include "core/shown.h"
#include "io/reader.h"
#include "scene/camera_pose.h"

namespace splat::io {
namespace {

using scene::Camera;
using scene::Mat4;

/// A frame. Keys that it lacks are looked up in the file.
class Frame {
  public:
    Frame(const JsonTree& file, const JsonTree& frame, std::size_t index)
        : file_(file), frame_(frame), index_(index) {}

    Status bad(const std::string& problem) const {
        return damaged("frame %zu: %s", index_, problem.c_str());
    }

    /// In the frame, else in the file, else null.
    [[nodiscard]] const JsonTree* value(const char* key) const {
        for (const JsonTree* object : {&frame_, &file_})
            if (const JsonTree* const found = object->find(key);
                found != nullptr && !found->is_null())
                return found;
        return nullptr;
    }

    /// The same, of a number.
    Result<std::optional<double>> find(const char* key) const {
        const JsonTree* const found = value(key);
        if (found == nullptr) return std::optional<double>();
        const std::optional<double> number = found->number();
        if (!number) return bad(std::string("'") + key + "' is not a number");
        return number;
    }

    /// In the frame only.
    [[nodiscard]] const JsonTree* member(const char* key) const { return frame_.find(key); }

  private:
    const JsonTree& file_;
    const JsonTree& frame_;
    std::size_t index_;
};

Result<std::uint32_t> side(const Frame& frame, const char* key, std::uint32_t usual) {
    SPLAT_ASSIGN(const std::optional<double> value, frame.find(key));
    const double pixels = value.value_or(usual);
    if (!(pixels >= 1 && pixels <= scene::kMaxImageSide) || pixels != std::floor(pixels))
        return frame.bad(format("'%s' is %g, expected whole pixels from 1 to %u%s", key, pixels,
                                scene::kMaxImageSide, value ? "" : "; the file has none"));
    return static_cast<std::uint32_t>(pixels);
}

/// From the key `fl`, else from the angle, else `otherwise` (0: an error).
Result<double> focal(const Frame& frame, const char* fl, const char* angle, std::uint32_t pixels,
                     double otherwise) {
    SPLAT_ASSIGN(const std::optional<double> length, frame.find(fl));
    if (length) return *length;
    SPLAT_ASSIGN(const std::optional<double> fov, frame.find(angle));
    if (fov && !(*fov > 0 && *fov < std::numbers::pi))
        return frame.bad(
            format("'%s' is %g, expected radians between 0 and pi, not degrees", angle, *fov));
    if (fov) return pixels / (2 * std::tan(*fov / 2));
    if (otherwise == 0)
        return frame.bad(std::string("neither '") + fl + "' nor '" + angle + "' is given");
    return otherwise;
}

/// The focal length of the image, where the file gives none.
double other_focal(const Camera& camera, const CameraOptions& options, CameraSet& set) {
    const double pixels = options.focal ? options.focal(camera.name) : 0;
    if (pixels > 0 && set.warnings.empty())
        set.warnings.push_back(
            format("no focal length is given: that of the Exif data is taken, "
                   "%.1f pixels for '%s'",
                   pixels, shown(camera.name).c_str()));
    return pixels;
}

Status read_intrinsics(const Frame& frame, std::uint32_t width, std::uint32_t height,
                       const CameraOptions& options, Camera& camera, CameraSet& set) {
    SPLAT_ASSIGN(camera.width, side(frame, "w", width));
    SPLAT_ASSIGN(camera.height, side(frame, "h", height));
    SPLAT_ASSIGN(const std::optional<double> length, frame.find("fl_x"));
    SPLAT_ASSIGN(const std::optional<double> angle, frame.find("camera_angle_x"));
    const double otherwise = length || angle ? 0 : other_focal(camera, options, set);
    SPLAT_ASSIGN(camera.fx, focal(frame, "fl_x", "camera_angle_x", camera.width, otherwise));
    SPLAT_ASSIGN(camera.fy, focal(frame, "fl_y", "camera_angle_y", camera.height, camera.fx));
    SPLAT_ASSIGN(const std::optional<double> cx, frame.find("cx"));
    SPLAT_ASSIGN(const std::optional<double> cy, frame.find("cy"));
    camera.cx = cx.value_or(camera.width / 2.0);
    camera.cy = cy.value_or(camera.height / 2.0);
    return {};
}

Status read_pose(const Frame& frame, Camera& camera) {
    const JsonTree* const found = frame.member("transform_matrix");
    const JsonTree::List* const rows = found == nullptr ? nullptr : found->list();
    if (rows == nullptr || (rows->size() != 4 && rows->size() != 3))
        return frame.bad("'transform_matrix' is missing or not a list of 4 rows");
    Mat4 matrix{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
    for (std::size_t row = 0; row < rows->size(); ++row) {
        const JsonTree::List* const values = (*rows)[row].list();
        if (values == nullptr || values->size() != 4)
            return frame.bad(
                format("row %zu of 'transform_matrix' is not a list of 4 numbers", row));
        for (std::size_t column = 0; column < 4; ++column) {
            const std::optional<double> number = (*values)[column].number();
            if (!number)
                return frame.bad(format("row %zu of 'transform_matrix' holds no number", row));
            matrix[row * 4 + column] = *number;
        }
    }
    auto pose = scene::opencv_from_opengl(matrix);
    if (!pose.ok()) return frame.bad("'transform_matrix': " + pose.status().message());
    camera.world_to_camera = pose.value();
    return {};
}

/// True for a fisheye. Another lens whose parameters are others than those of read_distortion() is noted.
Result<bool> read_fisheye(const Frame& frame, const std::string& name, const CameraOptions& options,
                          CameraSet& set) {
    constexpr std::string_view kModels[] = {"PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL",
                                            "RADIAL",  "OPENCV",         "FULL_OPENCV"};
    bool is_fisheye = false;
    if (const JsonTree* const model = frame.value("camera_model")) {
        if (model->text() == nullptr) return frame.bad("'camera_model' is not text");
        is_fisheye = *model->text() == "OPENCV_FISHEYE";
        if (!(is_fisheye && options.keep_lens) &&
            std::ranges::find(kModels, *model->text()) == std::end(kModels))
            SPLAT_TRY(note_lens(name, "model", "camera_model '" + shown(*model->text()) + "'",
                                options, set));
    }
    if (const JsonTree* const fisheye = frame.value("is_fisheye")) {
        const bool* const is = std::get_if<bool>(&fisheye->value);
        if (is == nullptr) return frame.bad("'is_fisheye' is not true or false");
        if (*is && !options.keep_lens)
            SPLAT_TRY(note_lens(name, "is_fisheye", "is_fisheye", options, set));
        is_fisheye = is_fisheye || *is;
    }
    return is_fisheye;
}

/// k4 is nerfstudio's, a coefficient of the numerator, unless a part of OpenCV's rational model follows it.
Result<scene::Lens> read_distortion(const Frame& frame, const std::string& name, bool is_fisheye,
                                    const CameraOptions& options, CameraSet& set) {
    scene::Lens lens;
    if (is_fisheye) lens.kind = scene::LensKind::kFisheye;
    for (const char* key : {"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"}) {
        SPLAT_ASSIGN(const std::optional<double> value, frame.find(key));
        SPLAT_TRY(note_distortion(name, key, value.value_or(0), options, set));
        if (!scene::set_parameter(lens, key, value.value_or(0)) && value.value_or(0) != 0)
            SPLAT_TRY(
                note_lens(name, key, format("%s = %g of a fisheye", key, *value), options, set));
    }
    const JsonTree* const model = frame.value("camera_model");
    const bool is_rational =
        model != nullptr && model->text() != nullptr && *model->text() == "FULL_OPENCV";
    if (!is_fisheye && !is_rational && lens.denominator[1] == 0 && lens.denominator[2] == 0)
        std::swap(lens.radial[3], lens.denominator[0]);
    return lens;
}

/// The text of a key of the frame; empty if it has none.
Result<std::string> text_of(const Frame& frame, const char* key) {
    const JsonTree* const found = frame.member(key);
    if (found == nullptr || found->is_null()) return std::string();
    if (found->text() == nullptr) return frame.bad(std::string("'") + key + "' is not text");
    return *found->text();
}

/// train_filenames and its like.
Status read_splits(const JsonTree& file, CameraSet& set) {
    for (const std::string split : {"train", "val", "test"}) {
        const std::string key = split + "_filenames";
        const JsonTree* const found = file.find(key);
        if (found == nullptr || found->is_null()) continue;
        const auto bad = [&] { return damaged("'%s' is not a list of names", key.c_str()); };
        if (found->list() == nullptr) return bad();
        std::vector<std::string>& names = set.splits[split];
        for (const JsonTree& name : *found->list()) {
            if (name.text() == nullptr) return bad();
            names.push_back(*name.text());
        }
    }
    return {};
}

}  // namespace

Result<CameraSet> read_transforms_json(Bytes file, std::uint32_t width, std::uint32_t height,
                                       const CameraOptions& options) {
    SPLAT_ASSIGN(const JsonTree json, from_file(parse_json_tree(as_text(file), "cameras")));
    const JsonTree* const found = json.find("frames");
    if (found == nullptr || found->list() == nullptr) return damaged("there is no list 'frames'");
    const JsonTree::List& frames = *found->list();
    if (frames.size() > options.max_cameras)
        return unsupported("%zu frames, the limit is %llu", frames.size(),
                           llu(options.max_cameras));
    CameraSet set;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const Frame frame(json, frames[i], i);
        if (!frames[i].is_object()) return frame.bad("it is not an object");
        Camera camera;
        CameraMaps maps;
        SPLAT_ASSIGN(camera.name, text_of(frame, "file_path"));
        SPLAT_ASSIGN(maps.mask, text_of(frame, "mask_path"));
        SPLAT_ASSIGN(maps.depth, text_of(frame, "depth_file_path"));
        SPLAT_TRY(read_intrinsics(frame, width, height, options, camera, set));
        SPLAT_TRY(read_pose(frame, camera));
        SPLAT_ASSIGN(const bool is_fisheye, read_fisheye(frame, camera.name, options, set));
        SPLAT_ASSIGN(const scene::Lens lens,
                     read_distortion(frame, camera.name, is_fisheye, options, set));
        if (const Status valid = scene::check_camera(camera); !valid.ok())
            return frame.bad(valid.message());
        set.cameras.push_back(std::move(camera));
        set.lenses.push_back(lens);
        set.maps.push_back(std::move(maps));
    }
    SPLAT_TRY(read_splits(json, set));
    if (const JsonTree* const points = json.find("ply_file_path");
        points != nullptr && !points->is_null()) {
        if (points->text() == nullptr) return damaged("'ply_file_path' is not text");
        set.points = *points->text();
    }
    warn_of_ignored(set);
    return set;
}

Result<Buffer> write_transforms_json(const std::vector<Camera>& cameras) {
    JsonWriter json;
    json.begin_object().member("camera_model", "PINHOLE").key("frames").begin_array();
    for (const Camera& camera : cameras) {
        SPLAT_TRY(scene::check_camera(camera));
        SPLAT_ASSIGN(const Mat4 pose, scene::opengl_from_opencv(camera.world_to_camera));
        json.newline(1).begin_object().member("file_path", camera.name);
        json.member("w", camera.width).member("h", camera.height);
        json.member("fl_x", camera.fx).member("fl_y", camera.fy);
        json.member("cx", camera.cx).member("cy", camera.cy);
        json.key("transform_matrix").begin_array();
        for (std::size_t row = 0; row < 4; ++row) json.list(std::span(pose).subspan(row * 4, 4));
        json.end().end();
    }
    json.end().end();
    Buffer file;
    put_text(file, json.text() + "\n");
    return file;
}

}  // namespace splat::io
