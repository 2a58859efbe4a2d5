#include "train/size_map.h"

#include <algorithm>

namespace splat::train {

Result<SizeMap> SizeMap::create(vk::Context& context, raster::RasterDesc desc) {
    SizeMap map(context);
    desc.direct_colors = true;
    desc.backward = false;
    SPLAT_ASSIGN(map.rasterizer_, raster::Rasterizer::create(context, desc));
    const auto make = [&](vk::Buffer& buffer, std::uint64_t quads) -> Status {
        SPLAT_SET(buffer, context.memory().allocate(16 * quads * std::max(desc.gaussians, 1U),
                                                    vk::MemoryKind::kDevice, "sizes of Gaussians"));
        return {};
    };
    SPLAT_TRY(make(map.gaussians_, gaussians::kGaussianFloats / 4));
    SPLAT_TRY(make(map.sizes_, 1));
    return map;
}

Status SizeMap::draw(const gaussians::SetViews& scene, std::span<const scene::Camera> cameras,
                     const vk::BufferView& weights) {
    using gaussians::kGaussianFloats;
    std::vector<float> packed(std::size_t{kGaussianFloats} * scene.count);
    SPLAT_TRY(context_->read(scene.gaussians, packed.data(), packed.size() * sizeof(float)));
    std::vector<float> quads(std::size_t{4} * scene.count);
    for (std::size_t i = 0; i < scene.count; ++i) {
        const float* const scale = &packed[kGaussianFloats * i + gaussians::kScaleAt];
        quads[4 * i] = std::max({scale[0], scale[1], scale[2]});
    }
    SPLAT_TRY(context_->write(gaussians_.range(), packed.data(), packed.size() * sizeof(float)));
    SPLAT_TRY(context_->write(sizes_.range(), quads.data(), quads.size() * sizeof(float)));
    SPLAT_ASSIGN(const raster::PackedViews views,
                 raster::pack_views(rasterizer_->desc(), cameras, {}));
    SPLAT_TRY(rasterizer_->forward({gaussians_.range(), sizes_.range(), scene.count, 0, 0}, views));

    const std::uint64_t pixels = rasterizer_->desc().pixels();
    quads.resize(4 * pixels);
    SPLAT_TRY(context_->read(rasterizer_->workspace().image.range(), quads.data(),
                             quads.size() * sizeof(float)));
    double sum = 0;
    for (std::size_t i = 0; i < pixels; ++i) sum += static_cast<double>(quads[4 * i]);
    const double scale = sum > 0 ? static_cast<double>(pixels) / sum : 0;
    for (std::size_t i = 0; i < pixels; ++i) {
        const double weight = sum > 0 ? scale * static_cast<double>(quads[4 * i]) : 1;
        quads[4 * i] = static_cast<float>(weight);
        std::fill_n(&quads[4 * i + 1], 3, 0.0F);
    }
    return context_->write(weights, quads.data(), quads.size() * sizeof(float));
}

}  // namespace splat::train
