#pragma once

#include <bit>

#include <algorithm>
#include <array>

#include "ops/activations/activation.h"
#include "ops/gaussian_head.h"
#include "ops/op_harness.h"
#include "support/rng_fill.h"

/// One or more small calls of every operator, for the properties of all operators: the same bits on
/// every run and with any number of threads, each gradient alone, sums into the gradients of
/// parameters, every kernel in use.
namespace splat::test {

inline OpCall sample(const std::string& op, const Json& attributes,
                     const std::vector<HostTensor>& inputs,
                     const std::vector<HostTensor>& grad_outputs) {
    OpCall call;
    call.op = op;
    call.attributes = attributes;
    call.inputs = inputs;
    call.grad_outputs = grad_outputs;
    return call;
}

/// With gradients of every output, for outputs of the given shapes.
inline OpCall sample(const std::string& op, const Json& attributes,
                     const std::vector<HostTensor>& inputs, const std::vector<Shape>& outputs) {
    std::vector<HostTensor> grads;
    for (const Shape& shape : outputs) grads.push_back(normal_tensor(shape, 90 + grads.size()));
    return sample(op, attributes, inputs, grads);
}

inline void add_elementwise_samples(std::vector<OpCall>& calls) {
    const Shape image{2, 6, 4, 6};
    const HostTensor x = normal_tensor(image, 1);
    calls.push_back(sample("add", {{"scale", 0.5}}, {x, normal_tensor(image, 2)}, {image}));
    for (const ops::OpRow* row : ops::op_table()) {  // without and with each of their flags
        if (row->plan != ops::activation_plan) continue;
        calls.push_back(sample(row->name, Json::object(), {x}, {image}));
        for (const ops::Attribute& flag : row->attributes)
            calls.push_back(sample(row->name, {{flag.name, true}}, {x}, {image}));
    }
    const HostTensor filter{{4}, {1, 3, 3, 1}};
    calls.push_back(sample("resample2d", {{"up", true}}, {x, filter}, {Shape{2, 6, 8, 12}}));
    calls.push_back(sample("resample2d", {{"down", true}}, {x, {}}, {Shape{2, 6, 2, 3}}));
    calls.push_back(sample("film", Json::object(), {x, normal_tensor({2, 12}, 3)}, {image}));
    calls.push_back(sample("film", Json::object(), {x, normal_tensor({2, 6}, 4)}, {image}));
}

inline void add_feature_samples(std::vector<OpCall>& calls) {
    const Shape image{2, 6, 5, 6};
    calls.push_back(
        sample("max_pool2d", Json::object(), {normal_tensor(image, 2)}, {Shape{2, 6, 2, 3}}));
    calls.push_back(
        sample("feature_distance", Json::object(),
               {normal_tensor(image, 3), normal_tensor(image, 4), normal_tensor({6}, 5, 1, 0.1)},
               {Shape{2, 1}}));
}

inline void add_attention_samples(std::vector<OpCall>& calls) {
    const Shape q{2, 8, 5, 7};
    const Shape k{2, 8, 33};
    calls.push_back(sample("attention", {{"heads", 2}},
                           {normal_tensor(q, 11), normal_tensor(k, 12), normal_tensor(k, 13)},
                           {q}));
    const Shape part{2, 5, 6};
    calls.push_back(
        sample("split3", Json::object(), {normal_tensor({2, 15, 6}, 14)}, {part, part, part}));
    for (const std::uint32_t channels : {4U, 5U})  // copies, and kernels
        calls.push_back(sample("concat", Json::object(),
                               {normal_tensor({2, channels, 6}, 15), normal_tensor({2, 6, 6}, 16)},
                               {Shape{2, channels + 6, 6}}));
}

/// Which optional tensors a head's call has, and whether its matrices are perspective.
struct HeadCameras {
    bool focal;
    bool origin;
    bool projective;
};

/// A call of gaussian_head with cameras at random: `images` is [images, height, width].
inline OpCall head_sample(const Shape& images, std::uint32_t views, const HeadForm& form,
                          const HeadCameras& with, std::uint64_t seed) {
    const HeadLayout layout(form);
    const std::uint32_t n = images[0];
    const std::uint32_t batch = n / views;
    const std::uint32_t each = views * images[1] * images[2] * form.per_pixel;
    HostTensor rays = normal_tensor({3, images[1], images[2]}, seed + 1, 0, with.focal ? 40 : 0.5);
    std::fill(rays.values.end() - images[1] * images[2], rays.values.end(), 1.0F);
    HostTensor matrices = normal_tensor({n, 4, 4}, seed + 2);
    for (std::size_t i = 3; i < matrices.values.size(); i += 4) {  // the column that gives w
        const float w = i % 16 == 15 ? 1.0F : 0.0F;
        matrices.values[i] = with.projective ? 4 * w + 0.2F * matrices.values[i] : w;
    }
    Json attributes;
    for (const JsonScalar& attribute : ops::gaussian_head_attributes(form, views))
        std::visit([&](const auto& value) { attributes[attribute.name] = value; }, attribute.value);
    OpCall call = sample("gaussian_head", attributes,
                         {normal_tensor({n, layout.channels(), images[1], images[2]}, seed),
                          rays,
                          matrices,
                          normal_tensor({n, 4}, seed + 3),
                          normal_tensor({n, 2}, seed + 4, 40, 2),
                          {}},
                         {Shape{batch, each, 3},
                          {batch, each, 1},
                          {batch, each, 3},
                          {batch, each, 4},
                          {batch, each, layout.coefficients(), 3}});
    if (!with.focal) call.inputs[4] = {};
    if (form.positions == kHeadInputDepth)
        call.inputs[5] = normal_tensor(images, seed + 5, 2, 0.1);
    else if (with.origin)
        call.inputs[5] = normal_tensor({n}, seed + 5, 2, 0.1);
    return call;
}

inline void add_random_samples(std::vector<OpCall>& calls) {
    const Shape image{2, 6, 4, 6};
    // Words of the counter are bits: small floats of other value.
    const HostTensor counter{{4},
                             {std::bit_cast<float>(7U), std::bit_cast<float>(9U),
                              std::bit_cast<float>(3U), std::bit_cast<float>(0U)}};
    calls.push_back(sample("dropout", {{"p", 0.3}}, {normal_tensor(image, 23), counter}, {image}));
    calls.push_back(sample("positional_embedding", {{"dimension", 10}, {"swap_halves", true}},
                           {normal_tensor({3, 6}, 24)}, {Shape{3, 60}}));
    calls.push_back(sample("fourier_embedding", Json::object(),
                           {normal_tensor({3, 6}, 25), normal_tensor({5}, 26, 0, 16)},
                           {Shape{3, 60}}));
}

/// Parts of blocks and tiles in every direction.
inline void add_matrix_samples(std::vector<OpCall>& calls) {
    for (const auto& [rows, in, out] : {std::array{17U, 15U, 31U}, {67U, 63U, 33U}})
        calls.push_back(sample(
            "linear", Json::object(),
            {normal_tensor({rows, in}, 8), normal_tensor({out, in}, 9), normal_tensor({out}, 10)},
            {Shape{rows, out}}));
    const auto conv = [&](std::uint32_t out, int winograd) {
        calls.push_back(sample("conv2d", {{"scale", 0.5}, {"winograd", winograd}},
                               {normal_tensor({2, 9, 9, 8}, 11), normal_tensor({out, 9, 3, 3}, 12),
                                normal_tensor({out}, 13), normal_tensor({2, out, 9, 8}, 14)},
                               {Shape{2, out, 9, 8}}));
    };
    for (const int winograd : {0, 2, 4}) conv(15, winograd);  // 0: by taps
    conv(17, 0);                                              // directly
    calls.push_back(sample("conv2d", {{"scale", 0.5}},
                           {normal_tensor({2, 6, 5, 7}, 11), normal_tensor({10, 6, 1, 1}, 12),
                            normal_tensor({10}, 13), normal_tensor({2, 10, 5, 7}, 14)},
                           {Shape{2, 10, 5, 7}}));
}

inline std::vector<OpCall> op_samples() {
    std::vector<OpCall> calls;
    for (const std::uint32_t channels : {8U, 6U})  // whole quads per group, and not
        calls.push_back(sample("group_norm", {{"groups", 2}, {"silu", true}},
                               {normal_tensor({2, channels, 5, 7}, 5), normal_tensor({channels}, 6),
                                normal_tensor({channels}, 7)},
                               {Shape{2, channels, 5, 7}}));
    add_matrix_samples(calls);
    add_elementwise_samples(calls);
    add_attention_samples(calls);
    add_feature_samples(calls);
    add_random_samples(calls);
    calls.push_back(head_sample({4, 5, 7}, 2, {}, {true, true, false}, 20));
    calls.push_back(sample("edge_loss", {{"scharr", true}},
                           {normal_tensor({2, 3, 9, 13}, 32), normal_tensor({2, 3, 9, 13}, 33),
                            normal_tensor({2, 1, 9, 13}, 34, 1)},
                           {Shape{1}}));
    for (const char* loss : {"l1", "l2", "ssim"})
        calls.push_back(sample(loss, Json::object(),
                               {normal_tensor({2, 3, 9, 13}, 30), normal_tensor({2, 3, 9, 13}, 31)},
                               {Shape{1}}));
    return calls;
}

}  // namespace splat::test
