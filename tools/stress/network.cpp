#include "stress/network.h"

#include <cmath>

#include "ref/op_ref.h"
#include "vkrun/cli/text.h"
#include "vkrun/doctor/op_case.h"

namespace vkrun::stress {
namespace {

namespace ref = splat::ref;

std::size_t elements_of(const std::vector<std::size_t>& dims) {
    std::size_t count = 1;
    for (const std::size_t size : dims) count *= size;
    return count;
}

/// F(4x4) may be off twice as far (tests/support/tolerances.h).
double factor_of(const NetNode& node) {
    return node.attributes.value("winograd", 0) == 4 ? 2 : 1;
}

Numbers added(const Numbers& a, const Numbers& b) {
    Numbers sum = a;
    for (std::size_t i = 0; i < b.size(); ++i) sum[i] += b[i];
    return sum;
}

}  // namespace

std::size_t Network::give(const std::string& name, const std::vector<std::size_t>& dims, Role role,
                          double mean, double deviation) {
    tensors.push_back({name, dims, role,
                       filled(name.c_str(), dims, 100 + tensors.size(), mean, deviation).values});
    return tensors.size() - 1;
}

std::vector<std::size_t> Network::add_several(const std::string& op, const Json& attributes,
                                              const std::vector<std::size_t>& inputs,
                                              const std::vector<std::vector<std::size_t>>& dims) {
    NetNode node{op, attributes, inputs, {}};
    for (const std::vector<std::size_t>& shape : dims) {
        tensors.push_back(
            {format("%s%zu", op.c_str(), tensors.size()), shape, Role::kActivation, {}});
        node.outputs.push_back(tensors.size() - 1);
    }
    nodes.push_back(node);
    return node.outputs;
}

std::size_t Network::add(const std::string& op, const Json& attributes,
                         const std::vector<std::size_t>& inputs,
                         const std::vector<std::size_t>& dims) {
    return add_several(op, attributes, inputs, {dims}).front();
}

std::vector<std::size_t> Network::parameters() const {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < tensors.size(); ++i)
        if (tensors[i].role == Role::kParameter) found.push_back(i);
    return found;
}

std::size_t tensor_named(const Network& net, const std::string& name) {
    for (std::size_t i = 0; i < net.tensors.size(); ++i)
        if (net.tensors[i].name == name) return i;
    throw Failure(kFailed, "the network has no tensor '" + name + "'");
}

std::size_t add_conv(Network& net, std::size_t x, std::size_t out, std::size_t kernel,
                     int winograd) {
    const std::vector<std::size_t> dims = net.tensors[x].dims;
    const double deviation =
        1 / std::sqrt(static_cast<double>(dims[1] * kernel * kernel));  // keeps the variance
    const std::string name = format("conv%zu", net.nodes.size());
    const std::size_t weight =
        net.give(name + ".weight", {out, dims[1], kernel, kernel}, Role::kParameter, 0, deviation);
    const std::size_t bias = net.give(name + ".bias", {out}, Role::kParameter, 0, 0.1);
    const std::size_t residual =
        net.give(name + ".residual", {1, out, dims[2], dims[3]}, Role::kConstant, 0, 0);
    return net.add("conv2d", {{"scale", 1}, {"winograd", winograd}}, {x, weight, bias, residual},
                   {dims[0], out, dims[2], dims[3]});
}

std::size_t add_norm(Network& net, std::size_t x, std::size_t groups) {
    const std::vector<std::size_t> dims = net.tensors[x].dims;
    const std::string name = format("norm%zu", net.nodes.size());
    const std::size_t gamma = net.give(name + ".gamma", {dims[1]}, Role::kParameter, 1, 0.1);
    const std::size_t beta = net.give(name + ".beta", {dims[1]}, Role::kParameter, 0, 0.1);
    return net.add("group_norm", {{"groups", groups}, {"eps", 1e-6}, {"silu", true}},
                   {x, gamma, beta}, dims);
}

Network residual_network(const ResidualShape& shape) {
    Network net;
    const std::size_t side = shape.side;
    const std::vector<std::size_t> dims{1, shape.width, side, side};
    const std::size_t x = net.give("x", {1, 4, side, side}, Role::kInput, 0, shape.scale);
    std::size_t at = add_conv(net, x, shape.width, 3, shape.winograd);
    const auto join = [&](std::size_t branch) {
        return net.add("add", {{"scale", std::sqrt(0.5)}}, {at, branch}, dims);
    };
    for (std::size_t i = 0; i < shape.depth; ++i) {
        at = join(add_conv(net, add_norm(net, at, 2), shape.width, 3, shape.winograd));
        if (i != 3) continue;
        const std::size_t qkv = add_conv(net, add_norm(net, at, 2), 3 * shape.width, 1);
        const std::vector<std::size_t> parts =
            net.add_several("split3", Json::object(), {qkv}, {dims, dims, dims});
        at = join(add_conv(net, net.add("attention", {{"heads", 1}}, parts, dims), shape.width, 1));
    }
    const std::size_t y = add_conv(net, add_norm(net, at, 2), 4, 3, shape.winograd);
    net.tensors[y].name = "y";
    const std::size_t target = net.give("target", {1, 4, side, side}, Role::kConstant, 0, 1);
    const std::size_t loss = net.add("l2", Json::object(), {y, target}, {1});
    net.tensors[loss].name = "loss";
    return net;
}

Numbers NetNoise::moved(const ref::Summed<double>& sums, double factor) {
    Numbers numbers = sums.value;
    const double rounding =
        factor * kErrorLimit * kRounding * (1 + std::sqrt(static_cast<double>(sums.terms)));
    for (std::size_t i = 0; i < numbers.size(); ++i)
        numbers[i] += rounding * sums.magnitude[i] * unit();
    return numbers;
}

NetworkInDouble::NetworkInDouble(const Network& net)
    : values(net.tensors.size()),
      gradients(net.tensors.size()),
      net_(net),
      is_read_(net.tensors.size(), false) {
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i].assign(net.tensors[i].values.begin(), net.tensors[i].values.end());
    for (const NetNode& node : net.nodes)
        for (const std::size_t input : node.inputs) is_read_[input] = true;
}

ref::OpArguments NetworkInDouble::arguments_of(const NetNode& node) const {
    ref::OpArguments arguments;
    for (const std::size_t input : node.inputs)
        arguments.inputs.push_back({net_.tensors[input].dims, values[input]});
    arguments.attributes = attributes_of(node.op, node.attributes);
    return arguments;
}

void NetworkInDouble::forward(NetNoise* noise) {
    for (const NetNode& node : net_.nodes) {
        const auto sums = ref::find_op(node.op)->forward(arguments_of(node));
        for (std::size_t i = 0; i < node.outputs.size(); ++i)
            values[node.outputs[i]] =
                noise != nullptr ? noise->moved(sums[i], factor_of(node)) : sums[i].value;
    }
}

void NetworkInDouble::backward(NetNoise* noise) {
    for (std::size_t i = 0; i < gradients.size(); ++i)
        if (is_read_[i]) gradients[i].assign(elements_of(net_.tensors[i].dims), 0);
    for (std::size_t n = net_.nodes.size(); n-- > 0;) {
        const NetNode& node = net_.nodes[n];
        std::vector<Numbers> given;
        for (const std::size_t output : node.outputs) given.push_back(gradients[output]);
        const auto sums = ref::find_op(node.op)->backward(arguments_of(node), given);
        for (std::size_t i = 0; i < node.inputs.size(); ++i)
            if (net_.has_gradient(node.inputs[i]))
                gradients[node.inputs[i]] = added(
                    gradients[node.inputs[i]],
                    noise != nullptr ? noise->moved(sums[i], factor_of(node)) : sums[i].value);
    }
}

}  // namespace vkrun::stress
