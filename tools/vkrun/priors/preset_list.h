#pragma once

#include <splat.h>

#include <string>
#include <vector>

#include "vkrun/cli/download.h"
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

/// Where the model of what preset_json() returned is had; without an address if none is known.
inline Download download_of(const Json& found, const std::string& out = "") {
    const Json& file = found.at("preset").at("file");
    Download download{file.value("url", ""), download_path(out, found.at("path")),
                      file.value("bytes", std::uint64_t{0}), file.value("sha256", "")};
    if (!download.url.empty()) download.url = mirrored(download.url, file.value("name", ""));
    return download;
}

inline std::vector<std::string> preset_names() {
    return library_json(splat_prior_preset, static_cast<const char*>(nullptr))
        .get<std::vector<std::string>>();
}

}  // namespace vkrun
