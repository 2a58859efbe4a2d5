#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// part_j[n,c,p] = x[n, 3c + j, p]: a permutation, whose gradient is its inverse.
namespace splat::ref {

/// `parts` of [n,c,p] each.
template <class Real>
std::array<Summed<Real>, 3> split3_forward(std::size_t p, const std::vector<Real>& x) {
    const std::size_t size = x.size() / 3;
    std::array<Summed<Real>, 3> parts;
    for (std::size_t j = 0; j < 3; ++j) {
        parts[j] = Summed<Real>(size, 1);
        for (std::size_t i = 0; i < size; ++i) parts[j].add(i, x[(i / p * 3 + j) * p + i % p]);
    }
    return parts;
}

template <class Real>
Summed<Real> split3_backward(std::size_t p, const std::array<std::vector<Real>, 3>& grads) {
    Summed<Real> grad_x(3 * grads[0].size(), 1);
    for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t i = 0; i < grads[j].size(); ++i)
            grad_x.add((i / p * 3 + j) * p + i % p, grads[j][i]);
    return grad_x;
}

inline std::vector<OpExample> split3_example(const Dims& part) {
    Dims x = part;
    x[1] *= 3;
    return {{.inputs = {{x}}, .outputs = {part, part, part}}};
}

inline constexpr OpRef kSplit3Ref{
    .name = "split3",
    .forward = [](const OpArguments& in) -> Sums {
        const auto parts = split3_forward(in.inputs[0].pixels(), in.values(0));
        return {parts[0], parts[1], parts[2]};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        return {split3_backward<double>(in.inputs[0].pixels(), {grads[0], grads[1], grads[2]})};
    },
    .examples =
        [] {
            return split3_example({2, 5, 6});
        },
    .sizes =
        [] {
            return split3_example({1, 256, 16, 16});
        }};

}  // namespace splat::ref
