#pragma once

#include "config/predictor_config.h"

namespace splat::api {

/// What splat_model_input and splat_trainer_batch have beside images and poses.
struct NetworkArrays {
    const char* type;  ///< the struct's name
    const float* focals;
    const float* embedding;
    const float* tokens;
    std::uint32_t channels;  ///< of each image; 0: not checked
    std::uint32_t objects;   ///< 0: not checked
};

/// Errors  kInvalidArgument for an array that the configuration needs and that is NULL, or that it has no
///         use for; kShape for another number of channels or of objects than `objects`
Status check_network_arrays(const NetworkArrays& given, const config::PredictorConfig& config,
                            std::uint32_t objects);

}  // namespace splat::api
