#pragma once

#include "config/predictor_config.h"

namespace splat::api {

/// The optional members of splat_model_input and splat_trainer_batch.
struct NetworkArrays {
    const char* type;  ///< the struct's name
    const float* focals;
    const float* embedding;
    const float* tokens;
    std::uint32_t channels;  ///< of each image; 0: not checked
    std::uint32_t objects;   ///< 0: not checked
};

/// Errors  kInvalidArgument if an array that the configuration needs is NULL, or one that it does
///         not use is given; kShape if the channels or the objects are not as expected
Status check_network_arrays(const NetworkArrays& given, const config::PredictorConfig& config,
                            std::uint32_t objects);

}  // namespace splat::api
