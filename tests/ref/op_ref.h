#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ref/summed.h"

/// A reference as the op table calls its kernels, with calls to try and to measure: for tests of all operators and of
/// whole networks, and for benchmarks.
namespace splat::ref {

using Values = std::vector<double>;
using Sums = std::vector<Summed<double>>;
using Grads = std::vector<Values>;
using Dims = std::vector<std::size_t>;

/// Row-major; without dimensions where an optional input is absent.
struct OpTensor {
    Dims dims;
    Values values;

    [[nodiscard]] std::size_t dim(std::size_t axis) const { return dims.at(axis); }
    /// Elements per channel of [N, C, ...].
    [[nodiscard]] std::size_t pixels() const { return values.size() / (dim(0) * dim(1)); }
};

/// Tensors in the order of the row's ports.
struct OpArguments {
    std::vector<OpTensor> inputs;
    std::map<std::string, double>
        attributes;  ///< by name, booleans as 0 and 1; every one of the row

    [[nodiscard]] const Values& values(std::size_t i) const { return inputs.at(i).values; }
    [[nodiscard]] double attribute(const char* name) const { return attributes.at(name); }
    /// Value as the library holds it.
    [[nodiscard]] double single(const char* name) const {
        return static_cast<double>(static_cast<float>(attribute(name)));
    }
    [[nodiscard]] std::size_t count(const char* name) const {
        return static_cast<std::size_t>(attribute(name));
    }
    [[nodiscard]] bool flag(const char* name) const { return attribute(name) != 0; }
};

/// An input of normal numbers; without dimensions: absent.
struct OpInput {
    Dims dims = {};
    double mean = 0;
    double deviation = 1;
    bool constant = false;  ///< has no gradient
};

struct OpExample {
    std::vector<OpInput> inputs;
    std::vector<Dims> outputs;
    std::string attributes = "{}";  ///< JSON
    std::string title =
        {};  ///< in reports; empty: the shape of the first input, and the attributes
    void (*change)(std::vector<std::vector<float>>& inputs) =
        nullptr;  ///< values that are not normal
    bool plain =
        true;  ///< time the plain kernels, too; false if another case of the same shapes does
};

/// The row of an operator: `inline constexpr OpRef kFooRef` at the beginning of a line of foo_ref.h, where CMake finds
/// it.
struct OpRef {
    const char* name;
    Sums (*forward)(const OpArguments& in);
    /// Gradients of the inputs: without elements for constant or absent ones.
    Sums (*backward)(const OpArguments& in, const Grads& grads);
    /// Small calls of every path, for tests of all operators; `--quick` measures the first.
    std::vector<OpExample> (*examples)();
    /// Sizes of networks, to measure.
    std::vector<OpExample> (*sizes)();
};

/// Every operator.
std::span<const OpRef* const> op_refs();

/// nullptr for an unknown name.
inline const OpRef* find_op(std::string_view name) {
    for (const OpRef* op : op_refs())
        if (op->name == name) return op;
    return nullptr;
}

inline std::string text_of(const Dims& dims) {
    std::string text;
    for (const std::size_t size : dims) text += (text.empty() ? "[" : ",") + std::to_string(size);
    return text + "]";
}

/// make(dims) of a middle level of the network and of its largest.
std::vector<OpExample> at_image_sizes(const auto& make) {
    return {make(Dims{1, 256, 32, 32}), make(Dims{1, 128, 128, 128})};
}

/// Calls of operators from x to y of one shape: without attributes, and with each of the others.
template <auto... kAttributes>
std::vector<OpExample> elementwise_example(const Dims& dims) {
    return {{.inputs = {{dims}}, .outputs = {dims}},
            {.inputs = {{dims}}, .outputs = {dims}, .attributes = kAttributes}...};
}

/// The row of an operator that maps each element of x by itself, with some of its attributes as JSON.
template <auto... kAttributes>
constexpr OpRef elementwise_ref(const char* name, decltype(OpRef::forward) forward,
                                decltype(OpRef::backward) backward) {
    return {name, forward, backward,
            [] {
                return elementwise_example<kAttributes...>({2, 6, 4, 6});
            },
            [] {
                std::vector<OpExample> all = elementwise_example<kAttributes...>({1, 256, 32, 32});
                for (OpExample& one : elementwise_example<kAttributes...>({1, 128, 128, 128}))
                    all.push_back(std::move(one));
                return all;
            }};
}

/// Calls of losses of two images, the second constant.
inline std::vector<OpExample> image_loss_example(const Dims& dims) {
    return {{.inputs = {{dims, 0.5, 0.25}, {dims, 0.5, 0.25, true}}, .outputs = {{1}}}};
}
inline std::vector<OpExample> image_loss_examples() {
    return image_loss_example({2, 3, 9, 13});
}
inline std::vector<OpExample> image_loss_sizes() {
    return image_loss_example({4, 3, 128, 128});
}

/// The row of a loss whose passes take the values of both images.
template <auto kForward, auto kBackward>
constexpr OpRef image_loss_ref(const char* name) {
    return {name,
            [](const OpArguments& in) -> Sums { return {kForward(in.values(0), in.values(1))}; },
            [](const OpArguments& in, const Grads& grads) -> Sums {
                return {kBackward(in.values(0), in.values(1), grads[0][0]), {}};
            },
            image_loss_examples, image_loss_sizes};
}

}  // namespace splat::ref
