#include "prior_models/finish.h"

#include <algorithm>
#include <cmath>

#include "prior_models/planes.h"
#include "prior_models/point_depth.h"

namespace splat::prior_models {
namespace {

Result<std::vector<float>> resized(const Planes& planes, Extent size, data::ValueFilter filter) {
    SPLAT_ASSIGN(const std::vector<double> values,
                 data::resample_values(std::span<const float>(planes.values), planes.size.width,
                                       planes.size.height, planes.channels, size.width, size.height,
                                       filter));
    return std::vector<float>(values.begin(), values.end());
}

/// 0 to 255, truncated; `scale` is that of 1.
float byte_of(float value, float scale) {
    return std::trunc(std::clamp(value * scale, 0.0F, 255.0F));
}

Result<PriorMap> finish_depth(const PresetOutput& output, Planes planes, Extent size,
                              MapForm form) {
    // Distances are compared by their inverse.
    const bool invert = output.depth != DepthOf::kInverse && form != MapForm::kModels;
    if (invert)
        for (float& value : planes.values) value = value > 0 ? 1 / value : 0;
    PriorMap map{size, 1, {}};
    SPLAT_ASSIGN(map.values, resized(planes, size, output.filter));
    if (form == MapForm::kModels) return map;
    const auto [least, most] = std::ranges::minmax_element(map.values);
    const float low = *least, range = *most - low + 1e-8F;
    for (float& value : map.values) value = (value - low) / range;
    if (form == MapForm::kBytes)
        for (float& value : map.values) value = byte_of(value, 255);
    return map;
}

Result<PriorMap> finish_normal(const PresetOutput& output, const Planes& planes, Extent size,
                               MapForm form) {
    PriorMap map{size, 3, {}};
    SPLAT_ASSIGN(map.values, resized(planes, size, output.filter));
    for (std::size_t i = 0; i < map.values.size(); i += 3) {
        float* const n = map.values.data() + i;
        const float length = std::max(std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]), 1e-12F);
        for (std::size_t c = 0; c < 3; ++c) {
            n[c] = output.signs[c] * n[c] / length;
            if (form == MapForm::kUnit) n[c] = std::clamp((n[c] + 1) / 2, 0.0F, 1.0F);
            if (form == MapForm::kBytes) n[c] = byte_of(n[c] + 1, 127.5F);
        }
    }
    return map;
}

/// Bytes of a mask in another size, rounded.
Result<std::vector<float>> resized_bytes(const Planes& planes, Extent size,
                                         data::ValueFilter filter) {
    io::Image bytes{planes.size.width, planes.size.height, 1, 8, {}};
    for (const float value : planes.values)
        bytes.samples.push_back(static_cast<std::uint16_t>(byte_of(value, 255)));
    SPLAT_ASSIGN(const std::vector<double> values, resample_bytes(bytes, size, filter));
    std::vector<float> rounded;
    for (const double value : values)
        rounded.push_back(static_cast<float>(std::clamp(std::floor(value + 0.5), 0.0, 255.0)));
    return rounded;
}

Result<PriorMap> finish_mask(const PresetOutput& output, Planes planes, Extent size, MapForm form) {
    if (output.sigmoid)
        for (float& value : planes.values)
            value = 1 / (1 + static_cast<float>(std::exp(-static_cast<double>(value))));
    if (output.min_max) {
        const auto [least, most] = std::ranges::minmax_element(planes.values);
        const float low = *least, range = *most - low;
        for (float& value : planes.values) value = range > 0 ? (value - low) / range : 0;
    }
    PriorMap map{size, 1, {}};
    if (form == MapForm::kBytes && output.bytes_first) {
        SPLAT_ASSIGN(map.values, resized_bytes(planes, size, output.filter));
    } else {
        SPLAT_ASSIGN(map.values, resized(planes, size, output.filter));
        for (float& value : map.values)
            value = form == MapForm::kBytes ? byte_of(value, 255) : std::clamp(value, 0.0F, 1.0F);
    }
    if (!output.threshold || form == MapForm::kModels) return map;
    const float one = form == MapForm::kBytes ? 255 : 1;
    const float above = static_cast<float>(*output.threshold) / 255 * one;
    for (float& value : map.values) value = value > above ? one : 0;
    return map;
}

}  // namespace

Result<PriorMap> finish(const PresetOutput& output, const MapSource& source, Extent size,
                        MapForm form, const std::string& name) {
    const bool points = output.map == data::MapKind::kDepth && output.depth == DepthOf::kPoints;
    const std::uint32_t channels = points ? 3 : data::channels_of(output.map);
    SPLAT_ASSIGN(Planes planes,
                 planes_of(*source.main,
                           {output.channels_last, output.channel, channels, source.picture}, name));
    SPLAT_TRY(check_finite(planes, name));
    PointDepth camera{.depth = {}, .focal = 0};
    if (points) {
        SPLAT_ASSIGN(camera, point_depth(planes, source, name));
        planes = std::move(camera.depth);
    }
    if (output.map == data::MapKind::kNormal) return finish_normal(output, planes, size, form);
    if (output.map == data::MapKind::kMask)
        return finish_mask(output, std::move(planes), size, form);
    SPLAT_ASSIGN(PriorMap map, finish_depth(output, std::move(planes), size, form));
    map.focal = camera.focal * std::hypot(size.width, size.height) / 2;
    map.guessed = !camera.found;
    return map;
}

}  // namespace splat::prior_models
