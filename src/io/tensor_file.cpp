#include "io/tensor_file.h"

#include <cmath>
#include <numeric>

#include "core/checked_math.h"
#include "core/finite.h"
#include "core/shape.h"
#include "core/shown.h"
#include "io/compress.h"

namespace splat::io {

Result<std::uint64_t> count_elements(std::span<const std::int64_t> dims, const std::string& what) {
    if (dims.size() > kMaxRank)
        return invalid("'%s' has %zu dimensions, expected at most %u", what.c_str(), dims.size(),
                       kMaxRank);
    std::uint64_t count = 1;
    bool fits = true;
    for (const std::int64_t dim : dims) {
        if (dim < 0)
            return invalid("'%s' has the shape %s, expected dimensions >= 0", what.c_str(),
                           dims_text(dims).c_str());
        const auto product = checked_mul(count, static_cast<std::uint64_t>(dim));
        fits = fits && product && *product <= kMaxElements;
        count = fits ? *product : 1;
        if (dim == 0) return 0;
    }
    if (fits) return count;
    return invalid("'%s' has the shape %s, more than %llu elements", what.c_str(),
                   dims_text(dims).c_str(), llu(kMaxElements));
}

std::string dims_text(std::span<const std::int64_t> dims) {
    return "[" + joined(dims, [](std::int64_t dim) { return std::to_string(dim); }) + "]";
}

Status NamedTensors::add(NamedTensor tensor) {
    SPLAT_ASSIGN(const std::uint64_t count, count_elements(tensor.dims, tensor.name));
    if (count != tensor.values.size())
        return invalid("'%s' has %zu values, its shape %s needs %llu", tensor.name.c_str(),
                       tensor.values.size(), dims_text(tensor.dims).c_str(), llu(count));
    if (!places_.emplace(tensor.name, tensors_.size()).second)
        return invalid("'%s' appears twice", shown(tensor.name).c_str());
    const auto& file = tensor.values.file();
    if (file && std::ranges::find(files_, file) == files_.end()) files_.push_back(file);
    tensors_.push_back(std::move(tensor));
    return {};
}

bool NamedTensors::drop_start(std::string_view start) {
    const auto begins = [&](const NamedTensor& tensor) {
        return tensor.name.size() > start.size() && tensor.name.starts_with(start);
    };
    if (tensors_.empty() || !std::ranges::all_of(tensors_, begins)) return false;
    places_.clear();
    for (std::size_t i = 0; i < tensors_.size(); ++i) {
        tensors_[i].name.erase(0, start.size());
        places_.emplace(tensors_[i].name, i);
    }
    return true;
}

const NamedTensor* NamedTensors::find(const std::string& name) const {
    const auto place = places_.find(name);
    return place == places_.end() ? nullptr : &tensors_[place->second];
}

Status NamedTensors::unchanged() const {
    for (const auto& file : files_) SPLAT_TRY(file->unchanged());
    return {};
}

std::uint64_t NamedTensors::elements() const {
    return std::accumulate(
        tensors_.begin(), tensors_.end(), std::uint64_t{0},
        [](std::uint64_t sum, const NamedTensor& tensor) { return sum + tensor.values.size(); });
}

Status check_finite(const NamedTensor& tensor) {
    const std::size_t bad = find_not_finite(tensor.values);
    if (bad == tensor.values.size()) return {};
    return invalid(
        "'%s' holds %f at element %zu, expected finite weights; the training that wrote "
        "them failed, or the file is damaged",
        tensor.name.c_str(), static_cast<double>(tensor.values[bad]), bad);
}

Status check_finite(const NamedTensors& tensors) {
    for (const NamedTensor& tensor : tensors) SPLAT_TRY(check_finite(tensor));
    return {};
}

Status put_halves(Buffer& to, const NamedTensor& tensor) {
    to.reserve(to.size() + tensor.values.size() * 2);
    for (const float value : tensor.values) {
        const std::uint16_t half = to_half(value);
        if ((half & 0x7FFFU) == 0x7C00U && std::isfinite(value))
            return invalid("'%s' holds %g, and float16 ends at 65504; save it as float32",
                           tensor.name.c_str(), static_cast<double>(value));
        put(to, half);
    }
    return {};
}

std::uint32_t crc32_of(const NamedTensors& tensors) {
    std::uint32_t sum = 0;
    for (const NamedTensor& tensor : tensors) {
        sum = crc32_of(as_bytes(tensor.name), sum);
        sum = crc32_of(std::as_bytes(std::span(tensor.values)), sum);
    }
    return sum;
}

}  // namespace splat::io
