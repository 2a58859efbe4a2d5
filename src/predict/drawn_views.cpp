#include "predict/drawn_views.h"

#include <algorithm>

namespace splat::predict {

bool takes_drawn_views(const config::ModelConfig& network) {
    return network.views == 1 && network.positions == kHeadInputDepth && network.mask &&
           network.image_channels() == 4 && network.fov_degrees > 0;
}

raster::RasterDesc drawn_views_desc(const gaussians::SetDesc& set, std::uint32_t views,
                                    std::uint32_t side, raster::Convention convention) {
    raster::RasterDesc desc;
    static_cast<gaussians::SetDesc&>(desc) = set;
    desc.views = views;
    desc.width = desc.height = side;
    desc.convention = convention;
    desc.median = true;
    return desc;
}

Result<DrawnViews> draw_views(vk::Context& context, raster::Rasterizer& rasterizer,
                              const gaussians::SetViews& scene,
                              std::span<const scene::Camera> cameras,
                              const std::array<float, 3>& background, float beyond) {
    const raster::RasterDesc& desc = rasterizer.desc();
    SPLAT_ASSIGN(const raster::PackedViews packed, raster::pack_views(desc, cameras, background));
    SPLAT_TRY(rasterizer.forward(scene, packed));
    DrawnViews drawn{.side = desc.width, .quads = {}, .depths = {}};
    drawn.quads.resize(cameras.size() * 4 * desc.width * desc.height);
    drawn.depths.resize(drawn.quads.size() / 4);
    SPLAT_TRY(context.read(rasterizer.workspace().image.range(), drawn.quads.data(),
                           drawn.quads.size() * sizeof(float)));
    SPLAT_TRY(context.read(rasterizer.workspace().median.range(), drawn.depths.data(),
                           drawn.depths.size() * sizeof(float)));
    std::ranges::replace(drawn.depths, 0.0F, beyond);
    return drawn;
}

void DrawnViews::append_planes(std::size_t view, std::vector<float>& to) const {
    const std::size_t area = side * side, first = view * area;
    for (std::size_t c = 0; c < 4; ++c)
        for (std::size_t p = first; p < first + area; ++p)
            to.push_back(std::clamp(quads[4 * p + c], 0.0F, 1.0F));
    to.insert(to.end(), depths.begin() + static_cast<std::ptrdiff_t>(first),
              depths.begin() + static_cast<std::ptrdiff_t>(first + area));
}

}  // namespace splat::predict
