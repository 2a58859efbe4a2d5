#pragma once

#include <splat.h>

#include <string>
#include <vector>

#include "vkrun/cli/failure.h"
#include "vkrun/cli/json.h"

namespace vkrun {

/// {"path", "preset"} of splat_prior_preset. Throws a Failure of bad data.
inline Json preset_json(const std::string& name) {
    return Json::parse(library_text(
        [&name](char* buffer, std::size_t capacity, std::size_t* needed) {
            return splat_prior_preset(name.c_str(), buffer, capacity, needed);
        },
        kBadData));
}

inline std::vector<std::string> preset_names() {
    return library_json(splat_prior_preset, static_cast<const char*>(nullptr))
        .get<std::vector<std::string>>();
}

}  // namespace vkrun
