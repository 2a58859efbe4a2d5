#include "raster/rasterizer_harness.h"

#include <algorithm>
#include <numbers>

namespace splat::test {
namespace {

template <class T>
Result<std::vector<T>> download(vk::Context& context, const vk::BufferView& view,
                                std::size_t count) {
    std::vector<T> values(count);
    if (count > 0) SPLAT_TRY(context.read(view, values.data(), count * sizeof(T)));
    return values;
}

std::vector<float> packed_colors(const RasterCase& from, std::uint32_t quads) {
    const std::size_t n = from.count();
    const std::vector<float>& flat = from.sh.empty() ? from.colors : from.sh;
    const std::size_t each = n == 0 ? 0 : flat.size() / n;
    std::vector<float> packed(std::max<std::size_t>(n, 1) * quads * 4);
    for (std::size_t i = 0; i < n; ++i)
        std::copy_n(&flat[i * each], std::min<std::size_t>(each, std::size_t{quads} * 4),
                    &packed[i * quads * 4]);
    return packed;
}

std::vector<float> packed_gaussians(const RasterCase& from) {
    std::vector<float> packed(std::max<std::size_t>(from.count(), 1) * 12);
    for (std::size_t i = 0; i < from.count(); ++i) {
        std::copy_n(&from.means[3 * i], 3, &packed[12 * i]);
        packed[12 * i + 3] = from.opacities[i];
        std::copy_n(&from.scales[3 * i], 3, &packed[12 * i + 4]);
        std::copy_n(&from.rotations[4 * i], 4, &packed[12 * i + 8]);
    }
    return packed;
}

/// Computes the conic from the factor that the kernels keep. |L^T q|^2 is in log2 units.
void add_splat(const float* splat, bool valid, RasterOutputs& out) {
    const double log2_to_sigma = valid ? 2 * std::numbers::ln2 : 0;
    const double l11 = static_cast<double>(splat[4]);
    const double l21 = static_cast<double>(splat[5]);
    const double l22 = static_cast<double>(splat[6]);
    out.means2d.insert(out.means2d.end(),
                       {static_cast<double>(splat[0]), static_cast<double>(splat[1])});
    out.conics.insert(out.conics.end(), {log2_to_sigma * l11 * l11, log2_to_sigma * l11 * l21,
                                         log2_to_sigma * (l21 * l21 + l22 * l22)});
    out.depths.push_back(static_cast<double>(splat[3]));
    for (std::size_t c = 8; c < 11; ++c) out.colors.push_back(static_cast<double>(splat[c]));
}

Status read_outputs(vk::Context& context, const raster::Rasterizer& rasterizer, RasterRun& run) {
    const raster::Workspace& space = rasterizer.workspace();
    const raster::RasterDesc& desc = rasterizer.desc();
    const auto pixels = static_cast<std::size_t>(desc.pixels());
    const auto items = static_cast<std::size_t>(desc.items());
    SPLAT_ASSIGN(run.image, download<float>(context, space.image.range(), 4 * pixels));
    SPLAT_ASSIGN(const auto extra, download<float>(context, space.extra.range(), 4 * pixels));
    SPLAT_ASSIGN(const auto normals, download<float>(context, space.normal_image.range(),
                                                     desc.normals ? 4 * pixels : 0));
    SPLAT_ASSIGN(const auto median,
                 download<float>(context, space.median.range(), desc.median ? pixels : 0));
    run.outputs.median.assign(median.begin(), median.end());
    SPLAT_ASSIGN(const auto splats, download<float>(context, space.splats.range(), 12 * items));
    SPLAT_ASSIGN(const auto radii, download<float>(context, space.radii.range(), 2 * items));
    for (std::size_t p = 0; p < pixels; ++p) {
        for (std::size_t c = 0; c < 3; ++c)
            run.outputs.rgb.push_back(static_cast<double>(run.image[4 * p + c]));
        for (std::size_t c = 0; c < 3 && desc.normals; ++c)
            run.outputs.normal.push_back(static_cast<double>(normals[4 * p + c]));
        run.outputs.alpha.push_back(static_cast<double>(run.image[4 * p + 3]));
        run.outputs.depth.push_back(static_cast<double>(extra[4 * p]));
        run.outputs.depth_expected.push_back(static_cast<double>(extra[4 * p + 1]));
        run.outputs.n_contrib.push_back(static_cast<std::int64_t>(extra[4 * p + 2]));
    }
    bool without_color = false;  // 3dgs: too faint to be seen, but not culled
    for (std::size_t i = 0; i < items; ++i) {
        add_splat(&splats[12 * i], radii[2 * i] > 0, run.outputs);
        run.outputs.radii.push_back(static_cast<std::int64_t>(radii[2 * i]));
        run.outputs.radii.push_back(static_cast<std::int64_t>(radii[2 * i + 1]));
        run.outputs.valid.push_back(radii[2 * i] > 0 ? 1 : 0);
        without_color |= radii[2 * i] > 0 && splats[12 * i + 2] < raster::kAlphaMin;
    }
    if (desc.rays()) run.outputs.conics.clear();
    if (without_color && desc.skips.cull) run.outputs.colors.clear();  // none expected
    return {};
}

/// The 12 free entries of a pose, and the left perturbation V' = (I + [w]x, rho) V: rho = dL/dt, w
/// = sum over the columns of column x gradient.
void add_pose(const std::vector<float>& pose, const scene::Camera& camera, RasterGradients& out) {
    std::array<double, 12> g{};
    for (std::size_t i = 0; i < 12; ++i) g[i] = static_cast<double>(pose[i]);
    out.world_to_camera.assign(g.begin(), g.end());
    const auto& m = camera.world_to_camera;
    std::array<double, 3> spin{};
    for (std::size_t column = 0; column < 4; ++column) {
        const std::array<double, 3> at = {m[column], m[4 + column], m[8 + column]};
        const std::array<double, 3> by = {g[column], g[4 + column], g[8 + column]};
        for (std::size_t k = 0; k < 3; ++k)
            spin[k] += at[(k + 1) % 3] * by[(k + 2) % 3] - at[(k + 2) % 3] * by[(k + 1) % 3];
    }
    out.twist = {g[3], g[7], g[11], spin[0], spin[1], spin[2]};
}

Status read_gradients(vk::Context& context, const raster::Rasterizer& rasterizer,
                      const RasterCase& from, const PackedCase& packed, RasterRun& run) {
    const raster::RasterDesc& desc = rasterizer.desc();
    const std::size_t n = from.count();
    const std::size_t each = n == 0 ? 0 : (from.sh.empty() ? 3 : from.sh.size() / n);
    SPLAT_ASSIGN(run.packed, download<float>(context, packed.gradients.gaussians.range(), 12 * n));
    SPLAT_ASSIGN(const auto colors, download<float>(context, packed.gradients.colors.range(),
                                                    std::size_t{4} * desc.color_quads() * n));
    SPLAT_ASSIGN(const auto exported,
                 download<float>(context, rasterizer.workspace().exported.range(),
                                 desc.export_gradients ? 12 * n : 0));
    RasterGradients& out = run.gradients;
    const auto append = [](std::vector<double>& to, const float* values, std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) to.push_back(static_cast<double>(values[i]));
    };
    for (std::size_t i = 0; i < n; ++i) {
        append(out.means, &run.packed[12 * i], 3);
        append(out.opacities, &run.packed[12 * i + 3], 1);
        append(out.scales, &run.packed[12 * i + 4], 3);
        append(out.rotations, &run.packed[12 * i + 8], 4);
        append(from.sh.empty() ? out.colors : out.sh, &colors[i * 4 * desc.color_quads()], each);
        if (exported.empty()) continue;
        append(out.means2d, &exported[12 * i], 2);
        append(out.means2d_abs, &exported[12 * i + 2], 2);
        append(out.conics, &exported[12 * i + 4], 3);
        if (!from.sh.empty()) append(out.colors, &exported[12 * i + 8], 3);
    }
    run.packed.insert(run.packed.end(), colors.begin(), colors.end());
    if (!desc.grad_pose) return {};
    SPLAT_ASSIGN(const auto pose,
                 download<float>(context, rasterizer.workspace().pose.range(), 12));
    run.packed.insert(run.packed.end(), pose.begin(), pose.end());
    add_pose(pose, camera_of(from), out);
    if (!desc.grad_intrinsics) return {};
    SPLAT_ASSIGN(const auto intrinsics,
                 download<float>(context, rasterizer.workspace().intrinsics.range(), 4));
    append(out.intrinsics, intrinsics.data(), 4);
    run.packed.insert(run.packed.end(), intrinsics.begin(), intrinsics.end());
    return {};
}

Status backward(vk::Context& context, raster::Rasterizer& rasterizer, const PackedCase& packed,
                const ref::RasterLoss<double>& loss) {
    const auto pixels = static_cast<std::size_t>(rasterizer.desc().pixels());
    std::vector<float> image(4 * pixels);
    std::vector<float> depth(pixels);
    for (std::size_t p = 0; p < pixels; ++p) {
        for (std::size_t c = 0; c < 3 && !loss.grad_rgb.empty(); ++c)
            image[4 * p + c] = static_cast<float>(loss.grad_rgb[3 * p + c]);
        if (!loss.grad_alpha.empty()) image[4 * p + 3] = static_cast<float>(loss.grad_alpha[p]);
        if (!loss.grad_depth.empty()) depth[p] = static_cast<float>(loss.grad_depth[p]);
    }
    SPLAT_ASSIGN(const vk::Buffer grad_image,
                 context.memory().allocate(16 * pixels, vk::MemoryKind::kDevice, "grad_image"));
    SPLAT_ASSIGN(const vk::Buffer grad_depth,
                 context.memory().allocate(4 * pixels, vk::MemoryKind::kDevice, "grad_depth"));
    SPLAT_TRY(context.write(grad_image.range(), image.data(), 16 * pixels));
    SPLAT_TRY(context.write(grad_depth.range(), depth.data(), 4 * pixels));
    return rasterizer.backward(grad_image.range(), grad_depth.range(), packed.gradients.views());
}

}  // namespace

raster::RasterDesc raster_desc(const RasterCase& from, const RasterMode& mode) {
    raster::RasterDesc desc;
    desc.gaussians = static_cast<std::uint32_t>(from.count());
    desc.width = static_cast<std::uint32_t>(from.camera.width);
    desc.height = static_cast<std::uint32_t>(from.camera.height);
    while (raster::RasterDesc(desc).color_quads() > 0 &&
           std::size_t{desc.sh_degree + 1} * (desc.sh_degree + 1) < from.sh_coefficients)
        ++desc.sh_degree;
    desc.direct_colors = from.sh.empty();
    desc.convention = mode.is_3dgs()  ? raster::Convention::k3dgs
                      : mode.is_ray() ? raster::Convention::kRayMaximum
                                      : raster::Convention::kGsplat;
    desc.antialiased = mode.antialiased;
    desc.sort_by_distance = mode.sort_by_distance;
    desc.cut_3_sigma = mode.cut_3_sigma;
    desc.near_plane = mode.is_3dgs() || mode.is_ray() ? 0.2F : 0.01F;
    desc.extra = true;
    desc.normals = true;
    desc.median = true;
    return desc;
}

scene::Camera camera_of(const RasterCase& from) {
    scene::Camera camera{.name = from.name};
    camera.width = static_cast<std::uint32_t>(from.camera.width);
    camera.height = static_cast<std::uint32_t>(from.camera.height);
    camera.fx = static_cast<double>(from.camera.fx);
    camera.fy = static_cast<double>(from.camera.fy);
    camera.cx = static_cast<double>(from.camera.cx);
    camera.cy = static_cast<double>(from.camera.cy);
    for (std::size_t i = 0; i < 16; ++i)
        camera.world_to_camera[i] = static_cast<double>(from.camera.world_to_camera[i]);
    return camera;
}

Result<PackedCase> PackedCase::create(vk::Context& context, const RasterCase& from,
                                      const raster::RasterDesc& desc) {
    PackedCase packed;
    const std::vector<float> gaussians = packed_gaussians(from);
    const std::vector<float> colors = packed_colors(from, desc.color_quads());
    const auto make = [&](const std::vector<float>& values) {
        return context.memory().allocate(values.size() * 4, vk::MemoryKind::kDevice, "scene");
    };
    for (gaussians::GaussianSet* buffers : {&packed.scene, &packed.gradients}) {
        SPLAT_ASSIGN(buffers->gaussians, make(gaussians));
        SPLAT_ASSIGN(buffers->colors, make(colors));
        buffers->count = static_cast<std::uint32_t>(from.count());
    }
    const gaussians::SetViews to = packed.scene.views();
    SPLAT_TRY(context.write(to.gaussians, gaussians.data(), gaussians.size() * 4));
    SPLAT_TRY(context.write(to.colors, colors.data(), colors.size() * 4));
    return packed;
}

RasterRun run_raster(vk::Context& context, const RasterCase& from, raster::RasterDesc desc,
                     const ref::RasterLoss<double>* loss) {
    RasterRun run;
    if (loss != nullptr && !desc.backward) {
        desc.backward = true;
        desc.export_gradients = true;
        desc.grad_pose = true;
        desc.grad_intrinsics = true;
        desc.grad_depth = !loss->grad_depth.empty();
    }
    const auto all = [&]() -> Status {
        SPLAT_ASSIGN(const PackedCase packed, PackedCase::create(context, from, desc));
        SPLAT_ASSIGN(const auto rasterizer, raster::Rasterizer::create(context, desc));
        const scene::Camera camera = camera_of(from);
        SPLAT_ASSIGN(const raster::PackedViews views,
                     raster::pack_views(desc, {&camera, 1}, from.background));
        SPLAT_TRY(rasterizer->forward(packed.scene.views(), views));
        run.stats = rasterizer->stats();
        SPLAT_TRY(read_outputs(context, *rasterizer, run));
        if (loss == nullptr) return {};
        SPLAT_TRY(backward(context, *rasterizer, packed, *loss));
        return read_gradients(context, *rasterizer, from, packed, run);
    };
    run.status = all();
    return run;
}

}  // namespace splat::test
