#include "model/init.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "core/hash.h"

namespace splat::model {
namespace {

std::uint64_t hash_of(const std::string& name) {
    Hash hash;
    hash.add(name);
    return hash.value();
}

class Uniform {
  public:
    explicit Uniform(std::uint64_t seed) : engine_(seed) {}

    /// In [-bound, bound); the same numbers with every standard library, unlike its distributions.
    float next(double bound) {
        const double unit = static_cast<double>(engine_() >> 11) * 0x1p-53;
        return static_cast<float>(bound * (2 * unit - 1));
    }

  private:
    std::mt19937_64 engine_;
};

double xavier_bound(double gain, double fan_in, double fan_out) {
    return gain * std::sqrt(6 / (fan_in + fan_out));
}

}  // namespace

std::vector<float> initial_values(const config::ModelConfig& config, const Init& init,
                                  const std::string& name, const Shape& shape, std::uint64_t seed) {
    std::vector<float> values(shape.elements(), 0.0F);
    Uniform uniform(seed ^ hash_of(name));
    const std::uint32_t rows = shape[0];
    const double columns = static_cast<double>(shape.elements()) / rows;
    switch (init.kind) {
        case Init::Kind::kConstant:
            values.assign(values.size(), init.scale);
            break;
        case Init::Kind::kXavierUniform: {  // both fans count the taps of a convolution
            const double taps = shape.rank() == 4 ? shape[2] * shape[3] : 1;
            const double bound =
                xavier_bound(static_cast<double>(init.scale), columns, rows * taps);
            for (float& value : values) value = uniform.next(bound);
            break;
        }
        case Init::Kind::kUniformColumns:
            for (float& value : values) value = uniform.next(1 / std::sqrt(columns));
            break;
        case Init::Kind::kFilmBias:
            for (std::size_t i = 0; i < values.size() / 2; ++i) values[i] = 1;
            break;
        case Init::Kind::kHeadWeight:
        case Init::Kind::kHeadBias: {
            const HeadLayout head = config.head();
            const bool weight = init.kind == Init::Kind::kHeadWeight;
            std::size_t at = 0;
            for (std::uint32_t each = 0; each < head.per_pixel; ++each)
                for (const HeadBlock& block : head.blocks) {
                    const double bound =
                        xavier_bound(static_cast<double>(block.gain), columns, block.channels);
                    const auto count =
                        static_cast<std::size_t>(weight ? columns : 1) * block.channels;
                    for (std::size_t i = 0; i < count; ++i)
                        values[at++] = weight ? uniform.next(bound) : block.bias;
                }
            break;
        }
    }
    return values;
}

bool contains_any(const std::string& name, const std::vector<std::string>& parts) {
    return std::ranges::any_of(
        parts, [&](const std::string& part) { return name.find(part) != std::string::npos; });
}

Status check_parts(const std::map<std::string, Init>& inits, const char* key,
                   const std::vector<std::string>& parts, const char* end) {
    for (const std::string& part : parts)
        if (std::ranges::none_of(inits, [&](const auto& named) {
                return named.first.ends_with(end) && contains_any(named.first, {part});
            }))
            return invalid(
                "configuration: %s has '%s', expected a part of the name of a "
                "parameter that it can choose",
                key, part.c_str());
    return {};
}

}  // namespace splat::model
