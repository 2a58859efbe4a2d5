#include "ops/op_harness.h"

#include <algorithm>

#include "support/gpu_buffers.h"
#include "support/gradcheck.h"
#include "support/require_vulkan.h"
#include "support/shapes.h"

namespace splat::test {
namespace {

using vk::Buffer;
using vk::BufferView;
using vk::Context;

/// Owns the device memory of one call.
class Tensors {
  public:
    explicit Tensors(Context& context) : context_(context) {}

    BufferView upload(const HostTensor& tensor) {
        if (tensor.values.empty()) return {};
        EXPECT_EQ(tensor.values.size(), tensor.shape.elements());
        buffers_.push_back(test::upload(context_, tensor.values));
        return buffers_.back().view(tensor.shape);
    }

    BufferView fresh(const Shape& shape) {
        buffers_.push_back(device_buffer(context_, shape.elements()));
        return buffers_.back().view(shape);
    }

    /// The elements; fails if the rest of the last quad no longer holds the fresh memory's poison.
    std::vector<float> read(const BufferView& view, const char* name) {
        if (view.block == nullptr) return {};
        const std::size_t elements = view.shape.elements();
        const std::vector<std::uint32_t> words = download_words(context_, view, view.bytes / 4);
        for (std::size_t i = elements; i < words.size(); ++i)
            EXPECT_EQ(words[i], words[elements]) << name << ": padding was written";
        if (elements < words.size()) {
            const bool poison = std::count(std::begin(kPoisonPatterns), std::end(kPoisonPatterns),
                                           words[elements]) > 0;
            EXPECT_TRUE(poison) << name << ": padding holds " << std::hex << words[elements];
        }
        return download(context_, view, elements);
    }

  private:
    Context& context_;
    std::vector<Buffer> buffers_;
};

Status run(Context& context, const OpCall& call, OpResult& result) {
    SPLAT_ASSIGN(const ops::OpRow* row, ops::find_op(call.op));
    Tensors memory(context);
    nn::OpInstance::Tensors tensors;
    std::vector<Shape> shapes;
    for (const HostTensor& input : call.inputs) {
        tensors.inputs.push_back(memory.upload(input));
        shapes.push_back(tensors.inputs.back().shape);
    }
    const vk::Recorder recorder(context);
    SPLAT_ASSIGN(const std::vector<JsonScalar> given,
                 parse_flat_json(call.attributes.dump(), "attributes"));
    SPLAT_ASSIGN(const ops::Attributes attributes, ops::complete_attributes(*row, given));
    SPLAT_ASSIGN(const ops::OpPlan plan, row->plan(recorder, attributes, shapes));
    for (const Shape& shape : plan.outputs) tensors.outputs.push_back(memory.fresh(shape));
    for (const HostTensor& grad : call.grad_outputs)
        tensors.grad_outputs.push_back(memory.upload(grad));
    if (!call.grad_outputs.empty())
        for (std::size_t i = 0; i < call.inputs.size(); ++i) {
            const HostTensor& input = call.inputs[i];
            BufferView view;
            const bool wanted =
                !input.values.empty() && !row->inputs[i].constant &&
                std::count(call.unwanted.begin(), call.unwanted.end(), row->inputs[i].name) == 0;
            if (wanted && !call.accumulate_to.empty())
                view = memory.upload({input.shape, call.accumulate_to[i]});
            else if (wanted)
                view = memory.fresh(input.shape);
            tensors.grad_inputs.push_back(view);
        }
    tensors.accumulate = !call.accumulate_to.empty();

    SPLAT_ASSIGN(const auto op, nn::OpInstance::create(context, *row, given, tensors));
    for (int i = 0; i < call.runs; ++i) {
        SPLAT_TRY(op->forward());
        if (!call.grad_outputs.empty()) SPLAT_TRY(op->backward());
    }
    for (std::size_t i = 0; i < plan.outputs.size(); ++i)
        result.outputs.push_back(memory.read(tensors.outputs[i], row->outputs[i].name));
    for (std::size_t i = 0; i < plan.saved.size(); ++i)
        result.saved.push_back(memory.read(op->saved(i), row->saved[i]));
    for (std::size_t i = 0; i < tensors.grad_inputs.size(); ++i)
        result.grad_inputs.push_back(memory.read(tensors.grad_inputs[i], row->inputs[i].name));
    return context.memory().check_guards();
}

}  // namespace

OpCall sample(const std::string& op, const Json& attributes, const std::vector<HostTensor>& inputs,
              const std::vector<HostTensor>& grad_outputs) {
    OpCall call;
    call.op = op;
    call.attributes = attributes;
    call.inputs = inputs;
    call.grad_outputs = grad_outputs;
    return call;
}

OpCall sample(const std::string& op, const Json& attributes, const std::vector<HostTensor>& inputs,
              const std::vector<Shape>& outputs) {
    std::vector<HostTensor> grads;
    for (const Shape& shape : outputs) grads.push_back(normal_tensor(shape, 90 + grads.size()));
    return sample(op, attributes, inputs, grads);
}

std::vector<OpCall> op_samples() {
    const auto shape_of = [](const ref::Dims& dims) {
        return Shape::create(std::vector<std::int64_t>(dims.begin(), dims.end()), "sample").value();
    };
    std::vector<OpCall> calls;
    for (const ref::OpRef* op : ref::op_refs())
        for (const ref::OpExample& example : op->examples()) {
            std::vector<HostTensor> inputs;
            std::vector<std::vector<float>> values;
            for (const ref::OpInput& input : example.inputs) {
                inputs.push_back({});
                if (!input.dims.empty())
                    inputs.back() = normal_tensor(shape_of(input.dims), inputs.size(), input.mean,
                                                  input.deviation);
                values.push_back(inputs.back().values);
            }
            if (example.change != nullptr) example.change(values);
            for (std::size_t i = 0; i < values.size(); ++i) inputs[i].values = values[i];
            std::vector<Shape> outputs;
            for (const ref::Dims& dims : example.outputs) outputs.push_back(shape_of(dims));
            calls.push_back(sample(op->name, Json::parse(example.attributes), inputs, outputs));
        }
    return calls;
}

OpResult run_op(Context& context, const OpCall& call) {
    OpResult result;
    result.status = run(context, call, result);
    return result;
}

void expect_each_gradient_alone(Context& context, const OpCall& call) {
    const auto row = ops::find_op(call.op);
    ASSERT_OK(row.status());
    const std::span<const ops::Port> ports = row.value()->inputs;
    const OpResult whole = run_op(context, call);
    ASSERT_OK(whole.status);
    for (std::size_t wanted = 0; wanted < ports.size(); ++wanted) {
        OpCall alone = call;
        for (std::size_t i = 0; i < ports.size(); ++i)
            if (i != wanted) alone.unwanted.emplace_back(ports[i].name);
        const OpResult result = run_op(context, alone);
        ASSERT_OK(result.status) << ports[wanted].name;
        for (std::size_t i = 0; i < ports.size(); ++i) {
            const std::vector<float> none;
            const std::vector<float>& expected = i == wanted ? whole.grad_inputs[i] : none;
            const std::string what = std::string("grad_") + ports[i].name + " when only " +
                                     ports[wanted].name + " is wanted";
            EXPECT_TRUE(bit_equal(expected, result.grad_inputs[i], {what, reproduce(call.op)}));
        }
    }
}

void expect_matches(vk::Context& context, const OpCall& call,
                    const std::vector<ref::Summed<double>>& outputs,
                    const std::vector<ref::Summed<double>>& gradients, const std::string& what) {
    const auto row = ops::find_op(call.op);
    ASSERT_OK(row.status());
    OpCall asked = call;
    if (gradients.empty()) asked.grad_outputs.clear();
    const OpResult gpu = run_op(context, asked);
    ASSERT_OK(gpu.status) << what;
    const auto compare = [&](const std::vector<float>& got, const ref::Summed<double>& expected,
                             const std::string& name, bool gradient) {
        if (expected.value.empty()) return;
        EXPECT_TRUE(
            matches(got, expected, tolerance(call.op, name), {name, reproduce(what), gradient}));
    };
    for (std::size_t i = 0; i < outputs.size(); ++i)
        compare(gpu.outputs[i], outputs[i], row.value()->outputs[i].name, false);
    for (std::size_t i = 0; i < gradients.size(); ++i)
        compare(gpu.grad_inputs[i], gradients[i],
                std::string("grad_") + row.value()->inputs[i].name, true);
}

ref::OpArguments arguments_of(const OpCall& call) {
    ref::OpArguments in;
    for (const HostTensor& input : call.inputs) {
        in.inputs.push_back({{}, to_double(input.values)});
        for (std::uint32_t axis = 0; axis < input.shape.rank(); ++axis)
            in.inputs.back().dims.push_back(input.shape[axis]);
    }
    for (const ops::Attribute& of : ops::find_op(call.op).value()->attributes) {
        const Json value =
            call.attributes.contains(of.name) ? call.attributes[of.name] : Json::parse(of.fallback);
        in.attributes[of.name] =
            value.is_boolean() ? (value.get<bool>() ? 1 : 0) : value.get<double>();
    }
    return in;
}

namespace {

ref::Grads grads_of(const OpCall& call) {
    ref::Grads grads;
    for (const HostTensor& grad : call.grad_outputs) grads.push_back(to_double(grad.values));
    return grads;
}

Arrays values_of(const ref::Sums& sums) {
    Arrays values;
    for (const auto& sum : sums) values.push_back(sum.value);
    return values;
}

/// The reference gives every output, and a gradient of each input that has one.
void expect_covers(const OpCall& call, const OpExpected& expected, const std::string& what) {
    const ops::OpRow& row = *ops::find_op(call.op).value();
    EXPECT_EQ(expected.outputs.size(), row.outputs.size()) << what;
    for (std::size_t i = 0; i < row.inputs.size() && !call.grad_outputs.empty(); ++i) {
        if (row.inputs[i].constant || call.inputs[i].values.empty()) continue;
        EXPECT_TRUE(i < expected.grad_inputs.size() && !expected.grad_inputs[i].value.empty())
            << what << ": no reference of grad_" << row.inputs[i].name;
    }
}

}  // namespace

OpExpected expected_of(const OpCall& call) {
    const ref::OpRef& op = *ref::find_op(call.op);
    const ref::OpArguments in = arguments_of(call);
    OpExpected expected{op.forward(in), {}};
    if (call.grad_outputs.empty()) return expected;
    expected.grad_inputs = op.backward(in, grads_of(call));
    for (std::size_t i = 0; i < expected.grad_inputs.size(); ++i)
        if (call.inputs[i].values.empty()) expected.grad_inputs[i] = {};
    return expected;
}

void expect_float64(Context& context, const OpCall& call, const std::string& what) {
    const OpExpected expected = expected_of(call);
    expect_covers(call, expected, what);
    expect_matches(context, call, expected.outputs, expected.grad_inputs, what);
}

OpCall with_integers(OpCall call, std::uint64_t seed) {
    for (auto* tensors : {&call.inputs, &call.grad_outputs})
        for (HostTensor& tensor : *tensors)
            tensor.values = integer_fill(tensor.values.size(), ++seed);
    return call;
}

void expect_exact(Context& context, const OpCall& call, const std::string& what, bool few) {
    const OpResult gpu = run_op(context, call);
    ASSERT_OK(gpu.status) << what;
    const OpExpected expected = expected_of(call);
    expect_covers(call, expected, what);
    const ops::OpRow& row = *ops::find_op(call.op).value();
    for (std::size_t i = 0; i < expected.outputs.size(); ++i)
        EXPECT_TRUE(exact(gpu.outputs[i], expected.outputs[i],
                          {row.outputs[i].name, reproduce(what), false, few}));
    for (std::size_t i = 0; i < expected.grad_inputs.size(); ++i) {
        if (expected.grad_inputs[i].value.empty()) continue;
        EXPECT_TRUE(exact(gpu.grad_inputs[i], expected.grad_inputs[i],
                          {std::string("grad_") + row.inputs[i].name, reproduce(what), true, few}));
    }
}

void expect_adjoint(Context& context, const OpCall& call, std::initializer_list<std::size_t> inputs,
                    const std::string& what) {
    const OpResult gpu = run_op(context, call);
    ASSERT_OK(gpu.status) << what;
    const std::vector<double> y = to_double(gpu.outputs[0]);
    const std::vector<double> grad_y = to_double(call.grad_outputs[0].values);
    double scale = 0;  // magnitude of the sums, which may cancel
    for (std::size_t i = 0; i < y.size(); ++i) scale += std::abs(y[i] * grad_y[i]);
    for (const std::size_t i : inputs)
        EXPECT_NEAR(dot(y, grad_y),
                    dot(to_double(call.inputs[i].values), to_double(gpu.grad_inputs[i])),
                    1e-5 * scale)
            << what << " input " << i;
}

void expect_gradcheck(const OpCall& call) {
    const ref::OpRef& op = *ref::find_op(call.op);
    const ref::OpArguments in = arguments_of(call);
    Arrays inputs;
    for (const ref::OpTensor& input : in.inputs) inputs.push_back(input.values);
    Arrays gradients = values_of(op.backward(in, grads_of(call)));
    gradients.resize(inputs.size());
    expect_gradcheck(
        inputs,
        [&](const Arrays& values) {
            ref::OpArguments changed = in;
            for (std::size_t i = 0; i < values.size(); ++i) changed.inputs[i].values = values[i];
            return values_of(op.forward(changed));
        },
        grads_of(call), gradients);
}

void expect_gradcheck(const Arrays& inputs, const std::function<Arrays(const Arrays&)>& forward,
                      const Arrays& grad_outputs, const Arrays& gradients) {
    ASSERT_EQ(inputs.size(), gradients.size());
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        if (gradients[i].empty()) continue;
        const auto loss = [&](const std::vector<double>& values) {
            Arrays changed = inputs;
            changed[i] = values;
            const Arrays outputs = forward(changed);
            double sum = 0;
            for (std::size_t k = 0; k < outputs.size(); ++k)
                sum += dot(outputs[k], grad_outputs[k]);
            return sum;
        };
        EXPECT_TRUE(gradcheck("input " + std::to_string(i), loss, inputs[i], gradients[i]));
    }
}

std::vector<Shape> image_shapes() {
    std::vector<Shape> shapes = {Shape{1, 9}, Shape{3, 5}, Shape{257, 2}, Shape{5, 3, 9}};
    for (const NormShape& s : kNormShapes) shapes.push_back({s.N, s.C, s.H, s.W});
    return shapes;
}

HostTensor normal_tensor(const Shape& shape, std::uint64_t seed, double mean, double std) {
    return {shape, normal_fill(shape.elements(), seed, mean, std)};
}

HostTensor golden_tensor(const Npz& npz, const std::string& name) {
    const auto found = npz.find(name);
    EXPECT_OK(found.status());
    if (!found.ok()) return {};
    const std::vector<std::int64_t> dims(found.value()->shape.begin(), found.value()->shape.end());
    return {Shape::create(dims, name).value(), found.value()->f32().value()};
}

void KernelsTest::SetUp() {
    const std::vector<vk::Kernels> possible = kernels_to_test();
    ASSERT_FALSE(possible.empty());
    if (std::find(possible.begin(), possible.end(), GetParam()) == possible.end())
        SPLAT_SKIP_FOR_DEVICE("this device's subgroups do not allow "
                              << vk::kernels_name(GetParam()) << " kernels");
    context_ = shared_context(GetParam());
    ASSERT_NE(context_, nullptr);
}

}  // namespace splat::test
