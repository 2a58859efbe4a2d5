#pragma once

#include "prior_models/network.h"
#include "prior_models/prepare.h"

namespace splat::prior_models {

/// Some channels of one picture of an output: [height,width,channels].
struct Planes {
    Extent size;
    std::uint32_t channels = 1;
    std::vector<float> values;
};

/// A part of an output.
struct PlanesPart {
    bool channels_last = false;
    std::uint32_t first = 0, count = 1;  ///< channels
    std::size_t picture = 0;             ///< in the batch
};

/// From [n,c,h,w] or [n,h,w,c]; one channel also from [n,h,w], and from [h,w]. Errors: kFormat for another rank,
/// too few channels or pictures, and sides of 0 or above 16384; `name` stands for the output.
Result<Planes> planes_of(const NetworkTensor& tensor, const PlanesPart& part,
                         const std::string& name);

/// Errors: kInvalidState with the place of the first number that is not finite.
Status check_finite(const Planes& planes, const std::string& name);

}  // namespace splat::prior_models
