#pragma once

#include <cstdint>

#include "vkrun/cli/json.h"

namespace vkrun {

/// The channels of an input image after RGB.
struct ImageChannels {
    bool depth = false, normal = false, mask = false, plane = false;
    bool origin_distance = false;  ///< the last plane

    /// Channels that a merged configuration asks for.
    static ImageChannels of(const Json& config);
    [[nodiscard]] std::uint32_t count() const;
    [[nodiscard]] std::uint32_t flags() const;  ///< SPLAT_DATA_*
};

}  // namespace vkrun
