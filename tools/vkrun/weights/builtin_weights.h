#pragma once

#include <string>

namespace vkrun {

inline constexpr const char* kPlainWeights = "cars64";
inline constexpr const char* kDepthNormalWeights = "cars64-depth-normal";

/// The file that is meant: a path, or the name of built-in weights where no file is called so. Throws a Failure
/// that lists the names.
std::string weights_named(const std::string& given);

bool is_built_in(const std::string& file);

/// For a page: the name of the file, or of built-in weights.
std::string weights_title(const std::string& file);

}  // namespace vkrun
