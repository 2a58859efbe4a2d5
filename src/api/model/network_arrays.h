#pragma once

#include <span>
#include <string>
#include <vector>

#include "config/model_config.h"

namespace splat::api {

/// A caller's array with the length that it states; 0: trusted.
struct HostArray {
    const float* values;
    std::uint64_t count;
};

/// The array as a span of the numbers that `dims` imply; empty for NULL.
/// Errors  kShape for another count, naming the array, its count, the one expected and the shape
Result<std::span<const float>> host_array(const char* type, const char* name, HostArray array,
                                          const std::vector<std::uint64_t>& dims);

/// `wanted` numbers for each image; 0: none. `use` names the setting that needs the array, or has no use for it.
/// Errors  kInvalidArgument for a needed array that is NULL, and for another one that is given
Status check_array(const char* type, const char* name, const float* values, std::uint32_t wanted,
                   const std::string& use);

/// The optional members of splat_model_input and splat_trainer_batch.
struct NetworkArrays {
    const char* type;  ///< the struct's name
    const float* focals;
    const float* embedding;
    const float* tokens;
    std::uint32_t channels;  ///< channels per image; 0: not checked
    std::uint32_t objects;   ///< 0: not checked
};

/// Errors  kInvalidArgument if an array that the configuration needs is NULL, or one that it does
///         not use is given; kShape if the channels or the objects are not as expected
Status check_network_arrays(const NetworkArrays& given, const config::ModelConfig& config,
                            std::uint32_t objects);

}  // namespace splat::api
