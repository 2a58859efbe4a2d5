#include "vkrun/doctor/op_case.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ref/op_ref.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/text.h"

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

/// The row of the library's list.
const Json& library_op(const std::string& name) {
    static const Json ops = library_json(splat_op_list);
    for (const Json& op : ops)
        if (op.at("name") == name) return op;
    throw Failure(kFailed, "no operator '" + name + "'");
}

/// The larger one, or NaN if either is NaN.
double larger(double a, double b) {
    return a > b || std::isnan(a) ? a : b;
}

}  // namespace

CaseTensor filled(const char* name, const std::vector<std::size_t>& dims, std::uint64_t seed,
                  double mean, double deviation) {
    CaseTensor tensor{name, {}, {}};
    std::size_t elements = dims.empty() ? 0 : 1;
    for (const std::size_t size : dims) {
        tensor.dims.push_back(static_cast<std::int64_t>(size));
        elements *= size;
    }
    Normal normal(seed);
    tensor.values.resize(elements);
    for (float& value : tensor.values) value = normal.next(mean, deviation);
    return tensor;
}

OpCase example_case(const std::string& op_name, const ref::OpExample& example) {
    const Json& op = library_op(op_name);
    OpCase made{op_name, example.title, Json::parse(example.attributes), {}, {}, example.plain};
    std::vector<std::vector<float>> values;
    for (const ref::OpInput& input : example.inputs) {
        auto name = op.at("inputs").at(values.size()).get<std::string>();
        if (name.back() == '?') name.pop_back();  // an optional one
        made.inputs.push_back(
            filled(name.c_str(), input.dims, values.size() + 1, input.mean, input.deviation));
        made.inputs.back().constant = input.constant;
        values.push_back(std::move(made.inputs.back().values));
    }
    if (example.change != nullptr) example.change(values);
    for (std::size_t i = 0; i < values.size(); ++i) made.inputs[i].values = std::move(values[i]);
    for (const ref::Dims& dims : example.outputs) {
        const std::size_t i = made.outputs.size();
        const auto name = op.at("outputs").at(i).get<std::string>();
        made.outputs.push_back(filled(name.c_str(), dims, 10 + i, 0, 1));
    }
    if (!made.title.empty()) return made;
    made.title = ref::text_of(example.inputs[0].dims);
    for (const auto& [name, value] : made.attributes.items())
        made.title += " " + name + "=" + value.dump();
    return made;
}

std::map<std::string, double> attributes_of(const std::string& op_name, const Json& given) {
    std::map<std::string, double> attributes;
    for (const Json& attribute : library_op(op_name).at("attributes")) {
        const auto name = attribute.at("name").get<std::string>();
        const Json value = given.contains(name) ? given.at(name) : attribute.at("default");
        attributes[name] = value.is_boolean() ? (value.get<bool>() ? 1 : 0) : value.get<double>();
    }
    return attributes;
}

CaseReference reference_of(const OpCase& op_case) {
    const ref::OpRef* op = ref::find_op(op_case.op);
    if (op == nullptr)
        throw Failure(kFailed, "operator '" + op_case.op + "' has no row in tests/ref");
    ref::OpArguments in;
    for (const CaseTensor& input : op_case.inputs)
        in.inputs.push_back(
            {{input.dims.begin(), input.dims.end()}, {input.values.begin(), input.values.end()}});
    in.attributes = attributes_of(op_case.op, op_case.attributes);
    std::vector<ref::Values> grads;
    for (const CaseTensor& output : op_case.outputs)
        grads.emplace_back(output.values.begin(), output.values.end());
    CaseReference result;
    for (ref::Summed<double>& sums : op->forward(in)) result.outputs.emplace_back(std::move(sums));
    for (ref::Summed<double>& sums : op->backward(in, grads))
        result.grad_inputs.emplace_back(std::move(sums));
    return result;
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
