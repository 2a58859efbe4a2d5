#include "second_golden/tape.h"

#include <numeric>
#include <stdexcept>

#include "ref/op_ref.h"

namespace splat::golden {

std::size_t elements_of(const Dims& dims) {
    return std::accumulate(dims.begin(), dims.end(), std::size_t{1}, std::multiplies<>());
}

Tape::Id Tape::add(const Dims& dims, Values values) {
    if (values.size() != elements_of(dims)) throw std::logic_error("values do not fit the shape");
    nodes_.push_back({dims, std::move(values), {}});
    return nodes_.size() - 1;
}

void Tape::accumulate(Id id, const Values& grad) {
    Values& sum = nodes_.at(id).gradient;
    if (grad.size() != sum.size()) throw std::logic_error("a gradient of another size");
    for (std::size_t i = 0; i < grad.size(); ++i) sum[i] += grad[i];
}

Tape::Id Tape::leaf(const Dims& dims, const Values& values) {
    return add(dims, values);
}

std::vector<Tape::Id> Tape::op(const char* name, const std::vector<Id>& inputs,
                               const std::map<std::string, double>& attributes,
                               const std::vector<Dims>& dims) {
    const ref::OpRef* op = ref::find_op(name);
    if (op == nullptr) throw std::logic_error(std::string("no reference of ") + name);
    ref::OpArguments in;
    for (const Id id : inputs)
        in.inputs.push_back(id == kNone ? ref::OpTensor{}
                                        : ref::OpTensor{this->dims(id), values(id)});
    in.attributes = attributes;
    const ref::Sums sums = op->forward(in);
    std::vector<Id> outputs;
    for (std::size_t i = 0; i < dims.size(); ++i) outputs.push_back(add(dims[i], sums.at(i).value));
    steps_.push_back([this, op, in, inputs, outputs] {
        std::vector<Values> grads;
        for (const Id id : outputs) grads.push_back(gradient(id));
        const ref::Sums back = op->backward(in, grads);
        for (std::size_t i = 0; i < inputs.size() && i < back.size(); ++i)
            if (inputs[i] != kNone && !back[i].value.empty()) accumulate(inputs[i], back[i].value);
    });
    return outputs;
}

Tape::Id Tape::sum(Id a, Id b, double factor) {
    Values values = this->values(a);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] += factor * this->values(b).at(i);
    const Id y = add(dims(a), values);
    steps_.push_back([this, a, b, y, factor] {
        accumulate(a, gradient(y));
        Values scaled = gradient(y);
        for (double& value : scaled) value *= factor;
        accumulate(b, scaled);
    });
    return y;
}

Tape::Id Tape::times(Id a, const Values& factors) {
    const auto product = [factors](Values values) {
        for (std::size_t i = 0; i < values.size(); ++i) values[i] *= factors.at(i);
        return values;
    };
    const Id y = add(dims(a), product(values(a)));
    steps_.push_back([this, a, y, product] { accumulate(a, product(gradient(y))); });
    return y;
}

Tape::Id Tape::gathered(Id from, const Dims& dims, const std::vector<std::size_t>& index) {
    Values values;
    for (const std::size_t i : index) values.push_back(this->values(from).at(i));
    const Id y = add(dims, values);
    steps_.push_back([this, from, y, index] {
        Values grad(this->values(from).size(), 0);
        for (std::size_t i = 0; i < index.size(); ++i) grad[index[i]] += gradient(y)[i];
        accumulate(from, grad);
    });
    return y;
}

Tape::Id Tape::reshaped(Id from, const Dims& dims) {
    std::vector<std::size_t> same(values(from).size());
    std::iota(same.begin(), same.end(), 0);
    return gathered(from, dims, same);
}

void Tape::backward(const std::vector<std::pair<Id, Values>>& grads) {
    for (Node& node : nodes_) node.gradient.assign(node.values.size(), 0);
    for (const auto& [id, grad] : grads) accumulate(id, grad);
    for (auto step = steps_.rbegin(); step != steps_.rend(); ++step) (*step)();
}

}  // namespace splat::golden
