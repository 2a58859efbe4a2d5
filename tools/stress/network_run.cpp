#include "stress/network_run.h"

#include <algorithm>

namespace vkrun::stress {
namespace {

std::vector<std::int64_t> signed_dims(const std::vector<std::size_t>& dims) {
    return {dims.begin(), dims.end()};
}

Op make_op(splat_device device, const std::string& type, const Json& attributes,
           const std::vector<splat_tensor>& inputs, const std::vector<splat_tensor>& outputs,
           const std::vector<splat_tensor>& grad_outputs,
           const std::vector<splat_tensor>& grad_inputs) {
    const std::string text = attributes.dump();
    auto desc = sized<splat_op_desc>();
    desc.type = type.c_str();
    desc.attributes = text.c_str();
    desc.input_count = static_cast<std::uint32_t>(inputs.size());
    desc.output_count = static_cast<std::uint32_t>(outputs.size());
    desc.inputs = inputs.data();
    desc.outputs = outputs.data();
    desc.grad_outputs = grad_outputs.empty() ? nullptr : grad_outputs.data();
    desc.grad_inputs = grad_inputs.empty() ? nullptr : grad_inputs.data();
    Op op;
    check(splat_op_create(device, &desc, op.out()));
    return op;
}

void write(splat_tensor tensor, const std::vector<float>& values) {
    check(splat_tensor_write(tensor, values.data(), values.size() * sizeof(float), nullptr));
}

}  // namespace

NetworkOnDevice::NetworkOnDevice(splat_device device, const Network& net) {
    const auto make = [&](const NetTensor& tensor, const std::vector<float>& values) {
        return make_tensor(device, tensor.name, signed_dims(tensor.dims), values);
    };
    std::vector<std::vector<splat_tensor>> readers(net.tensors.size());
    for (const NetTensor& tensor : net.tensors) {
        if (tensor.dims.empty()) {  // an optional input that is absent
            values_.emplace_back();
            gradients_.emplace_back();
            continue;
        }
        values_.push_back(make(tensor, tensor.values));
        std::size_t count = 1;
        for (const std::size_t size : tensor.dims) count *= size;
        gradients_.push_back(make(tensor, std::vector<float>(count, 1)));
    }
    std::vector<std::size_t> uses(net.tensors.size());
    for (const NetNode& node : net.nodes)
        for (const std::size_t input : node.inputs) ++uses[input];
    for (const NetNode& node : net.nodes) {
        std::vector<splat_tensor> inputs, outputs, grad_outputs, grad_inputs;
        for (const std::size_t input : node.inputs) {
            inputs.push_back(values_[input].get());
            splat_tensor gradient = nullptr;
            if (net.has_gradient(input)) {
                gradient = gradients_[input].get();
                if (uses[input] > 1) {
                    parts_.push_back(make(net.tensors[input], {}));
                    gradient = parts_.back().get();
                }
                readers[input].push_back(gradient);
            }
            grad_inputs.push_back(gradient);
        }
        for (const std::size_t output : node.outputs) {
            outputs.push_back(values_[output].get());
            grad_outputs.push_back(gradients_[output].get());
        }
        nodes_.push_back(
            make_op(device, node.op, node.attributes, inputs, outputs, grad_outputs, grad_inputs));
    }
    for (const NetNode& node : net.nodes) {
        sums_.emplace_back();
        for (const std::size_t output : node.outputs) {
            const std::vector<splat_tensor>& parts = readers[output];
            if (parts.size() < 2) continue;
            if (parts.size() > 2)
                throw Failure(kFailed, "an activation of a stress network has three readers");
            sums_.back().push_back(
                make_op(device, "add", {{"scale", 1}}, parts, {gradients_[output].get()}, {}, {}));
        }
    }
}

void NetworkOnDevice::set_value(std::size_t tensor, const std::vector<float>& values) {
    write(values_[tensor].get(), values);
}

void NetworkOnDevice::set_gradient(std::size_t tensor, const std::vector<float>& values) {
    write(gradients_[tensor].get(), values);
}

void NetworkOnDevice::forward() {
    for (const Op& node : nodes_) check(splat_op_forward(node.get()));
}

void NetworkOnDevice::backward() {
    for (std::size_t n = nodes_.size(); n-- > 0;) {
        for (const Op& sum : sums_[n]) check(splat_op_forward(sum.get()));
        check(splat_op_backward(nodes_[n].get()));
    }
}

}  // namespace vkrun::stress
