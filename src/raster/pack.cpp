#include "raster/pack.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ops/strided_copy.h"
#include "scene/activate.h"

namespace splat::raster {
namespace {

constexpr std::uint32_t kGaussianFloats = 12;
constexpr std::size_t kPiece = 65536;  ///< Gaussians packed at a time

std::uint32_t color_floats(const RasterDesc& desc) {
    return desc.direct_colors ? 3 : 3 * scene::sh_coefficients(desc.sh_degree);
}

/// One attribute: its array, its floats per Gaussian, and their place in the packed layout.
struct Row {
    const vk::BufferView* view;
    std::uint32_t channels;
    const vk::BufferView* packed;
    ops::Stride layout;
};

/// Packed: PackedGaussians or PackedGradients.
template <class Packed, class Copy>
Status for_each_attribute(const RasterDesc& desc, const GaussianAttributes& attributes,
                          const Packed& packed, const Copy& copy) {
    const Row rows[] = {
        {&attributes.means, 3, &packed.gaussians, {kGaussianFloats, 0}},
        {&attributes.opacities, 1, &packed.gaussians, {kGaussianFloats, 3}},
        {&attributes.scales, 3, &packed.gaussians, {kGaussianFloats, 4}},
        {&attributes.rotations, 4, &packed.gaussians, {kGaussianFloats, 8}},
        {&attributes.colors, color_floats(desc), &packed.colors, {4 * desc.color_quads(), 0}},
    };
    for (const Row& row : rows)
        if (row.view->buffer != VK_NULL_HANDLE) SPLAT_TRY(copy(row));
    return {};
}

void pack_gaussian(const scene::Gaussians& scene, std::size_t i, float* to) {
    const auto wide = [](float value) { return static_cast<double>(value); };
    std::copy_n(&scene.means[3 * i], 3, to);
    to[3] = static_cast<float>(scene::opacity_of(wide(scene.opacity_logits[i])));
    for (std::size_t k = 0; k < 3; ++k)
        to[4 + k] = static_cast<float>(std::exp(wide(scene.log_scales[3 * i + k])));
    std::copy_n(&scene.rotations[4 * i], 4, to + 8);
}

}  // namespace

Result<PackedBuffers> allocate_packed(vk::Context& context, const RasterDesc& desc) {
    const std::uint64_t count = std::max<std::uint64_t>(desc.gaussians, 1);
    PackedBuffers buffers;
    buffers.count = desc.gaussians;
    SPLAT_ASSIGN(buffers.gaussians,
                 context.memory().allocate(count * kGaussianFloats * 4, vk::MemoryKind::kDevice,
                                           "Gaussians"));
    SPLAT_ASSIGN(buffers.colors, context.memory().allocate(count * desc.color_quads() * 16,
                                                           vk::MemoryKind::kDevice, "colours"));
    SPLAT_TRY(context.fill(buffers.gaussians.range(), 0));
    SPLAT_TRY(context.fill(buffers.colors.range(), 0));
    return buffers;
}

Status upload_scene(vk::Context& context, const RasterDesc& desc, const scene::Gaussians& scene,
                    const PackedBuffers& to) {
    SPLAT_ASSERT(scene.count() == desc.gaussians && !desc.direct_colors);
    const std::size_t quads = desc.color_quads();
    const std::size_t there = std::size_t{3} * scene::sh_coefficients(scene.sh_degree);
    const std::size_t taken = std::min<std::size_t>(there, color_floats(desc));
    const std::size_t piece = std::min(kPiece, scene.count());
    std::vector<float> gaussians(piece * kGaussianFloats);
    std::vector<float> colors(piece * quads * 4);
    for (std::size_t first = 0; first < scene.count(); first += kPiece) {
        const std::size_t count = std::min(kPiece, scene.count() - first);
        for (std::size_t i = 0; i < count; ++i) {
            pack_gaussian(scene, first + i, &gaussians[i * kGaussianFloats]);
            std::copy_n(&scene.sh[(first + i) * there], taken, &colors[i * quads * 4]);
        }
        SPLAT_TRY(context.write(slice(to.gaussians.range(), first, count, 3), gaussians.data(),
                                count * kGaussianFloats * 4));
        SPLAT_TRY(context.write(slice(to.colors.range(), first, count, quads), colors.data(),
                                count * quads * 16));
    }
    return {};
}

Status pack_attributes(vk::Recorder& recorder, const RasterDesc& desc,
                       const GaussianAttributes& from, const PackedGaussians& to) {
    return for_each_attribute(desc, from, to, [&](const Row& row) {
        return ops::strided_copy(
            recorder, {desc.gaussians, row.channels, {row.channels, 0}, row.layout, false},
            *row.view, *row.packed);
    });
}

Status unpack_gradients(vk::Recorder& recorder, const RasterDesc& desc, const PackedGradients& from,
                        const GaussianAttributes& to, bool accumulate) {
    return for_each_attribute(desc, to, from, [&](const Row& row) {
        return ops::strided_copy(
            recorder, {desc.gaussians, row.channels, row.layout, {row.channels, 0}, accumulate},
            *row.packed, *row.view);
    });
}

std::vector<float> conics_of(std::span<const float> splats, std::span<const float> radii) {
    // The kernels keep the Cholesky factor of the conic, scaled to powers of two.
    constexpr double kScale = 2 * std::numbers::ln2;
    std::vector<float> conics(radii.size() / 2 * 3);
    for (std::size_t i = 0; i < radii.size() / 2; ++i) {
        if (!(radii[2 * i] > 0)) continue;
        const auto l11 = static_cast<double>(splats[12 * i + 4]);
        const auto l21 = static_cast<double>(splats[12 * i + 5]);
        const auto l22 = static_cast<double>(splats[12 * i + 6]);
        conics[3 * i] = static_cast<float>(kScale * l11 * l11);
        conics[3 * i + 1] = static_cast<float>(kScale * l11 * l21);
        conics[3 * i + 2] = static_cast<float>(kScale * (l21 * l21 + l22 * l22));
    }
    return conics;
}

}  // namespace splat::raster
