#pragma once

#include <cstdint>
#include <vector>

#include "raster/pack_camera.h"
#include "scene/gaussians.h"

namespace splat::raster {

/// Rows of tiles of one image, each band with the Gaussians of a scene that may reach them: for scenes of more than a
/// device takes at a time.
struct Bands {
    struct Reach {
        std::uint16_t begin = 0, end = 0;  ///< rows of tiles; none: the Gaussian reaches no pixel
    };
    std::vector<Window> rows;    ///< from the first row of the image to its last
    std::vector<Reach> reaches;  ///< one for each Gaussian: at least its true rows

    /// Gaussians of a band, in their order.
    [[nodiscard]] std::vector<std::size_t> gaussians_of(const Window& band) const;
};

/// Divide the image of the only view into bands that need at most `most` Gaussians each; as few as one pass over the
/// rows finds. A pixel sees the same Gaussians in the same order as if all were drawn at once.
///
/// Errors       kUnsupported if a row of tiles needs more
Result<Bands> divide(const scene::Gaussians& scene, const RasterDesc& desc,
                     const PackedViews& views, std::uint64_t most);

}  // namespace splat::raster
