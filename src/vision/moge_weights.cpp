#include "vision/moge_weights.h"

#include "core/shown.h"

namespace splat::vision {
namespace {

using Needed = std::map<std::string, std::vector<std::int64_t>>;

Needed needed_by(const std::map<std::string, Origin>& origins) {
    Needed needed;
    for (const auto& [name, origin] : origins) {
        needed[origin.tensor] = origin.dims;
        if (!origin.rows_by.empty()) needed[origin.rows_by] = {origin.dims[0]};
    }
    return needed;
}

}  // namespace

Status check_tensors(const io::NamedTensors& tensors, const std::map<std::string, Origin>& origins,
                     const Needed& others) {
    Needed needed = needed_by(origins);
    needed.insert(others.begin(), others.end());
    const std::string* missing = nullptr;
    std::size_t count = 0;
    for (const auto& [name, dims] : needed) {
        const io::NamedTensor* const tensor = tensors.find(name);
        if (tensor == nullptr) {
            if (++count == 1) missing = &name;
            continue;
        }
        if (tensor->dims != dims)
            return damaged("tensor '%s' has the shape %s, expected %s by the other tensors",
                           name.c_str(), io::dims_text(tensor->dims).c_str(),
                           io::dims_text(dims).c_str());
        const Status finite = io::check_finite(*tensor);
        if (!finite.ok()) return damaged("%s", finite.message().c_str());
    }
    if (missing != nullptr)
        return damaged("%zu of the network's %zu tensors are missing, first '%s' %s", count,
                       needed.size(), missing->c_str(), io::dims_text(needed[*missing]).c_str());
    for (const io::NamedTensor& tensor : tensors)
        if (!needed.contains(tensor.name))
            return damaged(
                "tensor '%s' %s is none of the network's, which has %zu; the file has %zu",
                shown(tensor.name).c_str(), io::dims_text(tensor.dims).c_str(), needed.size(),
                tensors.size());
    return {};
}

std::vector<float> values_of(const Origin& origin, const io::NamedTensors& tensors) {
    const io::TensorValues& all = tensors.find(origin.tensor)->values;
    std::vector<float> values;
    const auto number = std::size_t{origin.number};
    switch (origin.form) {
        case Form::kSame:
            values = all;
            break;
        case Form::kThird: {
            const std::size_t third = all.size() / 3;
            values.assign(all.begin() + number * third, all.begin() + (number + 1) * third);
            break;
        }
        case Form::kTransposed: {
            const auto in = static_cast<std::size_t>(origin.dims[0]);
            const std::size_t out = all.size() / in;
            values.resize(all.size());
            for (std::size_t c = 0; c < in; ++c)
                for (std::size_t k = 0; k < out; ++k) values[k * in + c] = all[c * out + k];
            break;
        }
        case Form::kRepeated:
            for (const float value : all) values.insert(values.end(), number, value);
            break;
    }
    if (origin.rows_by.empty()) return values;
    const io::TensorValues& factors = tensors.find(origin.rows_by)->values;
    const std::size_t row = values.size() / factors.size();
    for (std::size_t i = 0; i < values.size(); ++i) values[i] *= factors[i / row];
    return values;
}

}  // namespace splat::vision
