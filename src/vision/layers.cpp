#include "vision/layers.h"

namespace splat::vision {

using nn::kNoValue;
using nn::ValueId;

ValueId Layers::parameter(const std::string& name, const Shape& shape, Origin origin) {
    origins_[name] = std::move(origin);
    return graph_.parameter(name, shape, false);
}

ValueId Layers::convolve(ValueId x, ValueId weight, ValueId bias, ValueId residual,
                         bool replicate) {
    return graph_.op("conv2d", {x, weight, bias, residual},
                     {{"precision", precision_}, {"replicate", replicate}});
}

ValueId Layers::linear(const std::string& name, ValueId x, std::uint32_t out, ValueId residual,
                       const std::string& rows_by) {
    if (!ok()) return kNoValue;
    const std::uint32_t in = channels(x);
    const ValueId weight = parameter(name + ".weight", {out, in, 1, 1},
                                     {name + ".weight", {out, in}, Form::kSame, 0, rows_by});
    const ValueId bias =
        parameter(name + ".bias", {out}, {name + ".bias", {out}, Form::kSame, 0, rows_by});
    return convolve(x, weight, bias, residual);
}

ValueId Layers::third(const std::string& name, ValueId x, std::uint32_t number) {
    if (!ok()) return kNoValue;
    const std::uint32_t c = channels(x);
    const std::string own = name + "." + std::to_string(number);
    const ValueId weight = parameter(own + ".weight", {c, c, 1, 1},
                                     {name + ".weight", {3 * c, c}, Form::kThird, number});
    const ValueId bias =
        parameter(own + ".bias", {c}, {name + ".bias", {3 * c}, Form::kThird, number});
    return convolve(x, weight, bias, kNoValue);
}

ValueId Layers::conv1(const std::string& name, ValueId x, std::uint32_t out, ValueId residual) {
    if (!ok()) return kNoValue;
    const std::uint32_t in = channels(x);
    const ValueId weight =
        parameter(name + ".weight", {out, in, 1, 1}, {name + ".weight", {out, in, 1, 1}});
    return convolve(x, weight, parameter(name + ".bias", {out}, {name + ".bias", {out}}), residual);
}

ValueId Layers::conv3(const std::string& name, ValueId x, std::uint32_t out, ValueId residual) {
    if (!ok()) return kNoValue;
    const std::uint32_t in = channels(x);
    const ValueId weight =
        parameter(name + ".weight", {out, in, 3, 3}, {name + ".weight", {out, in, 3, 3}});
    const ValueId bias = parameter(name + ".bias", {out}, {name + ".bias", {out}});
    return convolve(x, weight, bias, residual, true);
}

ValueId Layers::conv1_of(const std::string& name, ValueId x, std::uint32_t out, const Sum& weight,
                         const Sum& bias, ValueId residual) {
    if (!ok()) return kNoValue;
    const ValueId matrix = parameter(name + ".weight", {out, channels(x), 1, 1}, {.sum = weight});
    return convolve(x, matrix, parameter(name + ".bias", {out}, {.sum = bias}), residual);
}

ValueId Layers::conv3_of_twice(const std::string& name, ValueId x, std::uint32_t out,
                               const Sum& weight, ValueId residual) {
    if (!ok()) return kNoValue;
    const ValueId taps = parameter(name + ".weight", {4 * out, channels(x), 3, 3},
                                   {.form = Form::kOfTwice, .sum = weight});
    return convolve(x, taps, kNoValue, residual, true);
}

ValueId Layers::patches(const std::string& name, ValueId x, std::uint32_t out, std::uint32_t size,
                        ValueId residual) {
    if (!ok()) return kNoValue;
    const std::uint32_t in = channels(x), all = in * size * size;
    const ValueId weight =
        parameter(name + ".weight", {out, all, 1, 1}, {name + ".weight", {out, in, size, size}});
    const ValueId bias = parameter(name + ".bias", {out}, {name + ".bias", {out}});
    return convolve(graph_.op("patches2d", {x}, {{"size", std::int64_t{size}}}), weight, bias,
                    residual);
}

ValueId Layers::transposed(const std::string& name, ValueId x, std::uint32_t out) {
    if (!ok()) return kNoValue;
    const std::uint32_t in = channels(x);
    const ValueId weight = parameter(name + ".weight", {4 * out, in, 1, 1},
                                     {name + ".weight", {in, out, 2, 2}, Form::kTransposed, 4});
    const ValueId bias =
        parameter(name + ".bias", {4 * out}, {name + ".bias", {out}, Form::kRepeated, 4});
    return graph_.op("patches2d", {convolve(x, weight, bias, kNoValue)},
                     {{"size", std::int64_t{2}}, {"up", true}});
}

ValueId Layers::layer_norm(const std::string& name, ValueId x, double eps) {
    if (!ok()) return kNoValue;
    const std::uint32_t c = channels(x);
    const ValueId gamma = parameter(name + ".weight", {c}, {name + ".weight", {c}});
    const ValueId beta = parameter(name + ".bias", {c}, {name + ".bias", {c}});
    return graph_.op("layer_norm", {x, gamma, beta}, {{"eps", eps}});
}

ValueId Layers::group_norm(const std::string& name, ValueId x, std::uint32_t groups, double eps) {
    if (!ok()) return kNoValue;
    const std::uint32_t c = channels(x);
    const ValueId gamma = parameter(name + ".weight", {c}, {name + ".weight", {c}});
    const ValueId beta = parameter(name + ".bias", {c}, {name + ".bias", {c}});
    return graph_.op("group_norm", {x, gamma, beta},
                     {{"groups", std::int64_t{groups}}, {"eps", eps}});
}

ValueId Layers::pad(ValueId x, const Pad& pad) {
    return graph_.op(
        "pad2d", {x},
        {{"left", pad.left}, {"right", pad.right}, {"top", pad.top}, {"bottom", pad.bottom}});
}

}  // namespace splat::vision
