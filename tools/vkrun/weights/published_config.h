#pragma once

#include <splat.h>

#include <string>

namespace vkrun {

/// The published configuration that weights fit without one of their own.
struct PublishedConfig {
    std::string name;      ///< empty if none, or several, fit
    std::string sentence;  ///< what fits, or what differs from the nearest
};

/// By the tensors of a file and its name, see splat_weights_report; where several are left, by its hash.
PublishedConfig published_config(const std::string& path, splat_weights weights);

}  // namespace vkrun
