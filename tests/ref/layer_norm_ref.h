#pragma once

#include <cstddef>
#include <vector>

#include "ref/group_norm_ref.h"

/// Layer normalisation over the channels of each pixel: group normalisation in one group of [N*P, C], a pixel an image.
namespace splat::ref {

/// [N,C,P] to [N,P,C]; the way back has C and P exchanged.
template <class Real>
std::vector<Real> channels_last(const std::vector<Real>& x, std::size_t N, std::size_t C,
                                std::size_t P) {
    std::vector<Real> y(x.size());
    for (std::size_t n = 0; n < N; ++n)
        for (std::size_t c = 0; c < C; ++c)
            for (std::size_t p = 0; p < P; ++p) y[(n * P + p) * C + c] = x[(n * C + c) * P + p];
    return y;
}

struct LayerNormCall {
    std::size_t N;
    std::size_t C;
    std::size_t P;
    GroupNormInput<double> in;

    [[nodiscard]] Values last(const Values& x) const { return channels_last(x, N, C, P); }
    [[nodiscard]] Summed<double> first(Summed<double> y) const {
        y.value = channels_last(y.value, N, P, C);
        y.magnitude = channels_last(y.magnitude, N, P, C);
        return y;
    }
};

inline LayerNormCall layer_norm_call(const OpArguments& in) {
    const OpTensor& x = in.inputs[0];
    LayerNormCall call{x.dim(0), x.dim(1), x.pixels(), {}};
    call.in = {{call.N * call.P, call.C, 1, 1}, in.single("eps"), false,
               call.last(x.values),             in.values(1),     in.values(2)};
    return call;
}

inline std::vector<OpExample> layer_norm_example(const Dims& x) {
    return {{.inputs = {{x, 0.5, 1}, {{x[1]}, 1, 0.25}, {{x[1]}, 0, 0.25}},
             .outputs = {x},
             .attributes = "{\"eps\": 1e-6}"}};
}

inline constexpr OpRef kLayerNormRef{
    .name = "layer_norm",
    .forward = [](const OpArguments& in) -> Sums {
        const LayerNormCall call = layer_norm_call(in);
        return {call.first(group_norm_forward(call.in).y)};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        const LayerNormCall call = layer_norm_call(in);
        const auto grad = group_norm_backward(call.in, call.last(grads[0]));
        return {call.first(grad.grad_x), grad.grad_gamma, grad.grad_beta};
    },
    .examples =
        [] {
            return layer_norm_example({2, 6, 5, 7});
        },
    .sizes =
        [] {  // tokens MoGe-2 has: least and most of the small network, and least of the large one
            std::vector<OpExample> all;
            for (const Dims& x : {Dims{1, 384, 1200}, Dims{1, 384, 3600}, Dims{1, 1024, 1200}})
                for (OpExample& one : layer_norm_example(x)) all.push_back(std::move(one));
            return all;
        }};

}  // namespace splat::ref
