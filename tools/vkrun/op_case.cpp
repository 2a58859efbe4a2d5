#include "vkrun/op_case.h"

#include <cmath>
#include <numbers>

#include "ref/attention_ref.h"
#include "ref/gaussian_head_ref.h"
#include "ref/group_norm_ref.h"
#include "ref/linear_ref.h"
#include "ref/losses/l1_ref.h"
#include "ref/losses/l2_ref.h"
#include "ref/losses/ssim_ref.h"
#include "vkrun/conv2d_samples.h"
#include "vkrun/table.h"

namespace vkrun {
namespace {

namespace ref = splat::ref;

/// SplitMix64 and the Box-Muller transform: the same values on every machine.
class Normal {
  public:
    explicit Normal(std::uint64_t seed) : state_(seed) {}
    float next(double mean, double deviation) {
        const double radius = std::sqrt(-2 * std::log(uniform()));
        const double normal = radius * std::cos(2 * std::numbers::pi * uniform());
        return static_cast<float>(mean + deviation * normal);
    }

  private:
    double uniform() {
        state_ += 0x9E3779B97F4A7C15ULL;
        std::uint64_t z = state_;
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
        z ^= z >> 31;
        return (static_cast<double>(z >> 11) + 0.5) * 0x1p-53;
    }
    std::uint64_t state_;
};

CaseTensor filled(const char* name, const std::vector<std::size_t>& dims, std::uint64_t seed,
                  double mean, double deviation) {
    CaseTensor tensor{name, {}, {}};
    std::size_t elements = 1;
    for (const std::size_t size : dims) {
        tensor.dims.push_back(static_cast<std::int64_t>(size));
        elements *= size;
    }
    Normal normal(seed);
    tensor.values.resize(elements);
    for (float& value : tensor.values) value = normal.next(mean, deviation);
    return tensor;
}

std::vector<double> to_double(const std::vector<float>& values) {
    return {values.begin(), values.end()};
}

std::size_t dim(const CaseTensor& tensor, std::size_t axis) {
    return static_cast<std::size_t>(tensor.dims[axis]);
}

CaseReference group_norm_reference(const OpCase& op_case) {
    const CaseTensor& x = op_case.inputs[0];
    ref::GroupNormInput<double> input;
    input.shape = {.N = dim(x, 0),
                   .C = dim(x, 1),
                   .pixels = dim(x, 2) * dim(x, 3),
                   .G = op_case.attributes["groups"].get<std::size_t>()};
    // The library holds eps as a float.
    input.eps = static_cast<double>(op_case.attributes["eps"].get<float>());
    input.silu = op_case.attributes["silu"].get<bool>();
    input.x = to_double(x.values);
    input.gamma = to_double(op_case.inputs[1].values);
    input.beta = to_double(op_case.inputs[2].values);
    CaseReference result;
    result.outputs.emplace_back(std::move(ref::group_norm_forward(input).y));
    auto gradients = ref::group_norm_backward(input, to_double(op_case.outputs[0].values));
    result.grad_inputs.push_back(std::move(gradients.grad_x));
    result.grad_inputs.push_back(std::move(gradients.grad_gamma));
    result.grad_inputs.push_back(std::move(gradients.grad_beta));
    return result;
}

CaseReference linear_reference(const OpCase& op_case) {
    ref::LinearInput<double> input;
    input.shape = {.rows = dim(op_case.inputs[0], 0),
                   .in = dim(op_case.inputs[0], 1),
                   .out = dim(op_case.inputs[1], 0)};
    input.x = to_double(op_case.inputs[0].values);
    input.weight = to_double(op_case.inputs[1].values);
    input.bias = to_double(op_case.inputs[2].values);
    CaseReference result;
    result.outputs.emplace_back(ref::linear_forward(input));
    auto gradients = ref::linear_backward(input, to_double(op_case.outputs[0].values));
    result.grad_inputs.push_back(std::move(gradients.grad_x));
    result.grad_inputs.push_back(std::move(gradients.grad_weight));
    result.grad_inputs.push_back(std::move(gradients.grad_bias));
    return result;
}

CaseReference attention_reference(const OpCase& op_case) {
    ref::AttentionInput<double> input;
    input.n = dim(op_case.inputs[0], 0);
    input.c = dim(op_case.inputs[0], 1);
    input.queries = input.keys = dim(op_case.inputs[0], 2) * dim(op_case.inputs[0], 3);
    input.q = to_double(op_case.inputs[0].values);
    input.k = to_double(op_case.inputs[1].values);
    input.v = to_double(op_case.inputs[2].values);
    CaseReference result;
    result.outputs.emplace_back(ref::attention_forward(input));
    auto gradients = ref::attention_backward(input, to_double(op_case.outputs[0].values));
    result.grad_inputs.push_back(std::move(gradients.grad_q));
    result.grad_inputs.push_back(std::move(gradients.grad_k));
    result.grad_inputs.push_back(std::move(gradients.grad_v));
    return result;
}

CaseReference loss_reference(const OpCase& op_case) {
    const std::vector<double> a = to_double(op_case.inputs[0].values);
    const std::vector<double> b = to_double(op_case.inputs[1].values);
    const auto grad_loss = static_cast<double>(op_case.outputs[0].values[0]);
    CaseReference result;
    if (op_case.op == "ssim") {
        const CaseTensor& image = op_case.inputs[0];
        ref::SsimInput in;
        in.planes = dim(image, 0) * dim(image, 1);
        in.height = dim(image, 2);
        in.width = dim(image, 3);
        in.a = a;
        in.b = b;
        result.outputs.emplace_back(ref::summed(ref::ssim_forward<ref::Rounded>(in), in.a.size()));
        result.grad_inputs.emplace_back(
            ref::summed(ref::ssim_backward<ref::Rounded>(in, grad_loss), ref::kSsimTerms));
    } else if (op_case.op == "l1") {
        result.outputs.emplace_back(ref::l1_forward(a, b));
        result.grad_inputs.emplace_back(ref::l1_backward(a, b, grad_loss));
    } else {
        result.outputs.emplace_back(ref::l2_forward(a, b));
        result.grad_inputs.emplace_back(ref::l2_backward(a, b, grad_loss));
    }
    result.grad_inputs.emplace_back();  // the target
    return result;
}

CaseReference head_reference(const OpCase& op_case) {
    ref::GaussianHeadInput in;
    in.shape.images = dim(op_case.inputs[0], 0);
    in.shape.pixels = dim(op_case.inputs[0], 2) * dim(op_case.inputs[0], 3);
    in.net_out = to_double(op_case.inputs[0].values);
    in.rays = to_double(op_case.inputs[1].values);
    in.view_to_world = to_double(op_case.inputs[2].values);
    in.quaternion = to_double(op_case.inputs[3].values);
    // The library holds these as floats.
    in.shape.znear = static_cast<double>(op_case.attributes["znear"].get<float>());
    in.shape.zfar = static_cast<double>(op_case.attributes["zfar"].get<float>());
    ref::GaussianHeadOutputs<double> grads;
    for (std::size_t i = 0; i < grads.size(); ++i) grads[i] = to_double(op_case.outputs[i].values);
    CaseReference result;
    for (const auto& values : ref::gaussian_head_forward<ref::Rounded>(in))
        result.outputs.emplace_back(ref::summed(values));
    result.grad_inputs.emplace_back(
        ref::summed(ref::gaussian_head_backward<ref::Rounded>(in, grads)));
    result.grad_inputs.resize(op_case.inputs.size());  // cameras have none
    return result;
}

/// The larger one, or NaN if one of them is NaN.
double larger(double a, double b) {
    return a > b || std::isnan(a) ? a : b;
}

}  // namespace

OpCase group_norm_case(std::size_t N, std::size_t C, std::size_t H, std::size_t W,
                       std::size_t groups, bool silu) {
    OpCase result;
    result.op = "group_norm";
    result.title = format("[%zu,%zu,%zu,%zu] G=%zu%s", N, C, H, W, groups, silu ? " silu" : "");
    result.attributes["groups"] = groups;
    result.attributes["eps"] = 1e-6;
    result.attributes["silu"] = silu;
    result.inputs = {filled("x", {N, C, H, W}, 1, 0.5, 1), filled("gamma", {C}, 2, 1, 0.25),
                     filled("beta", {C}, 3, 0, 0.25)};
    result.outputs = {filled("y", {N, C, H, W}, 4, 0, 1)};
    return result;
}

OpCase conv2d_case(std::size_t in, std::size_t size, std::size_t out, int winograd, bool plain) {
    OpCase result;
    result.op = "conv2d";
    result.title = format("[1,%zu,%zu,%zu] -> %zu%s", in, size, size, out,
                          winograd == 0   ? ""
                          : winograd == 2 ? " F(2x2)"
                                          : " F(4x4)");
    result.attributes["scale"] = 1;
    result.attributes["winograd"] = winograd;
    const double deviation = 1 / std::sqrt(9 * static_cast<double>(in));  // y is of order 1
    result.inputs = {filled("x", {1, in, size, size}, 1, 0, 1),
                     filled("weight", {out, in, 3, 3}, 2, 0, deviation),
                     filled("bias", {out}, 3, 0, 0.25),
                     filled("residual", {1, out, size, size}, 4, 0, 1)};
    result.outputs = {filled("y", {1, out, size, size}, 5, 0, 1)};
    result.plain = plain;
    return result;
}

OpCase linear_case(std::size_t rows, std::size_t in, std::size_t out) {
    OpCase result;
    result.op = "linear";
    result.title = format("%zu x %zu->%zu", rows, in, out);
    result.attributes = Json::object();
    const double deviation = 1 / std::sqrt(static_cast<double>(in));  // y is of order 1
    result.inputs = {filled("x", {rows, in}, 1, 0, 1), filled("weight", {out, in}, 2, 0, deviation),
                     filled("bias", {out}, 3, 0, 0.25)};
    result.outputs = {filled("y", {rows, out}, 4, 0, 1)};
    return result;
}

OpCase attention_case(std::size_t N, std::size_t C, std::size_t H, std::size_t W) {
    OpCase result;
    result.op = "attention";
    result.title = format("[%zu,%zu,%zu,%zu]", N, C, H, W);
    result.attributes["heads"] = 1;
    result.inputs = {filled("q", {N, C, H, W}, 1, 0, 1), filled("k", {N, C, H, W}, 2, 0, 1),
                     filled("v", {N, C, H, W}, 3, 0, 1)};
    result.outputs = {filled("y", {N, C, H, W}, 4, 0, 1)};
    return result;
}

OpCase loss_case(const char* op, std::size_t N, std::size_t H, std::size_t W) {
    OpCase result;
    result.op = op;
    result.title = format("[%zu,3,%zu,%zu]", N, H, W);
    result.attributes = Json::object();
    result.inputs = {filled("a", {N, 3, H, W}, 1, 0.5, 0.25),
                     filled("b", {N, 3, H, W}, 2, 0.5, 0.25)};
    result.inputs[1].constant = true;
    result.outputs = {filled("loss", {1}, 3, 1, 0.1)};
    return result;
}

OpCase gaussian_head_case(std::size_t N, std::size_t H, std::size_t W) {
    OpCase result;
    result.op = "gaussian_head";
    result.title = format("[%zu,24,%zu,%zu]", N, H, W);
    result.attributes["views"] = 1;
    result.attributes["znear"] = 0.8;
    result.attributes["zfar"] = 1.8;
    result.attributes["sh_degree"] = 1;
    result.inputs = {filled("net_out", {N, 24, H, W}, 1, 0, 1), filled("rays", {3, H, W}, 2, 0, 1),
                     filled("view_to_world", {N, 4, 4}, 3, 0, 0.5),
                     filled("quaternion", {N, 4}, 4, 0.5, 0.25)};
    for (const char* absent : {"focal", "origin"}) result.inputs.push_back({absent, {}, {}});
    // The last column of a pose gives w = 1.
    std::vector<float>& poses = result.inputs[2].values;
    for (std::size_t i = 3; i < poses.size(); i += 4) poses[i] = i % 16 == 15 ? 1.0F : 0.0F;
    for (std::size_t i = 1; i < result.inputs.size(); ++i) result.inputs[i].constant = true;
    const std::size_t M = H * W;
    result.outputs = {filled("means", {N, M, 3}, 5, 0, 1), filled("opacities", {N, M, 1}, 6, 0, 1),
                      filled("scales", {N, M, 3}, 7, 0, 1), filled("rotations", {N, M, 4}, 8, 0, 1),
                      filled("sh", {N, M, 4, 3}, 9, 0, 1)};
    return result;
}

CaseReference reference_of(const OpCase& op_case) {
    if (op_case.op == "conv2d") return conv2d_samples(op_case);
    if (op_case.op == "linear") return linear_reference(op_case);
    if (op_case.op == "gaussian_head") return head_reference(op_case);
    if (op_case.op == "attention") return attention_reference(op_case);
    return op_case.op == "group_norm" ? group_norm_reference(op_case) : loss_reference(op_case);
}

CaseOnDevice::CaseOnDevice(splat_device device, const OpCase& op_case) {
    std::vector<splat_tensor> inputs;
    std::vector<splat_tensor> grad_inputs;
    for (const CaseTensor& input : op_case.inputs) {
        inputs_.push_back(input.dims.empty()
                              ? Tensor()
                              : make_tensor(device, input.name, input.dims, input.values));
        grad_inputs_.push_back(
            input.constant ? Tensor() : make_tensor(device, "grad_" + input.name, input.dims, {}));
        inputs.push_back(inputs_.back().get());
        grad_inputs.push_back(grad_inputs_.back().get());
    }
    std::vector<splat_tensor> outputs;
    std::vector<splat_tensor> grad_outputs;
    for (const CaseTensor& output : op_case.outputs) {
        outputs_.push_back(make_tensor(device, output.name, output.dims, {}));
        grad_outputs_.push_back(
            make_tensor(device, "grad_" + output.name, output.dims, output.values));
        outputs.push_back(outputs_.back().get());
        grad_outputs.push_back(grad_outputs_.back().get());
    }
    const std::string attributes = op_case.attributes.dump();
    auto desc = sized<splat_op_desc>();
    desc.type = op_case.op.c_str();
    desc.attributes = attributes.c_str();
    desc.input_count = static_cast<std::uint32_t>(inputs.size());
    desc.output_count = static_cast<std::uint32_t>(outputs.size());
    desc.inputs = inputs.data();
    desc.outputs = outputs.data();
    desc.grad_outputs = grad_outputs.data();
    desc.grad_inputs = grad_inputs.data();
    check(splat_op_create(device, &desc, op_.out()));
}

void CaseOnDevice::forward() {
    check(splat_op_forward(op_.get()));
}

void CaseOnDevice::backward() {
    check(splat_op_backward(op_.get()));
}

TensorError compare(const std::string& name, const std::vector<float>& gpu,
                    const Samples& samples) {
    const ref::Summed<double>& reference = samples.sums;
    TensorError error{.tensor = name};
    const double rounding = 0x1p-24 * (1 + std::sqrt(static_cast<double>(reference.terms)));
    double sum = 0;
    double reference_sum = 0;
    for (std::size_t i = 0; i < reference.value.size(); ++i) {
        const float got = gpu[samples.elements.empty() ? i : samples.elements[i]];
        const double difference = std::abs(static_cast<double>(got) - reference.value[i]);
        sum += difference * difference;
        reference_sum += reference.value[i] * reference.value[i];
        error.max_abs = larger(error.max_abs, difference);
        const double unit =
            rounding * reference.magnitude[i] + 1e-37;  // float32's smallest numbers
        error.max_roundings = larger(error.max_roundings, difference / unit);
    }
    error.relative_l2 = std::sqrt(sum / std::max(reference_sum, 1e-300));
    return error;
}

std::vector<TensorError> forward_errors(const OpCase& op_case, const CaseOnDevice& run,
                                        const CaseReference& reference) {
    std::vector<TensorError> errors;
    for (std::size_t i = 0; i < op_case.outputs.size(); ++i)
        errors.push_back(compare(op_case.outputs[i].name, run.output(i), reference.outputs[i]));
    return errors;
}

std::vector<TensorError> backward_errors(const OpCase& op_case, const CaseOnDevice& run,
                                         const CaseReference& reference) {
    std::vector<TensorError> errors;
    for (std::size_t i = 0; i < op_case.inputs.size(); ++i)
        if (!op_case.inputs[i].constant)
            errors.push_back(compare("grad_" + op_case.inputs[i].name, run.grad_input(i),
                                     reference.grad_inputs[i]));
    return errors;
}

TensorError worst(const std::vector<TensorError>& errors) {
    TensorError most;
    for (const TensorError& error : errors) {
        most.relative_l2 = larger(most.relative_l2, error.relative_l2);
        most.max_abs = larger(most.max_abs, error.max_abs);
        most.max_roundings = larger(most.max_roundings, error.max_roundings);
    }
    return most;
}

bool good(const std::vector<TensorError>& errors) {
    return worst(errors).max_roundings <= kErrorLimit;  // false for NaN
}

}  // namespace vkrun
