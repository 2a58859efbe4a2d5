#include "io/tensor_file.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/checked_math.h"
#include "core/finite.h"
#include "core/shape.h"
#include "core/shown.h"

namespace splat::io {
namespace {

struct TypeRow {
    const char* name;
    std::size_t bytes;
};

/// In the order of NumberType.
constexpr TypeRow kTypeRows[] = {{"float32", 4}, {"float64", 8}, {"float16", 2}, {"bfloat16", 2},
                                 {"int64", 8},   {"int32", 4},   {"int16", 2},   {"int8", 1},
                                 {"uint8", 1},   {"bool", 1}};

constexpr std::uint32_t kSignBit = 0x8000'0000U;

template <class From>
void convert(Bytes bytes, float* values, std::endian order) {
    const std::size_t count = bytes.size() / sizeof(From);
    for (std::size_t i = 0; i < count; ++i)
        values[i] = static_cast<float>(number<From>(bytes.data() + i * sizeof(From), order));
}

/// From 16-bit patterns.
template <class Convert>
void convert16(Bytes bytes, float* values, std::endian order, Convert convert_one) {
    for (std::size_t i = 0; i < bytes.size() / 2; ++i)
        values[i] = convert_one(number<std::uint16_t>(bytes.data() + i * 2, order));
}

}  // namespace

const char* type_name(NumberType type) {
    return kTypeRows[static_cast<std::size_t>(type)].name;
}

std::size_t type_bytes(NumberType type) {
    return kTypeRows[static_cast<std::size_t>(type)].bytes;
}

void to_floats(NumberType type, Bytes bytes, float* values, std::endian order) {
    switch (type) {
        case NumberType::kF32:
            if (order == std::endian::native && !bytes.empty())
                std::memcpy(values, bytes.data(), bytes.size());
            else
                convert<float>(bytes, values, order);
            break;
        case NumberType::kF64:
            convert<double>(bytes, values, order);
            break;
        case NumberType::kF16:
            convert16(bytes, values, order, from_half);
            break;
        case NumberType::kBf16:
            convert16(bytes, values, order, [](std::uint16_t high) {
                return std::bit_cast<float>(std::uint32_t{high} << 16U);
            });
            break;
        case NumberType::kI64:
            convert<std::int64_t>(bytes, values, order);
            break;
        case NumberType::kI32:
            convert<std::int32_t>(bytes, values, order);
            break;
        case NumberType::kI16:
            convert<std::int16_t>(bytes, values, order);
            break;
        case NumberType::kI8:
            convert<std::int8_t>(bytes, values, order);
            break;
        case NumberType::kU8:
            convert<std::uint8_t>(bytes, values, order);
            break;
        case NumberType::kBool:
            for (std::size_t i = 0; i < bytes.size(); ++i)
                values[i] = bytes[i] != std::byte{0} ? 1.0F : 0.0F;
            break;
    }
}

float from_half(std::uint16_t half) {
    const std::uint32_t sign = (half & 0x8000U) << 16U;
    const std::uint32_t exponent = (half >> 10U) & 0x1FU;
    const std::uint32_t fraction = half & 0x3FFU;
    if (exponent == 0) {  // fraction * 2^-24
        const float size = std::ldexp(static_cast<float>(fraction), -24);
        return sign != 0 ? -size : size;
    }
    const std::uint32_t wide = exponent == 31 ? 0xFFU : exponent + 112;
    return std::bit_cast<float>(sign | wide << 23U | fraction << 13U);
}

std::uint16_t to_half(float value) {
    constexpr std::uint32_t kInfinity = 0x7F80'0000U;
    constexpr std::uint32_t kLeastNormal = 113U << 23U;  // 2^-14
    constexpr std::uint32_t kTooLarge = 0x477F'F000U;    // 65520, halfway to what would be 65536
    const auto bits = std::bit_cast<std::uint32_t>(value);
    const std::uint32_t sign = (bits & kSignBit) >> 16U;
    const std::uint32_t size = bits & ~kSignBit;
    std::uint32_t half = 0;
    if (size > kInfinity) {
        half = 0x7E00U;  // NaN
    } else if (size >= kTooLarge) {
        half = 0x7C00U;
    } else if (size < kLeastNormal) {  // adding 0.5 rounds to multiples of 2^-24, ties to even
        half = std::bit_cast<std::uint32_t>(std::bit_cast<float>(size) + 0.5F) -
               std::bit_cast<std::uint32_t>(0.5F);
    } else {
        half = (size + 0xFFFU + ((size >> 13U) & 1U) - (112U << 23U)) >> 13U;
    }
    return static_cast<std::uint16_t>(sign | half);
}

Result<std::uint64_t> count_elements(std::span<const std::int64_t> dims, const std::string& what) {
    if (dims.size() > kMaxRank)
        return error(Code::kInvalidArgument, "'%s' has %zu dimensions, expected at most %u",
                     what.c_str(), dims.size(), kMaxRank);
    std::uint64_t count = 1;
    bool fits = true;
    for (const std::int64_t dim : dims) {
        if (dim < 0)
            return error(Code::kInvalidArgument, "'%s' has the shape %s, expected dimensions >= 0",
                         what.c_str(), dims_text(dims).c_str());
        const auto product = checked_mul(count, static_cast<std::uint64_t>(dim));
        fits = fits && product && *product <= kMaxElements;
        count = fits ? *product : 1;
        if (dim == 0) return 0;
    }
    if (fits) return count;
    return error(Code::kInvalidArgument, "'%s' has the shape %s, more than %llu elements",
                 what.c_str(), dims_text(dims).c_str(),
                 static_cast<unsigned long long>(kMaxElements));
}

std::string dims_text(std::span<const std::int64_t> dims) {
    std::string text = "[";
    for (const std::int64_t dim : dims) text += (text.size() > 1 ? ", " : "") + std::to_string(dim);
    return text + "]";
}

Status NamedTensors::add(NamedTensor tensor) {
    SPLAT_ASSIGN(const std::uint64_t count, count_elements(tensor.dims, tensor.name));
    if (count != tensor.values.size())
        return error(Code::kInvalidArgument, "'%s' has %zu values, its shape %s needs %llu",
                     tensor.name.c_str(), tensor.values.size(), dims_text(tensor.dims).c_str(),
                     static_cast<unsigned long long>(count));
    if (!places_.emplace(tensor.name, tensors_.size()).second)
        return error(Code::kInvalidArgument, "'%s' appears twice", shown(tensor.name).c_str());
    const auto& file = tensor.values.file();
    if (file && std::find(files_.begin(), files_.end(), file) == files_.end())
        files_.push_back(file);
    tensors_.push_back(std::move(tensor));
    return {};
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
    return error(Code::kInvalidArgument,
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
            return error(Code::kInvalidArgument,
                         "'%s' holds %g, and float16 ends at 65504; save it as float32",
                         tensor.name.c_str(), static_cast<double>(value));
        put(to, half);
    }
    return {};
}

}  // namespace splat::io
