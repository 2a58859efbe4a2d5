#include "triangles/renderer.h"

#include <algorithm>
#include <cmath>

#include "core/checked_math.h"
#include "scene/camera_pose.h"
#include "scene/srgb.h"
#include "triangles/view_table.h"
#include "vk/launch.h"

namespace splat::triangles {
namespace {

constexpr std::uint32_t kGroup = 64;
/// Pairs of triangles and tiles of a range: invocations are counted in 32 bits.
constexpr std::uint64_t kMostPairs = 1ULL << 31U;

std::uint64_t runs_of(std::uint64_t count) {
    return ceil_div(count, 1U << params::kSumsBits);
}

/// Where the levels of sums over so many counts begin, and their sum.
struct SumLevels {
    std::array<std::uint32_t, 4> begin{};
    std::array<std::uint32_t, 4> count{};
    std::uint32_t total = 0;  ///< word of the sum

    explicit SumLevels(std::uint32_t counts) {
        for (std::size_t i = 0; i < count.size(); ++i) {
            begin[i] = total;
            count[i] = counts;
            total += counts;
            counts = static_cast<std::uint32_t>(runs_of(counts));
        }
    }
};

/// How a call is divided, and what it writes.
struct Plan {
    std::uint32_t width = 0, height = 0;
    std::uint32_t samples = 0;  ///< a pixel's side has so many; 0: none
    std::uint32_t centers = 0;
    std::uint32_t band_rows = 0;  ///< a multiple of a tile's
    std::uint32_t at_once = 0;    ///< triangles of a range
    std::uint32_t pictures = 0;   ///< how many of color, maps and albedo

    [[nodiscard]] std::uint64_t per_pixel() const {
        return std::uint64_t{samples} * samples + centers;
    }
    [[nodiscard]] std::uint64_t band_pixels() const { return std::uint64_t{width} * band_rows; }
    [[nodiscard]] std::uint64_t sample_bytes() const { return 8 * band_pixels() * per_pixel(); }
    [[nodiscard]] std::uint64_t picture_bytes() const { return 16 * band_pixels() * pictures; }
    [[nodiscard]] std::uint64_t sum_bytes() const {
        return std::uint64_t{4} * (SumLevels(at_once).total + 1);
    }
    [[nodiscard]] std::uint64_t box_bytes() const { return std::uint64_t{16} * at_once; }
    [[nodiscard]] std::uint64_t bytes() const {
        return sample_bytes() + picture_bytes() + sum_bytes() + box_bytes();
    }
};

Plan plan_of(std::uint32_t width, std::uint32_t height, std::uint32_t triangles,
             const RenderDesc& desc, const Wanted& wanted) {
    Plan plan{.width = width, .height = height};
    const bool colors = wanted.color || wanted.alpha || wanted.albedo;
    const bool maps = wanted.depth || wanted.normal;
    plan.samples = colors ? desc.samples : 0;
    plan.centers = maps ? 1 : 0;
    plan.pictures =
        (wanted.color || wanted.alpha ? 1U : 0U) + (maps ? 1U : 0U) + (wanted.albedo ? 1U : 0U);
    const std::uint64_t row = std::max<std::uint64_t>(plan.per_pixel(), 1) * width;
    const std::uint64_t rows = desc.most_samples / row / params::kTriangleTile;
    plan.band_rows = static_cast<std::uint32_t>(
        std::clamp<std::uint64_t>(rows, 1, ceil_div(height, params::kTriangleTile)) *
        params::kTriangleTile);
    const std::uint64_t tiles =
        ceil_div(width, params::kTriangleTile) * (plan.band_rows / params::kTriangleTile);
    plan.at_once = static_cast<std::uint32_t>(
        std::min<std::uint64_t>({std::max(desc.most_triangles, 1U), params::kTrianglesAtOnce,
                                 std::max(triangles, 1U), kMostPairs / tiles}));
    return plan;
}

Status check_cameras(std::span<const scene::Camera> cameras) {
    for (const scene::Camera& camera : cameras) {
        SPLAT_TRY(scene::check_camera(camera));
        if (camera.width != cameras[0].width || camera.height != cameras[0].height)
            return invalid("camera '%s' has %u x %u pixels, the first one %u x %u",
                           camera.name.c_str(), camera.width, camera.height, cameras[0].width,
                           cameras[0].height);
    }
    return {};
}

/// Draws one view after the other with the same buffers.
class Renderer {
  public:
    Renderer(vk::Context& context, const MeshOnDevice& mesh, const RenderDesc& desc,
             const Wanted& wanted, const Plan& plan)
        : context_(context), mesh_(mesh), desc_(desc), wanted_(wanted), plan_(plan) {}

    Status allocate();
    Status draw(const scene::Camera& camera, std::uint32_t view, Images& images);

  private:
    [[nodiscard]] params::TriangleParams params_of(std::uint32_t row_begin) const;
    /// Range of triangles from `first` on: boxes, counts of tiles and their sums. Returns the number of pairs.
    Result<std::uint32_t> bin(params::TriangleParams& params, std::uint32_t first);
    Status draw_pairs(vk::Recorder& recorder, params::TriangleParams params, std::uint32_t pairs,
                      bool numbers);
    Status draw_band(params::TriangleParams params);
    Status shade(vk::Recorder& recorder, params::TriangleParams params);
    Status run(vk::Recorder& recorder) {
        SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
        return context_.run(list);
    }
    Status give(const params::TriangleParams& params, double depth_unit, std::uint32_t view,
                Images& images);
    [[nodiscard]] const vk::BufferView& normal_indices() const {
        return own(params::kMeshNormalIndices, mesh_.normal_indices);
    }
    [[nodiscard]] const vk::BufferView& texcoord_indices() const {
        return own(params::kMeshTexcoordIndices, mesh_.texcoord_indices);
    }
    [[nodiscard]] const vk::BufferView& own(std::uint32_t bit, const vk::Buffer& given) const {
        return (mesh_.bits & bit) != 0 ? given.range() : mesh_.corners.range();
    }

    vk::Context& context_;
    const MeshOnDevice& mesh_;
    const RenderDesc& desc_;
    const Wanted& wanted_;
    const Plan& plan_;
    vk::Buffer view_, sums_, boxes_, samples_, pictures_;
    std::vector<float> read_;  ///< pictures of a band
};

Status Renderer::allocate() {
    const auto make = [&](vk::Buffer& to, std::uint64_t bytes, const char* name) -> Status {
        SPLAT_SET(to, context_.memory().allocate(std::max<std::uint64_t>(bytes, 16),
                                                 vk::MemoryKind::kDevice, name));
        return {};
    };
    SPLAT_TRY(make(view_, sizeof(ViewTable::quads), "view"));
    SPLAT_TRY(make(sums_, plan_.sum_bytes(), "sums of tiles"));
    SPLAT_TRY(make(boxes_, plan_.box_bytes(), "boxes of triangles"));
    SPLAT_TRY(make(samples_, plan_.sample_bytes(), "samples"));
    SPLAT_TRY(make(pictures_, plan_.picture_bytes(), "pictures"));
    read_.resize(plan_.picture_bytes() / 4);
    return {};
}

params::TriangleParams Renderer::params_of(std::uint32_t row_begin) const {
    params::TriangleParams params{};
    params.width = plan_.width;
    params.height = plan_.height;
    params.row_begin = row_begin;
    params.row_end = std::min(row_begin + plan_.band_rows, plan_.height);
    params.samples = plan_.samples;
    params.centers = plan_.centers;
    params.mesh_bits = mesh_.bits;
    params.texcoords_at = mesh_.texcoords_at;
    params.colors_at = mesh_.colors_at;
    params.textures_at = mesh_.textures_at;
    std::uint32_t at = 0;
    const auto place = [&](bool is_wanted) {
        if (!is_wanted) return params::kNoTriangle;
        const std::uint32_t begin = at;
        at += plan_.width * (params.row_end - params.row_begin);
        return begin;
    };
    params.color_at = place(wanted_.color || wanted_.alpha);
    params.maps_at = place(plan_.centers != 0);
    params.albedo_at = place(wanted_.albedo);
    params.lit = desc_.light ? 1 : 0;
    return params;
}

Result<std::uint32_t> Renderer::bin(params::TriangleParams& params, std::uint32_t first) {
    params.first = first;
    params.count = std::min(plan_.at_once, mesh_.triangles - first);
    const SumLevels levels(params.count);
    params.level1 = levels.begin[1];
    params.level2 = levels.begin[2];
    params.level3 = levels.begin[3];
    vk::Recorder recorder(context_);
    const std::uint32_t group = vk::workgroup_size(recorder.device(), kGroup);
    const vk::Groups groups = vk::groups_for(recorder.device(), params.count, group);
    params.groups_x = groups[0];
    const double count = params.count;
    SPLAT_TRY(recorder.dispatch({
        .op = "triangles",
        .shader = "triangle_bin",
        .constants = {{params::kWorkgroupSizeId, group}},
        .push = params,
        .accesses = {vk::read(view_.range()), vk::read(mesh_.vertices.range()),
                     vk::read(mesh_.corners.range()), vk::write(sums_.range()),
                     vk::write(boxes_.range())},
        .groups = groups,
        .work = {.flops = 300 * count, .bytes = 84 * count},
    }));
    for (std::size_t i = 0; i < levels.count.size(); ++i) {
        const std::uint32_t next = i + 1 < levels.begin.size() ? levels.begin[i + 1] : levels.total;
        const vk::Groups some = vk::groups_for(recorder.device(), runs_of(levels.count[i]), group);
        SPLAT_TRY(recorder.dispatch({
            .op = "triangles",
            .shader = "triangle_sums",
            .constants = {{params::kWorkgroupSizeId, group}},
            .push = params::TriangleSumsParams{levels.begin[i], levels.count[i], next, some[0]},
            .accesses = {vk::read_write(sums_.range())},
            .groups = some,
            .work = {.flops = double{1} * levels.count[i], .bytes = 8.0 * levels.count[i]},
        }));
    }
    SPLAT_TRY(run(recorder));
    std::uint32_t pairs = 0;
    SPLAT_TRY(context_.read(sums_.range().part(std::uint64_t{4} * levels.total, 4), &pairs,
                            sizeof pairs));
    return pairs;
}

Status Renderer::draw_pairs(vk::Recorder& recorder, params::TriangleParams params,
                            std::uint32_t pairs, bool numbers) {
    if (pairs == 0) return {};
    const std::uint32_t group = vk::workgroup_size(recorder.device(), kGroup);
    const vk::Groups groups = vk::groups_for(recorder.device(), pairs, group);
    params.groups_x = groups[0];
    params.pairs_end = pairs;
    params.numbers = numbers ? 1 : 0;
    // A pair draws four pixels, as small triangles do, and at most a tile.
    const double pixel = 100 * static_cast<double>(plan_.per_pixel());
    constexpr double kTilePixels = params::kTriangleTile * params::kTriangleTile;
    return recorder.dispatch({
        .op = "triangles",
        .shader = "triangle_draw",
        .constants = {{params::kWorkgroupSizeId, group},
                      {params::kTriangleTransparentId, mesh_.transparent ? 1U : 0U}},
        .push = params,
        .accesses = {vk::read(view_.range()), vk::read(mesh_.vertices.range()),
                     vk::read(mesh_.corners.range()), vk::read(texcoord_indices()),
                     vk::read(mesh_.attributes.range()), vk::read(mesh_.texels.range()),
                     vk::read(sums_.range()), vk::read(boxes_.range()),
                     vk::read_write(samples_.range())},
        .groups = groups,
        .work = {.flops = (2000 + 4 * pixel) * pairs, .bytes = 200.0 * pairs},
        .most_group = {.flops = (2000 + kTilePixels * pixel) * group, .bytes = 200.0 * group},
    });
}

Status Renderer::shade(vk::Recorder& recorder, params::TriangleParams params) {
    const std::uint32_t pixels = params.width * (params.row_end - params.row_begin);
    const std::uint32_t group = vk::workgroup_size(recorder.device(), kGroup);
    const vk::Groups groups = vk::groups_for(recorder.device(), pixels, group);
    params.groups_x = groups[0];
    const double points = double{1} * pixels * static_cast<double>(plan_.per_pixel());
    return recorder.dispatch({
        .op = "triangles",
        .shader = "triangle_shade",
        .constants = {{params::kWorkgroupSizeId, group}},
        .push = params,
        .accesses = {vk::read(view_.range()), vk::read(mesh_.vertices.range()),
                     vk::read(mesh_.corners.range()), vk::read(normal_indices()),
                     vk::read(texcoord_indices()), vk::read(mesh_.attributes.range()),
                     vk::read(mesh_.texels.range()), vk::read(samples_.range()),
                     vk::write(pictures_.range())},
        .groups = groups,
        .work = {.flops = 1000 * points, .bytes = 200 * points},
    });
}

Status Renderer::draw_band(params::TriangleParams params) {
    {
        vk::Recorder recorder(context_);
        SPLAT_TRY(recorder.fill(samples_.range(), params::kNoTriangle));
        SPLAT_TRY(run(recorder));
    }
    const bool one = plan_.at_once >= mesh_.triangles;
    for (const bool numbers : {false, true}) {
        if (one && numbers) break;  // drawn with the depths
        for (std::uint32_t first = 0; first < mesh_.triangles; first += plan_.at_once) {
            SPLAT_ASSIGN(const std::uint32_t pairs, bin(params, first));
            vk::Recorder recorder(context_);
            SPLAT_TRY(draw_pairs(recorder, params, pairs, numbers));
            if (one) SPLAT_TRY(draw_pairs(recorder, params, pairs, true));
            if (pairs > 0) SPLAT_TRY(run(recorder));
            if (mesh_.triangles - first <= plan_.at_once) break;  // the sum may not fit 32 bits
        }
    }
    vk::Recorder recorder(context_);
    SPLAT_TRY(shade(recorder, params));
    return run(recorder);
}

Status Renderer::give(const params::TriangleParams& params, double depth_unit, std::uint32_t view,
                      Images& images) {
    const std::size_t pixels = std::size_t{params.width} * (params.row_end - params.row_begin);
    SPLAT_TRY(context_.read(pictures_.range(), read_.data(), 16 * pixels * plan_.pictures));
    const std::size_t first = (std::size_t{view} * images.height + params.row_begin) * images.width;
    std::array<float, 3> behind{};
    for (std::size_t k = 0; k < 3; ++k) behind[k] = scene::linear_of_srgb(desc_.background[k]);
    // RGB over the background: RGB of what is covered, and the covered share.
    const auto over = [&](const float* from, std::vector<float>& to, std::size_t pixel) {
        for (std::size_t k = 0; k < 3; ++k) {
            const float mean = from[k] + (1 - from[3]) * behind[k];
            to[3 * pixel + k] = scene::srgb_of_linear(std::clamp(mean, 0.0F, 1.0F));
        }
    };
    for (std::size_t i = 0; i < pixels; ++i) {
        const auto quad = [&](std::uint32_t begin) { return read_.data() + 4 * (begin + i); };
        if (wanted_.color) over(quad(params.color_at), images.color, first + i);
        if (wanted_.albedo) over(quad(params.albedo_at), images.albedo, first + i);
        if (wanted_.alpha) images.alpha[first + i] = quad(params.color_at)[3];
        if (wanted_.depth)
            images.depth[first + i] =
                static_cast<float>(static_cast<double>(quad(params.maps_at)[0]) * depth_unit);
        if (wanted_.normal)
            std::copy_n(quad(params.maps_at) + 1, 3, &images.normal[3 * (first + i)]);
    }
    return {};
}

Status Renderer::draw(const scene::Camera& camera, std::uint32_t view, Images& images) {
    if (plan_.pictures == 0) return {};
    const ViewTable table = view_table(mesh_, camera, desc_);
    SPLAT_TRY(context_.write(view_.range(), table.quads.data(), sizeof table.quads));
    for (std::uint32_t row = 0; row < plan_.height; row += plan_.band_rows) {
        const params::TriangleParams params = params_of(row);
        SPLAT_TRY(draw_band(params));
        SPLAT_TRY(give(params, table.depth_unit, view, images));
    }
    return {};
}

}  // namespace

Status check_desc(const RenderDesc& desc) {
    if (desc.samples != 1 && desc.samples != 2 && desc.samples != 4 && desc.samples != 8)
        return invalid("samples is %u, expected 1, 2, 4 or 8", desc.samples);
    for (const float value : desc.background)
        if (!(value >= 0 && value <= 1))
            return invalid("the background has %g, expected 0 to 1", static_cast<double>(value));
    const scene::Vec3 up(desc.up[0], desc.up[1], desc.up[2]);
    if (!(glm::length(up) > 0) || !std::isfinite(glm::length(up)))
        return invalid("up is %g, %g, %g, expected a direction", up.x, up.y, up.z);
    if (!(desc.near_plane >= 0) || !std::isfinite(desc.near_plane))
        return invalid("near_plane is %g, expected 0 or more", desc.near_plane);
    return {};
}

Result<Images> render(vk::Context& context, const MeshOnDevice& mesh,
                      std::span<const scene::Camera> cameras, const RenderDesc& desc,
                      const Wanted& wanted) {
    SPLAT_TRY(check_desc(desc));
    SPLAT_TRY(check_cameras(cameras));
    Images images{.views = static_cast<std::uint32_t>(cameras.size())};
    if (cameras.empty()) return images;
    images.width = cameras[0].width;
    images.height = cameras[0].height;
    const std::size_t pixels = cameras.size() * images.width * images.height;
    if (wanted.color) images.color.resize(3 * pixels);
    if (wanted.alpha) images.alpha.resize(pixels);
    if (wanted.depth) images.depth.resize(pixels);
    if (wanted.normal) images.normal.resize(3 * pixels);
    if (wanted.albedo) images.albedo.resize(3 * pixels);
    const Plan plan = plan_of(images.width, images.height, mesh.triangles, desc, wanted);
    Renderer renderer(context, mesh, desc, wanted, plan);
    SPLAT_TRY(renderer.allocate());
    for (std::uint32_t view = 0; view < images.views; ++view)
        SPLAT_TRY(renderer.draw(cameras[view], view, images));
    return images;
}

std::uint64_t device_bytes(const scene::TriangleMesh& mesh, std::uint32_t width,
                           std::uint32_t height, const RenderDesc& desc) {
    std::uint64_t bytes = 16 * (mesh.vertices.size() + mesh.triangles.size()) +
                          12 * (mesh.normal_indices.size() + mesh.texcoord_indices.size()) +
                          12 * mesh.normals.size() + 8 * mesh.texcoords.size() +
                          8 * mesh.colors.size();
    for (const scene::Texture& texture : mesh.textures)
        bytes += 4 * (texture.texels.size() + texture.texels.size() / 3);
    const Wanted all{.depth = true, .normal = true, .albedo = true};
    const auto triangles = static_cast<std::uint32_t>(mesh.triangles.size());
    return bytes + plan_of(width, height, triangles, desc, all).bytes();
}

}  // namespace splat::triangles
