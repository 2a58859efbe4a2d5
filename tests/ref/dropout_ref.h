#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "ref/op_ref.h"

/// y = mask x / (1 - p); the gradient is the same map of grad_y. The mask of element (n, c, p) is word
/// c % 4 of philox((quad, step, stream + offset, 0), seed) for its quad in the layout [c/4][n*p].
namespace splat::ref {

/// Philox 4x32-10 (Salmon et al. 2011): ten rounds of two products each, the key growing by constants.
inline std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                           std::array<std::uint32_t, 2> key) {
    for (int round = 0; round < 10; ++round) {
        const std::uint64_t first = std::uint64_t{0xD2511F53U} * counter[0];
        const std::uint64_t second = std::uint64_t{0xCD9E8D57U} * counter[2];
        counter = {static_cast<std::uint32_t>(second >> 32) ^ counter[1] ^ key[0],
                   static_cast<std::uint32_t>(second),
                   static_cast<std::uint32_t>(first >> 32) ^ counter[3] ^ key[1],
                   static_cast<std::uint32_t>(first)};
        key = {key[0] + 0x9E3779B9U, key[1] + 0xBB67AE85U};
    }
    return counter;
}

struct DropoutShape {
    std::size_t n = 1;
    std::size_t c = 1;
    std::size_t p = 1;
};

template <class Real>
Summed<Real> dropout(const DropoutShape& shape, double probability, std::uint32_t stream,
                     const std::array<std::uint32_t, 4>& counter, const std::vector<Real>& x) {
    Summed<Real> y(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const std::size_t channel = i / shape.p % shape.c;
        const std::size_t column = i / shape.p / shape.c * shape.p + i % shape.p;
        const auto quad = static_cast<std::uint32_t>(channel / 4 * shape.n * shape.p + column);
        const auto words =
            philox({quad, counter[2], stream + counter[3], 0}, {counter[0], counter[1]});
        const bool keep = static_cast<double>(words[channel % 4]) * 0x1p-32 >= probability;
        y.add(i, keep ? x[i] / (1 - probability) : Real(0));
    }
    return y;
}

inline Summed<double> dropout_of(const OpArguments& in, const Values& values) {
    std::array<std::uint32_t, 4> counter{};
    for (std::size_t i = 0; i < 4; ++i)  // words in the bits of floats
        counter[i] = std::bit_cast<std::uint32_t>(static_cast<float>(in.values(1)[i]));
    const OpTensor& x = in.inputs[0];
    return dropout({x.dim(0), x.dim(1), x.pixels()}, in.attribute("p"),
                   static_cast<std::uint32_t>(in.attribute("stream")), counter, values);
}

inline OpExample dropout_example(const Dims& dims) {
    return {.inputs = {{dims}, {{4}, 0, 0, true}},
            .outputs = {dims},
            .attributes = R"({"p": 0.1})",
            .change = [](std::vector<std::vector<float>>& inputs) {
                // Words of the counter are bits: small floats of other value.
                inputs[1] = {std::bit_cast<float>(7U), std::bit_cast<float>(9U),
                             std::bit_cast<float>(3U), std::bit_cast<float>(0U)};
            }};
}

inline constexpr OpRef kDropoutRef{
    .name = "dropout",
    .forward = [](const OpArguments& in) -> Sums { return {dropout_of(in, in.values(0))}; },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        return {dropout_of(in, grads[0]), {}};
    },
    .examples =
        [] {
            return std::vector{dropout_example({2, 6, 4, 6})};
        },
    .sizes = [] { return at_image_sizes(dropout_example); }};

}  // namespace splat::ref
