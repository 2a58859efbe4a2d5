#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// part_j[n,c,p] = x[n, 3c + j, p], stacked x[n, jC + c, p]: a permutation, whose gradient is its inverse.
namespace splat::ref {

/// Index in x of element i of part j, of c channels of p elements.
struct Split3Place {
    std::size_t c, p;
    bool stacked;
    [[nodiscard]] std::size_t at(std::size_t j, std::size_t i) const {
        const std::size_t n = i / (c * p), channel = i / p % c;
        return (3 * n * c + (stacked ? j * c + channel : 3 * channel + j)) * p + i % p;
    }
};

template <class Real>
std::array<Summed<Real>, 3> split3_forward(const Split3Place& place, const std::vector<Real>& x) {
    const std::size_t size = x.size() / 3;
    std::array<Summed<Real>, 3> parts;
    for (std::size_t j = 0; j < 3; ++j) {
        parts[j] = Summed<Real>(size, 1);
        for (std::size_t i = 0; i < size; ++i) parts[j].add(i, x[place.at(j, i)]);
    }
    return parts;
}

template <class Real>
Summed<Real> split3_backward(const Split3Place& place,
                             const std::array<std::vector<Real>, 3>& grads) {
    Summed<Real> grad_x(3 * grads[0].size(), 1);
    for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t i = 0; i < grads[j].size(); ++i)
            grad_x.add(place.at(j, i), grads[j][i]);
    return grad_x;
}

inline Split3Place split3_place(const OpArguments& in) {
    return {in.inputs[0].dim(1) / 3, in.inputs[0].pixels(), in.flag("stacked")};
}

inline OpExample split3_example(const Dims& part, const char* attributes = "{}") {
    Dims x = part;
    x[1] *= 3;
    return {.inputs = {{x}}, .outputs = {part, part, part}, .attributes = attributes};
}

inline constexpr OpRef kSplit3Ref{
    .name = "split3",
    .forward = [](const OpArguments& in) -> Sums {
        const auto parts = split3_forward(split3_place(in), in.values(0));
        return {parts[0], parts[1], parts[2]};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        return {split3_backward<double>(split3_place(in), {grads[0], grads[1], grads[2]})};
    },
    .examples =
        []() -> std::vector<OpExample> {
            return {split3_example({2, 5, 6}), split3_example({2, 8, 6}, R"({"stacked":true})")};
        },
    .sizes =
        []() -> std::vector<OpExample> {
            return {split3_example({1, 256, 16, 16}),
                    split3_example({1, 256, 16, 16}, R"({"stacked":true})")};
        }};

}  // namespace splat::ref
