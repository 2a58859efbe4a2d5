#include "io/number_type.h"

namespace splat::io {
namespace {

constexpr std::uint32_t kSignBit = 0x8000'0000U;

template <class From>
float as_float(From number) {
    return static_cast<float>(number);
}

float from_bfloat16(std::uint16_t high) {
    return std::bit_cast<float>(std::uint32_t{high} << 16U);
}

float from_bool(std::uint8_t byte) {
    return byte != 0 ? 1.0F : 0.0F;
}

template <class From, float (*kAsFloat)(From) = as_float<From>>
void convert_all(Bytes bytes, float* values, std::endian order) {
    for (std::size_t i = 0; i < bytes.size() / sizeof(From); ++i)
        values[i] = kAsFloat(number<From>(bytes.data() + i * sizeof(From), order));
}

template <class From>
double as_double(const std::byte* at, std::endian order) {
    return static_cast<double>(number<From>(at, order));
}

template <class From, float (*kAsFloat)(From)>
double widened(const std::byte* at, std::endian order) {
    return static_cast<double>(kAsFloat(number<From>(at, order)));
}

template <class From>
constexpr NumberTypeRow plain_row(const char* name, const char* safetensors, const char* npy) {
    return {name, sizeof(From), safetensors, npy, convert_all<From>, as_double<From>};
}

template <class From, float (*kAsFloat)(From)>
constexpr NumberTypeRow packed_row(const char* name, const char* safetensors, const char* npy) {
    return {
        name, sizeof(From), safetensors, npy, convert_all<From, kAsFloat>, widened<From, kAsFloat>};
}

/// In the order of NumberType.
constexpr NumberTypeRow kNumberTypes[] = {
    plain_row<float>("float32", "F32", "f4"),
    plain_row<double>("float64", "F64", "f8"),
    packed_row<std::uint16_t, from_half>("float16", "F16", "f2"),
    packed_row<std::uint16_t, from_bfloat16>("bfloat16", "BF16", nullptr),
    plain_row<std::int64_t>("int64", "I64", "i8"),
    plain_row<std::int32_t>("int32", "I32", "i4"),
    plain_row<std::int16_t>("int16", "I16", "i2"),
    plain_row<std::int8_t>("int8", "I8", "i1"),
    plain_row<std::uint8_t>("uint8", "U8", "u1"),
    packed_row<std::uint8_t, from_bool>("bool", "BOOL", "b1"),
    plain_row<std::uint16_t>("uint16", "U16", "u2"),
    plain_row<std::uint32_t>("uint32", "U32", "u4"),
    plain_row<std::uint64_t>("uint64", "U64", "u8")};
static_assert(std::size(kNumberTypes) == static_cast<std::size_t>(NumberType::kU64) + 1);

}  // namespace

const NumberTypeRow& number_type_row(NumberType type) {
    return kNumberTypes[static_cast<std::size_t>(type)];
}

std::optional<NumberType> find_number_type(const char* NumberTypeRow::*column,
                                           std::string_view name) {
    for (std::size_t i = 0; i < std::size(kNumberTypes); ++i) {
        const char* const known = kNumberTypes[i].*column;
        if (known != nullptr && name == known) return static_cast<NumberType>(i);
    }
    return std::nullopt;
}

void to_floats(NumberType type, Bytes bytes, float* values, std::endian order) {
    if (type != NumberType::kF32 || order != std::endian::native)
        number_type_row(type).to_floats(bytes, values, order);
    else if (!bytes.empty())
        std::memcpy(values, bytes.data(), bytes.size());
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

}  // namespace splat::io
