#include "mesh_views/object_writer.h"

#include <algorithm>
#include <filesystem>

#include "core/os/path.h"
#include "core/parallel.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/maps/map_images.h"
#include "io/object_folder.h"
#include "io/transforms_json.h"
#include "mesh_views/look.h"
#include "scene/camera_pose.h"

namespace splat::mesh_views {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kViewBytes = 64 << 20;  ///< memory of views that are drawn together
constexpr std::uint64_t kMostViews = 16;
constexpr std::uint64_t kPixelBytes = 11 * sizeof(float);
constexpr const char* kValuesFile = "rendered.json";

/// The folder of the data set, which holds those of splits.
fs::path root_of(const ViewsDesc& desc) {
    const fs::path path = os::path_of(desc.path);
    return desc.layout == Layout::kSrn ? path / ("srn_" + desc.category) : path;
}

fs::path folder_of(const ViewsDesc& desc, const std::string& split) {
    const bool srn = desc.layout == Layout::kSrn;
    return root_of(desc) / (srn ? desc.category + "_" + split : split) / desc.name;
}

/// An object on its way to its folder.
class Writer {
  public:
    Writer(const ViewsDesc& desc, const scene::TriangleMesh& mesh, const Draw& draw)
        : desc_(desc), mesh_(mesh), draw_(draw) {}

    Status run(const fs::path& folder) {
        folder_ = folder;
        for (const char* kind : kinds()) SPLAT_TRY(io::make_folders(folder_ / kind));
        const scene::MeshMeasures measures = scene::measure(mesh_);
        if (measures.zero_area == mesh_.triangles.size())
            return damaged(
                "'%s' has no surface: each of its %zu triangles has an area of 0; give it faces "
                "whose corners do not lie on a line",
                desc_.name.c_str(), mesh_.triangles.size());
        for (const scene::Vec3& corner : {measures.low, measures.high})
            reach_ = std::max(reach_, glm::length(glm::max(-corner, corner)));
        const std::uint64_t bytes = kPixelBytes * desc_.size * desc_.size;
        const auto together = static_cast<std::uint32_t>(
            std::clamp(kViewBytes / bytes, std::uint64_t{1}, kMostViews));
        for (std::uint32_t first = 0; first < desc_.views(); first += together)
            SPLAT_TRY(write_views(first, std::min(together, desc_.views() - first)));
        if (!seen_)
            return damaged(
                "'%s' is in none of its %u views: its box goes from (%g, %g, %g) to (%g, %g, %g), "
                "and the "
                "cameras look at the origin from a distance of %g; give it another size or place",
                desc_.name.c_str(), desc_.views(), measures.low.x, measures.low.y, measures.low.z,
                measures.high.x, measures.high.y, measures.high.z, desc_.distance);
        if (desc_.points > 0) SPLAT_TRY(write_points());
        return write_cameras();
    }

  private:
    [[nodiscard]] std::vector<const char*> kinds() const {
        std::vector<const char*> all = {"rgb"};
        if (desc_.depth) all.push_back("depth");
        if (desc_.normal) all.push_back("normal");
        if (desc_.mask) all.push_back("mask");
        if (desc_.albedo) all.push_back("albedo");
        if (desc_.layout == Layout::kSrn) all.push_back("pose");
        return all;
    }

    Status write_views(std::uint32_t first, std::uint32_t count) {
        std::vector<scene::Camera> own;
        for (std::uint32_t i = 0; i < count; ++i) {
            cameras_.push_back(view_camera(desc_, first + i));
            own.push_back(in_mesh_axes(cameras_.back(), desc_.up));
        }
        SPLAT_ASSIGN(const std::vector<Drawn> drawn, draw_(own));
        for (const Drawn& view : drawn)
            seen_ = seen_ || std::ranges::any_of(view.alpha, [](float alpha) { return alpha > 0; });
        return parallel_for(count, kMostHostThreads, [&](std::size_t i) {
            return write_view(drawn[i], first + static_cast<std::uint32_t>(i));
        });
    }

    /// Called by several threads.
    [[nodiscard]] Status write_view(const Drawn& drawn, std::uint32_t view) const {
        const std::uint32_t size = desc_.size;
        const scene::Camera& camera = cameras_[view];
        Look look = look_of(desc_, view);
        SPLAT_TRY(io::write_picture(folder_, "rgb", camera.name,
                                    over_background(drawn.color, drawn.alpha, size, look)));
        if (desc_.depth) {
            const double far = glm::length(scene::camera_center(camera)) + reach_;
            SPLAT_TRY(io::write_picture(folder_, "depth", camera.name,
                                        io::depth_image(drawn.depth, size, size, far)));
        }
        if (desc_.normal)
            SPLAT_TRY(io::write_picture(folder_, "normal", camera.name,
                                        io::normal_image(drawn.normal, size, size)));
        if (desc_.mask)
            SPLAT_TRY(io::write_picture(folder_, "mask", camera.name,
                                        io::image_from_floats(drawn.alpha, size, size, 1)));
        if (desc_.albedo) {
            look.gain = 1;
            SPLAT_TRY(io::write_picture(folder_, "albedo", camera.name,
                                        over_background(drawn.albedo, drawn.alpha, size, look)));
        }
        if (desc_.layout != Layout::kSrn) return {};
        return io::write_new_file(os::text_of(folder_ / "pose" / (camera.name + ".txt")),
                                  io::as_bytes(io::srn_pose(camera)));
    }

    [[nodiscard]] Status write_points() const {
        const auto points = scene::sample_surface(mesh_, desc_.points, seed_of(desc_));
        if (!points.ok())
            return damaged("'%s': %s", desc_.name.c_str(), points.status().message().c_str());
        io::Buffer file;
        io::put_text(file, format("ply\nformat binary_little_endian 1.0\nelement vertex %u\n"
                                  "property float x\nproperty float y\nproperty float z\n"
                                  "end_header\n",
                                  desc_.points));
        for (const scene::Vec3& point : points.value()) {
            const scene::Vec3 placed = in_world(point, desc_.up);
            for (std::size_t k = 0; k < 3; ++k) io::put(file, static_cast<float>(placed[k]));
        }
        return io::write_new_file(os::text_of(folder_ / "points.ply"), file);
    }

    Status write_cameras() {
        if (desc_.layout == Layout::kSrn)
            return io::write_new_file(os::text_of(folder_ / "intrinsics.txt"),
                                      io::as_bytes(io::srn_intrinsics(cameras_.front())));
        for (scene::Camera& camera : cameras_) camera.name = "rgb/" + camera.name + ".png";
        SPLAT_ASSIGN(const io::Buffer file, io::write_transforms_json(cameras_));
        return io::write_new_file(os::text_of(folder_ / "transforms.json"), file);
    }

    const ViewsDesc& desc_;
    const scene::TriangleMesh& mesh_;
    const Draw& draw_;
    fs::path folder_;
    std::vector<scene::Camera> cameras_;
    double reach_ = 0;  ///< no point of the mesh is farther from the origin
    bool seen_ = false;
};

}  // namespace

Result<bool> has_object(const ViewsDesc& desc) {
    SPLAT_TRY(check_desc(desc));
    SPLAT_ASSIGN(const bool is_made,
                 io::is_made_with(root_of(desc), kValuesFile, values_text(desc)));
    if (!is_made) return false;
    for (const char* split : {"train", "val", "test"}) {
        SPLAT_ASSIGN(const io::PathKind kind, io::kind_of(os::text_of(folder_of(desc, split))));
        if (kind == io::PathKind::kNothing) continue;
        if (split == desc.split) return true;
        return invalid(
            "'%s' is in the split %s of '%s', expected %s: which meshes there are and their shares "
            "decide the splits; "
            "use another folder",
            desc.name.c_str(), split, os::text_of(root_of(desc)).c_str(), desc.split.c_str());
    }
    return false;
}

Status write_object(const ViewsDesc& desc, const scene::TriangleMesh& mesh, const Draw& draw) {
    SPLAT_ASSIGN(const bool is_there, has_object(desc));
    if (is_there) return {};
    const fs::path folder = folder_of(desc, desc.split);
    SPLAT_TRY(io::make_folders(folder.parent_path()));
    SPLAT_TRY(io::make_with(root_of(desc), kValuesFile, values_text(desc)));
    return io::write_once(folder,
                          [&](const fs::path& to) { return Writer(desc, mesh, draw).run(to); });
}

}  // namespace splat::mesh_views
