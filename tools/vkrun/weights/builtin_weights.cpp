#include "vkrun/weights/builtin_weights.h"

#include <filesystem>

#include "core/os/path.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/weights/published.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

std::string built_in(const std::string& name) {
    return library_text(
        [&](char* buffer, std::size_t capacity, std::size_t* needed) {
            return splat_builtin_weights(name.c_str(), buffer, capacity, needed);
        },
        kBadData);
}

/// Throws a Failure if the name is that of published weights or of their file.
void refuse_unfetched(const std::string& given) {
    for (const PublishedWeights& one : published_weights())
        if (given == one.name || os::path_of(given).filename() == one.file)
            throw Failure(kBadData, "there is no file '" + given + "'; 'vkrun weights get " +
                                        one.name + "' fetches '" + one.file + "'");
}

}  // namespace

std::string weights_named(const std::string& given) {
    const fs::path path = os::path_of(given);
    const bool name = !path.has_parent_path() && !path.has_extension();
    if (given.empty() || fs::exists(path)) return given;
    refuse_unfetched(given);
    return name ? built_in(given) : given;
}

bool is_built_in(const std::string& file) {
    for (const char* name : {kPlainWeights, kDepthNormalWeights}) {
        std::string path(4096, '\0');  // the longest that a file may have
        std::size_t length = 0;
        const splat_result found = splat_builtin_weights(name, path.data(), path.size(), &length);
        if (found == SPLAT_OK && path.c_str() == file) return true;
    }
    return false;
}

std::string weights_title(const std::string& file) {
    const fs::path path = os::path_of(file);
    return is_built_in(file) ? os::text_of(path.parent_path().filename()) + ", built in"
                             : os::text_of(path.filename());
}

}  // namespace vkrun
