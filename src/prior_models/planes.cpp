#include "prior_models/planes.h"

#include <cmath>

namespace splat::prior_models {
namespace {

constexpr std::int64_t kMostSide = 16384;

/// A shape as [n,c,h,w], whatever its layout; empty for another rank.
std::vector<std::int64_t> full_shape(const NetworkTensor& tensor, const PlanesPart& part) {
    const std::vector<std::int64_t>& d = tensor.dims;
    if (d.size() == 4 && part.channels_last) return {d[0], d[3], d[1], d[2]};
    if (d.size() == 4) return d;
    if (part.count != 1 || part.first != 0) return {};
    if (d.size() == 3) return {d[0], 1, d[1], d[2]};
    if (d.size() == 2) return {1, 1, d[0], d[1]};
    return {};
}

}  // namespace

Result<Planes> planes_of(const NetworkTensor& tensor, const PlanesPart& part,
                         const std::string& name) {
    const std::vector<std::int64_t> shape = full_shape(tensor, part);
    const std::int64_t last = std::int64_t{part.first} + part.count;
    if (shape.empty() || shape[0] <= static_cast<std::int64_t>(part.picture) || shape[1] < last)
        return damaged(
            "%s has the shape %s, expected %s with %lld or more channels", name.c_str(),
            shape_text(tensor.dims).c_str(),
            part.channels_last ? "[n,height,width,channels]" : "[n,channels,height,width]",
            lld(last));
    for (const std::int64_t side : {shape[2], shape[3]})
        if (side < 1 || side > kMostSide)
            return damaged("%s has the shape %s, expected sides of 1 to %lld pixels", name.c_str(),
                           shape_text(tensor.dims).c_str(), lld(kMostSide));
    Planes planes{{static_cast<std::uint32_t>(shape[3]), static_cast<std::uint32_t>(shape[2])},
                  part.count,
                  {}};
    const auto all = static_cast<std::size_t>(shape[1]);
    const std::size_t area = std::size_t{planes.size.width} * planes.size.height;
    const bool together = part.channels_last && tensor.dims.size() == 4;
    const float* const from = tensor.values.data() + part.picture * all * area;
    planes.values.resize(area * part.count);
    for (std::size_t i = 0; i < area; ++i)
        for (std::size_t c = 0; c < part.count; ++c)
            planes.values[i * part.count + c] =
                together ? from[i * all + part.first + c] : from[(part.first + c) * area + i];
    return planes;
}

Status check_finite(const Planes& planes, const std::string& name) {
    for (std::size_t i = 0; i < planes.values.size(); ++i)
        if (!std::isfinite(planes.values[i])) {
            const std::size_t pixel = i / planes.channels;
            return bad_state(
                "%s is %g at row %zu, column %zu: the model's numbers overflow, or it is "
                "not the preset's",
                name.c_str(), static_cast<double>(planes.values[i]), pixel / planes.size.width,
                pixel % planes.size.width);
        }
    return {};
}

}  // namespace splat::prior_models
