#include "vision/moge_weights.h"

#include <array>

#include "core/shown.h"

namespace splat::vision {
namespace {

using Needed = std::map<std::string, std::vector<std::int64_t>>;

Needed needed_by(const std::map<std::string, Origin>& origins) {
    Needed needed;
    for (const auto& [name, origin] : origins) {
        if (origin.sum.empty()) needed[origin.tensor] = origin.dims;
        for (const Product& product : origin.sum)
            for (const Source& source : product) needed[source.name] = source.dims;
        if (!origin.rows_by.empty()) needed[origin.rows_by] = {origin.dims[0]};
    }
    return needed;
}

std::vector<double> product_of(const Product& sources, const io::NamedTensors& tensors) {
    const io::TensorValues& last = tensors.find(sources.back().name)->values;
    std::vector<double> right(last.begin(), last.end());
    for (std::size_t s = sources.size() - 1; s-- > 0;) {
        const io::TensorValues& left = tensors.find(sources[s].name)->values;
        const auto rows = static_cast<std::size_t>(sources[s].dims[0]);
        const std::size_t inner = left.size() / rows, columns = right.size() / inner;
        std::vector<double> product(rows * columns);
        for (std::size_t i = 0; i < rows; ++i)
            for (std::size_t k = 0; k < inner; ++k)
                for (std::size_t j = 0; j < columns; ++j)
                    product[i * columns + j] +=
                        static_cast<double>(left[i * inner + k]) * right[k * columns + j];
        right = std::move(product);
    }
    return right;
}

/// Pixel e of an image of twice the size, counted from the first of the two that pixel i becomes, is the sum of pixels
/// i - 1, i and i + 1 by these factors; see Form::kOfTwice.
constexpr std::array<std::array<double, 3>, 4> kOfPixels = {
    {{0.75, 0.25, 0}, {0.25, 0.75, 0}, {0, 0.75, 0.25}, {0, 0.25, 0.75}}};  // e = -1, 0, 1, 2

std::vector<double> of_twice(const std::vector<double>& weights, std::size_t rows) {
    constexpr std::size_t kTaps = 9;
    const std::size_t in = weights.size() / kTaps / rows;
    std::vector<double> made(4 * weights.size());
    for (std::size_t to = 0; to < made.size(); ++to) {
        const std::size_t tap = to % kTaps, c = to / kTaps % in, row = to / kTaps / in;
        const double* const from = &weights[(row / 4 * in + c) * kTaps];
        for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t s = 0; s < 3; ++s)
                made[to] += from[3 * r + s] * kOfPixels[row / 2 % 2 + r][tap / 3] *
                            kOfPixels[row % 2 + s][tap % 3];
    }
    return made;
}

std::vector<float> sum_of(const Origin& origin, const io::NamedTensors& tensors) {
    std::vector<double> sum = product_of(origin.sum[0], tensors);
    for (std::size_t i = 1; i < origin.sum.size(); ++i) {
        const std::vector<double> more = product_of(origin.sum[i], tensors);
        for (std::size_t j = 0; j < sum.size(); ++j) sum[j] += more[j];
    }
    if (origin.form == Form::kOfTwice)
        sum = of_twice(sum, static_cast<std::size_t>(origin.sum[0][0].dims[0]));
    return {sum.begin(), sum.end()};
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
    if (!origin.sum.empty()) return sum_of(origin, tensors);
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
        case Form::kOfTwice:
            break;  // only sums have it
    }
    if (origin.rows_by.empty()) return values;
    const io::TensorValues& factors = tensors.find(origin.rows_by)->values;
    const std::size_t row = values.size() / factors.size();
    for (std::size_t i = 0; i < values.size(); ++i) values[i] *= factors[i / row];
    return values;
}

}  // namespace splat::vision
