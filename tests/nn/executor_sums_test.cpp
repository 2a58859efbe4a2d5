#include <gtest/gtest.h>

#include "core/fault.h"
#include "nn/executor.h"
#include "ops/op_harness.h"
#include "ref/conv2d_ref.h"
#include "support/compare.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/log_capture.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using nn::kNoValue;
using nn::ValueId;

using Doubles = std::vector<double>;

constexpr std::uint32_t kC = 6, kRank = 3, kH = 5, kW = 4;

/// One convolution of the network: x [C,H,W] and its weight, by name.
struct Layer {
    const char* weight;
    std::uint32_t in, out, kernel;
    double scale;
    int winograd;
    bool trainable = true;  ///< the others' prepared forms are kept
};
constexpr Layer kT{"t", kC, kC, 3, 1, 2};
constexpr Layer kU{"u", kC, kC, 3, 1, 0, false};
constexpr Layer kP{"p", kC, kC, 1, 1, 0};
constexpr Layer kS{"s", kC, kC, 1, 1, 0, false};
constexpr Layer kQ{"q", kC, kC, 1, 1, 0};
constexpr Layer kA{"a", kC, kRank, 3, 0.5, 0};
constexpr Layer kB{"b", kRank, kC, 1, 1, 0};
constexpr Layer kY{"y", kC, kC, 3, 0.5, 0};
constexpr Layer kLayers[] = {kT, kU, kP, kS, kQ, kA, kB, kY};

std::size_t weights(const Layer& layer) {
    return std::size_t{layer.in} * layer.out * layer.kernel * layer.kernel;
}

/// A layer's weight: whole numbers from -2 to 2, so that every sum is exact.
std::vector<float> weight_of(const Layer& layer) {
    std::vector<float> values = integer_fill(weights(layer), 40 + layer.weight[0]);
    for (float& value : values) value = std::fmod(value, 3.0F);
    return values;
}

/// The adapter of y reads u, as y does; residuals pass from b to q to s; sums pass one gradient on to p, s
/// and y, of which s gets more before p is done; t is an output with a gradient of its own:
///
///   t = T x,  u = U t,  p = P x,  s = S x,  q = Q x + s,  b = B (A u / 2) + q,  y = (Y u + b) / 2,
///   z = (y + s) + p
struct Net {
    explicit Net(vk::Context& context) : graph(context) {
        x = graph.input("x", {1, kC, kH, kW});
        t = conv(kT, x);
        const ValueId u = conv(kU, t);
        const ValueId p = conv(kP, x);
        const ValueId s = conv(kS, x);
        const ValueId q = conv(kQ, x, s);
        const ValueId b = conv(kB, conv(kA, u), q);
        z = graph.op("add", {graph.op("add", {conv(kY, u, b), s}), p});
    }
    ValueId conv(const Layer& layer, ValueId input, ValueId residual = kNoValue) {
        const ValueId weight = graph.parameter(
            layer.weight, {layer.out, layer.in, layer.kernel, layer.kernel}, layer.trainable);
        return graph.op("conv2d", {input, weight, kNoValue, residual},
                        {{"scale", layer.scale}, {"winograd", std::int64_t{layer.winograd}}});
    }
    nn::Graph graph;
    ValueId x, t, z;
};

ref::Conv2dInput<double> input_of(const Layer& layer, const Doubles& x, const Doubles& residual) {
    return {{1, layer.in, kH, kW, layer.out, layer.kernel},
            layer.scale,
            x,
            to_double(weight_of(layer)),
            {},
            residual};
}

Doubles run(const Layer& layer, const Doubles& x, const Doubles& residual = {}) {
    return ref::conv2d_forward(input_of(layer, x, residual)).value;
}

void add_to(Doubles& sum, const Doubles& part) {
    if (sum.empty()) sum.assign(part.size(), 0);
    for (std::size_t i = 0; i < part.size(); ++i) sum[i] += part[i];
}

struct ChainRule {
    Doubles t, z, grad_x;
    std::map<std::string, Doubles> grad_weight;
};

ChainRule chain_rule(const Doubles& x, const Doubles& grad_t, const Doubles& grad_z) {
    ChainRule e;
    e.t = run(kT, x);
    const Doubles u = run(kU, e.t), s = run(kS, x), h = run(kA, u);
    const Doubles b = run(kB, h, run(kQ, x, s));
    e.z = run(kY, u, b);
    add_to(e.z, s);
    add_to(e.z, run(kP, x));
    const auto back = [&](const Layer& layer, const Doubles& in, const Doubles& grad) {
        const auto result = ref::conv2d_backward(input_of(layer, in, {}), grad);
        e.grad_weight[layer.weight] = result.grad_weight.value;
        return std::pair{result.grad_x.value, result.grad_residual.value};
    };
    auto [grad_u, grad_b] = back(kY, u, grad_z);
    const Doubles grad_h = back(kB, h, grad_b).first;
    add_to(grad_u, back(kA, u, grad_h).first);
    Doubles grad_s = grad_z;
    add_to(grad_s, grad_b);
    add_to(e.grad_x, back(kQ, x, grad_b).first);
    add_to(e.grad_x, back(kS, x, grad_s).first);
    add_to(e.grad_x, back(kP, x, grad_z).first);
    Doubles whole_t = grad_t;
    add_to(whole_t, back(kU, e.t, grad_u).first);
    add_to(e.grad_x, back(kT, x, whole_t).first);
    return e;
}

Doubles numbers(vk::Context& context, const vk::BufferView& view) {
    return to_double(download(context, view, view.shape.elements()));
}

class ExecutorSums : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(ExecutorSums);

/// Two passes of a network that keeps at most so many bytes of weights for backward passes. Returns what it keeps.
std::uint64_t expect_exact(vk::Context& device, std::uint64_t kept) {
    Net net(device);
    EXPECT_OK(net.graph.status());
    nn::Parameters parameters = need(nn::Parameters::create(device, net.graph));
    for (const Layer& layer : kLayers)
        EXPECT_OK(parameters.write(*parameters.find(layer.weight), weight_of(layer)));
    const std::size_t size = std::size_t{kC} * kH * kW;
    const std::vector<float> x = integer_fill(size, 1), grad_t = integer_fill(size, 2),
                             grad_z = integer_fill(size, 3);
    const ChainRule e = chain_rule(to_double(x), to_double(grad_t), to_double(grad_z));
    const auto get = [&](const vk::BufferView& view) { return numbers(device, view); };
    const auto put = [&](const vk::BufferView& view, const std::vector<float>& values) {
        EXPECT_OK(device.write(view, values.data(), values.size() * 4));
    };
    const auto executor = need(nn::Executor::create(device, net.graph, parameters,
                                                    {.outputs = {net.z, net.t},
                                                     .backward = true,
                                                     .grad_outputs = {net.z, net.t},
                                                     .grad_inputs = {net.x},
                                                     .kept_bytes = kept}));
    put(executor->tensor(net.x), x);
    put(executor->gradient(net.t), grad_t);
    put(executor->gradient(net.z), grad_z);
    for (int time = 0; time < 2; ++time) {
        EXPECT_OK(parameters.zero_gradients());
        EXPECT_OK(executor->forward());
        EXPECT_OK(executor->backward());
        EXPECT_EQ(get(executor->tensor(net.t)), e.t);
        EXPECT_EQ(get(executor->tensor(net.z)), e.z);
        EXPECT_EQ(get(executor->gradient(net.x)), e.grad_x);
        for (const Layer& layer : kLayers) {
            if (!layer.trainable) continue;
            EXPECT_EQ(get(parameters.find(layer.weight)->grad), e.grad_weight.at(layer.weight))
                << layer.weight;
        }
    }
    return executor->memory().prepared;
}

/// Gradients that are added in the kernels that compute them, or passed on without a copy, are the sums
/// of the chain rule in every pass, however many prepared weights are kept.
TEST_P(ExecutorSums, OfConvolutionsAreExact) {
    const std::uint64_t none = expect_exact(context(), 0);
    const std::uint64_t all = expect_exact(context(), std::uint64_t{1} << 20);
    if (GetParam() == vk::Kernels::kPlain) {
        EXPECT_EQ(none + all, 0U) << "nothing is prepared";
        return;
    }
    EXPECT_GT(none, 0U) << "the forward pass keeps its own";
    EXPECT_GT(all, none);
    const auto limited = [](std::uint64_t budget) {
        vk::ContextDesc desc = context_desc(GetParam());
        desc.memory.block_bytes = 1024;
        desc.memory.budget_bytes = budget;
        return make_context(desc);
    };
    const auto enough = limited(0);
    EXPECT_EQ(expect_exact(*enough, std::uint64_t{1} << 20), all);
    const auto scarce = limited(enough->memory().use().peak - 1);
    const LogCapture log(LogLevel::kInfo);
    EXPECT_EQ(expect_exact(*scarce, std::uint64_t{1} << 20), 0U) << "the device has too little";
    EXPECT_NE(log.text().find("weights are prepared in every pass: "), std::string::npos);
}

/// Take all memory that the device still has.
std::vector<vk::Buffer> take_all(vk::Context& context) {
    std::vector<vk::Buffer> taken;
    for (std::uint64_t bytes = std::uint64_t{1} << 20; bytes >= 16; bytes /= 2)
        for (;;) {
            auto buffer = context.memory().allocate(bytes, vk::MemoryKind::kDevice, "filler");
            if (!buffer.ok()) break;
            taken.push_back(std::move(buffer.value()));
        }
    return taken;
}

/// The first forward pass prepares weights for itself. The second one keeps them until they change,
/// or continues without them if memory or descriptors run out. Its sums are the same.
TEST_P(ExecutorSums, OfForwardPassesStayWhatIsKept) {
    vk::ContextDesc desc = context_desc(GetParam());
    desc.memory.budget_bytes = std::uint64_t{4} << 20;
    desc.memory.block_bytes = std::uint64_t{1} << 20;
    const auto device = make_context(desc);
    ASSERT_NE(device, nullptr);
    Net net(*device);
    ASSERT_OK(net.graph.status());
    auto parameters = nn::Parameters::create(*device, net.graph);
    ASSERT_OK(parameters.status());
    const auto write = [&](const Layer& layer, const std::vector<float>& values) {
        ASSERT_OK(parameters.value().write(*parameters.value().find(layer.weight), values));
    };
    for (const Layer& layer : kLayers) write(layer, weight_of(layer));
    const std::size_t size = std::size_t{kC} * kH * kW;
    const std::vector<float> x = integer_fill(size, 1);
    const ChainRule e = chain_rule(to_double(x), Doubles(size), Doubles(size));
    const bool plain = GetParam() == vk::Kernels::kPlain;
    enum class Lack { kNothing, kMemory, kDescriptors };
    std::vector<Lack> lacks = {Lack::kNothing, Lack::kMemory};
#if SPLAT_FAULT_POINTS
    lacks.push_back(Lack::kDescriptors);
#endif
    for (const Lack lack : lacks) {
        write(kT, weight_of(kT));
        nn::ExecutorDesc wanted;
        wanted.outputs = {net.z, net.t};
        auto made = nn::Executor::create(*device, net.graph, parameters.value(), wanted);
        ASSERT_OK(made.status());
        nn::Executor& executor = *made.value();
        ASSERT_OK(device->write(executor.tensor(net.x), x.data(), x.size() * 4));
        std::vector<vk::Buffer> taken;
        for (int pass = 0; pass < 3; ++pass) {
            if (pass == 1 && lack == Lack::kMemory) taken = take_all(*device);
#if SPLAT_FAULT_POINTS
            if (pass == 1 && lack == Lack::kDescriptors) fault::arm("vk.create_descriptor_pool", 1);
#endif
            const Status ran = executor.forward();
#if SPLAT_FAULT_POINTS
            fault::disarm();
#endif
            ASSERT_OK(ran);
            EXPECT_EQ(executor.memory().prepared > 0, pass > 0 && lack == Lack::kNothing && !plain)
                << pass;
            EXPECT_EQ(numbers(*device, executor.tensor(net.t)), e.t);
            EXPECT_EQ(numbers(*device, executor.tensor(net.z)), e.z);
        }
        std::vector<float> negative = weight_of(kT);
        for (float& value : negative) value = -value;
        write(kT, negative);
        ASSERT_OK(executor.forward());
        Doubles t = e.t;
        for (double& value : t) value = -value;
        EXPECT_EQ(numbers(*device, executor.tensor(net.t)), t);
    }
}

}  // namespace
}  // namespace splat::test
