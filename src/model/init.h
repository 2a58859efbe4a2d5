#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/model_config.h"
#include "nn/parameters.h"

namespace splat::model {

/// Initial values of a parameter.
struct Init {
    enum class Kind : int {
        kConstant,
        kXavierUniform,  ///< U(-b, b) with b = scale * sqrt(6 / (fan_in + fan_out))
        kUniformColumns,  ///< U(-b, b) with b = 1 / sqrt(columns): PyTorch's kaiming_uniform(a = sqrt 5)
        kHeadWeight,  ///< the last convolution: Xavier per group of output channels, with its scale
        kHeadBias,    ///< constants of the last convolution, per group
        kFilmBias,    ///< 1 for gamma, the first half, and 0 for beta
    };
    Kind kind = Kind::kConstant;
    float scale = 0;  ///< the constant, or the gain
};

/// Initial values of one parameter. Each has its own stream of random numbers, from the seed and its name,
/// so that adding or removing a layer changes no other.
std::vector<float> initial_values(const config::ModelConfig& config, const Init& init,
                                  const std::string& name, const Shape& shape, std::uint64_t seed);

/// True if a name contains one of the parts.
bool contains_any(const std::string& name, const std::vector<std::string>& parts);

/// Refuse a part of a list of the configuration that occurs in no name with this end: a typing error would train other
/// parameters than intended.
Status check_parts(const std::map<std::string, Init>& inits, const char* key,
                   const std::vector<std::string>& parts, const char* end);

}  // namespace splat::model
