#pragma once

#include "op_harness.h"
#include "support/rng_fill.h"

/// One or more small calls of every operator, for what all of them must do: the same bits on every
/// run and with any number of threads, each gradient alone, sums into parameters' gradients, every
/// kernel in use.
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
    calls.push_back(sample("silu", Json::object(), {x}, {image}));
    const HostTensor filter{{4}, {1, 3, 3, 1}};
    calls.push_back(sample("resample2d", {{"up", true}}, {x, filter}, {Shape{2, 6, 8, 12}}));
    calls.push_back(sample("resample2d", {{"down", true}}, {x, {}}, {Shape{2, 6, 2, 3}}));
    calls.push_back(sample("film", Json::object(), {x, normal_tensor({2, 12}, 3)}, {image}));
    calls.push_back(sample("film", Json::object(), {x, normal_tensor({2, 6}, 4)}, {image}));
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

inline void add_gaussian_samples(std::vector<OpCall>& calls) {
    const Shape point{1, 24, 3};
    calls.push_back(sample("gaussian_head", {{"views", 2}},
                           {normal_tensor({2, 24, 3, 4}, 17), normal_tensor({3, 3, 4}, 18),
                            normal_tensor({2, 4, 4}, 19), normal_tensor({2, 4}, 20),
                            normal_tensor({2, 2}, 21), normal_tensor({2, 3, 4}, 22)},
                           {point, Shape{1, 24, 1}, point, Shape{1, 24, 4}, Shape{1, 24, 4, 3}}));
}

inline std::vector<OpCall> op_samples() {
    std::vector<OpCall> calls;
    for (const std::uint32_t channels : {8U, 6U})  // whole quads per group, and not
        calls.push_back(sample("group_norm", {{"groups", 2}, {"silu", true}},
                               {normal_tensor({2, channels, 5, 7}, 5), normal_tensor({channels}, 6),
                                normal_tensor({channels}, 7)},
                               {Shape{2, channels, 5, 7}}));
    calls.push_back(
        sample("linear", Json::object(),
               {normal_tensor({17, 15}, 8), normal_tensor({31, 15}, 9), normal_tensor({31}, 10)},
               {Shape{17, 31}}));
    add_elementwise_samples(calls);
    add_attention_samples(calls);
    add_gaussian_samples(calls);
    return calls;
}

}  // namespace splat::test
