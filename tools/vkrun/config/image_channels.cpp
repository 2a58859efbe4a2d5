#include "vkrun/config/image_channels.h"

#include <splat.h>

namespace vkrun {

ImageChannels ImageChannels::of(const Json& config) {
    const Json& data = config.at("data");
    return {data.at("use_pred_depth"), data.at("use_pred_normal"), data.at("use_mask"),
            data.at("use_pred_plane"), data.at("origin_distances")};
}

std::uint32_t ImageChannels::count() const {
    return 3U + (depth ? 1 : 0) + (normal ? 3 : 0) + (mask ? 1 : 0) + (plane ? 5 : 0) +
           (origin_distance ? 1 : 0);
}

std::uint32_t ImageChannels::flags() const {
    std::uint32_t flags = 0;
    if (depth) flags |= SPLAT_DATA_DEPTH;
    if (normal) flags |= SPLAT_DATA_NORMAL;
    if (mask) flags |= SPLAT_DATA_MASK;
    if (plane) flags |= SPLAT_DATA_PLANE;
    return flags;
}

}  // namespace vkrun
