#pragma once

#include <string_view>

#include "ref/activations/gelu_ref.h"
#include "ref/activations/relu_ref.h"
#include "ref/activations/silu_ref.h"
#include "ref/add_ref.h"
#include "ref/concat_ref.h"
#include "ref/every/op_arguments_ref.h"
#include "ref/losses/l1_ref.h"
#include "ref/losses/l2_ref.h"
#include "ref/split3_ref.h"

/// Every operator by its name: the references of this folder, called as the op table calls the kernels, for
/// tests of whole networks and of all operators.
namespace splat::ref {

using Sums = std::vector<Summed<double>>;

/// `forward` gives the outputs, `backward` the gradients of the inputs: without elements for constant or
/// absent ones.
struct EveryOp {
    const char* name;
    Sums (*forward)(const OpArguments& in);
    Sums (*backward)(const OpArguments& in, const std::vector<Values>& grads);
};

namespace every {

using Grads = std::vector<Values>;

/// One input; `kBackward` takes it and the gradient.
template <auto kForward, auto kBackward>
struct Pointwise {
    static Sums forward(const OpArguments& in) { return {kForward(in.values(0))}; }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        return {kBackward(in.values(0), grads[0])};
    }
};

/// Two images, the second constant.
template <auto kForward, auto kBackward>
struct PixelLoss {
    static Sums forward(const OpArguments& in) { return {kForward(in.values(0), in.values(1))}; }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        return {kBackward(in.values(0), in.values(1), grads[0][0]), {}};
    }
};

using L1 = PixelLoss<l1_forward<double>, l1_backward<double>>;
using L2 = PixelLoss<l2_forward<double>, l2_backward<double>>;
using Relu = Pointwise<relu_forward<double>, relu_backward<double>>;
using Silu = Pointwise<silu_forward<double>, silu_backward<double>>;

struct Add {
    static Sums forward(const OpArguments& in) {
        return {ref::add_forward(in.single("scale"), in.values(0), in.values(1))};
    }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        const auto grad = ref::add_backward(in.single("scale"), grads[0]);
        return {grad, grad};
    }
};

struct Attention {
    static Sums forward(const OpArguments& in) { return {ref::attention_forward(attention(in))}; }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        const auto grad = ref::attention_backward(attention(in), grads[0]);
        return {grad.grad_q, grad.grad_k, grad.grad_v};
    }
};

struct Concat {
    static Sums forward(const OpArguments& in) {
        return {ref::concat_forward(in.inputs[0].dim(0), in.values(0), in.values(1))};
    }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        const std::size_t n = in.inputs[0].dim(0);
        const std::size_t a = in.values(0).size() / n;
        return {ref::concat_backward(n, 0, a, grads[0]),
                ref::concat_backward(n, a, in.values(1).size() / n, grads[0])};
    }
};

struct Conv2d {
    static Sums forward(const OpArguments& in) { return {ref::conv2d_forward(conv2d(in))}; }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        const auto grad = ref::conv2d_backward(conv2d(in), grads[0]);
        return {grad.grad_x, grad.grad_weight, grad.grad_bias, grad.grad_residual};
    }
};

struct Dropout {
    static Sums forward(const OpArguments& in) { return {dropout(in, in.values(0))}; }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        return {dropout(in, grads[0]), {}};
    }
};

struct EdgeLoss {
    static Sums forward(const OpArguments& in) { return {ref::edge_loss_forward(edge_loss(in))}; }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        return {ref::edge_loss_backward(edge_loss(in), grads[0][0]), {}, {}};
    }
};

struct FeatureDistance {
    static Sums forward(const OpArguments& in) {
        return {
            ref::feature_distance_forward(features(in), in.values(0), in.values(1), in.values(2))};
    }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        return {ref::feature_distance_backward(features(in), in.values(0), in.values(1),
                                               in.values(2), grads[0]),
                {},
                {}};
    }
};

struct Film {
    static Sums forward(const OpArguments& in) { return {ref::film_forward(film(in))}; }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        const auto grad = ref::film_backward(film(in), grads[0]);
        return {grad.grad_x, grad.grad_modulation};
    }
};

struct FourierEmbedding {
    static Sums forward(const OpArguments& in) {
        return {ref::fourier_embedding_forward(fourier(in), in.values(0), in.values(1))};
    }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        return {ref::fourier_embedding_backward(fourier(in), in.values(0), in.values(1), grads[0]),
                {}};
    }
};

struct GaussianHead {
    static Sums forward(const OpArguments& in) {
        Sums outputs;
        for (const auto& values : ref::gaussian_head_forward<Rounded>(gaussian_head(in)))
            outputs.push_back(summed(values));
        return outputs;
    }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        GaussianHeadOutputs<double> given;
        for (std::size_t i = 0; i < given.size(); ++i) given[i] = grads[i];
        return {summed(ref::gaussian_head_backward<Rounded>(gaussian_head(in), given)),
                {},
                {},
                {},
                {},
                {}};
    }
};

struct Gelu {
    static Sums forward(const OpArguments& in) {
        return {ref::gelu_forward(in.values(0), in.flag("tanh"))};
    }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        return {ref::gelu_backward(in.values(0), grads[0], in.flag("tanh"))};
    }
};

struct GroupNorm {
    static Sums forward(const OpArguments& in) {
        return {ref::group_norm_forward(group_norm(in)).y};
    }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        const auto grad = ref::group_norm_backward(group_norm(in), grads[0]);
        return {grad.grad_x, grad.grad_gamma, grad.grad_beta};
    }
};

struct Linear {
    static Sums forward(const OpArguments& in) { return {ref::linear_forward(linear(in))}; }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        const auto grad = ref::linear_backward(linear(in), grads[0]);
        return {grad.grad_x, grad.grad_weight, grad.grad_bias};
    }
};

struct MaxPool2d {
    static Sums forward(const OpArguments& in) {
        return {ref::max_pool2d_forward(pool(in), in.values(0))};
    }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        return {ref::max_pool2d_backward(pool(in), in.values(0), grads[0])};
    }
};

struct PositionalEmbedding {
    static Sums forward(const OpArguments& in) {
        return {ref::positional_embedding_forward(embedding(in), in.values(0))};
    }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        return {ref::positional_embedding_backward(embedding(in), in.values(0), grads[0])};
    }
};

struct Resample2d {
    static Sums forward(const OpArguments& in) {
        return {resample2d(in, in.values(0), in.flag("up"))};
    }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        return {resample2d(in, grads[0], !in.flag("up")), {}};
    }
};

struct Split3 {
    static Sums forward(const OpArguments& in) {
        const auto parts = ref::split3_forward(in.inputs[0].pixels(), in.values(0));
        return {parts[0], parts[1], parts[2]};
    }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        return {
            ref::split3_backward<double>(in.inputs[0].pixels(), {grads[0], grads[1], grads[2]})};
    }
};

struct Ssim {
    static Sums forward(const OpArguments& in) {
        return {summed(ref::ssim_forward<Rounded>(ssim(in)), in.values(0).size())};
    }
    static Sums backward(const OpArguments& in, const Grads& grads) {
        return {summed(ref::ssim_backward<Rounded>(ssim(in), grads[0][0]), kSsimTerms), {}};
    }
};

}  // namespace every

inline constexpr EveryOp kEveryOp[] = {
    {"add", every::Add::forward, every::Add::backward},
    {"attention", every::Attention::forward, every::Attention::backward},
    {"concat", every::Concat::forward, every::Concat::backward},
    {"conv2d", every::Conv2d::forward, every::Conv2d::backward},
    {"dropout", every::Dropout::forward, every::Dropout::backward},
    {"edge_loss", every::EdgeLoss::forward, every::EdgeLoss::backward},
    {"feature_distance", every::FeatureDistance::forward, every::FeatureDistance::backward},
    {"film", every::Film::forward, every::Film::backward},
    {"fourier_embedding", every::FourierEmbedding::forward, every::FourierEmbedding::backward},
    {"gaussian_head", every::GaussianHead::forward, every::GaussianHead::backward},
    {"gelu", every::Gelu::forward, every::Gelu::backward},
    {"group_norm", every::GroupNorm::forward, every::GroupNorm::backward},
    {"l1", every::L1::forward, every::L1::backward},
    {"l2", every::L2::forward, every::L2::backward},
    {"linear", every::Linear::forward, every::Linear::backward},
    {"max_pool2d", every::MaxPool2d::forward, every::MaxPool2d::backward},
    {"positional_embedding", every::PositionalEmbedding::forward,
     every::PositionalEmbedding::backward},
    {"relu", every::Relu::forward, every::Relu::backward},
    {"resample2d", every::Resample2d::forward, every::Resample2d::backward},
    {"silu", every::Silu::forward, every::Silu::backward},
    {"split3", every::Split3::forward, every::Split3::backward},
    {"ssim", every::Ssim::forward, every::Ssim::backward},
};

/// nullptr for an unknown name.
inline const EveryOp* find_op(std::string_view name) {
    for (const EveryOp& op : kEveryOp)
        if (op.name == name) return &op;
    return nullptr;
}

}  // namespace splat::ref
