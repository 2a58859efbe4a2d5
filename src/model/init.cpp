#include "model/init.h"

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

struct Group {
    std::uint32_t channels;
    config::HeadInit init;
};

/// Output channels of the last convolution in their order. The gains of rotations and spherical
/// harmonics are the same in every published configuration.
std::vector<Group> head_groups(const config::ModelConfig& c) {
    std::vector<Group> groups = {{1, c.init_depth}};
    if (c.offset) groups.push_back({3, c.init_offset});
    groups.push_back({1, c.init_opacity});
    groups.push_back({3, {c.init_scale.scale, std::log(c.init_scale.bias)}});
    groups.push_back({4, {1, 0}});
    groups.push_back({3, {5, 0}});
    if (c.sh_degree > 0) groups.push_back({9, {0, 0}});
    return groups;
}

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
        case Init::Kind::kHeadWeight: {
            std::size_t at = 0;
            for (const Group& group : head_groups(config)) {
                const double bound =
                    xavier_bound(static_cast<double>(group.init.scale), columns, group.channels);
                const auto count = static_cast<std::size_t>(columns) * group.channels;
                for (std::size_t i = 0; i < count; ++i) values[at++] = uniform.next(bound);
            }
            break;
        }
        case Init::Kind::kHeadBias: {
            std::size_t at = 0;
            for (const Group& group : head_groups(config))
                for (std::uint32_t i = 0; i < group.channels; ++i) values[at++] = group.init.bias;
            break;
        }
    }
    return values;
}

}  // namespace splat::model
