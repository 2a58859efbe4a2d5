#include <string>

#include "api/api_guard.h"
#include "core/json.h"
#include "vk/shaders.h"

#define SPLAT_TEXT_(x) #x
#define SPLAT_TEXT(x) SPLAT_TEXT_(x)

namespace {

#ifdef NDEBUG
constexpr const char* kAssertions = "false";
#else
constexpr const char* kAssertions = "true";
#endif

std::string make_build_info() {
    std::string shaders;
    for (const splat::vk::ShaderModule& module : splat::vk::shader_modules())
        shaders += splat::format("%s\n  {\"name\": \"%s\", \"hash\": \"%s\", \"bytes\": %zu}",
                                 shaders.empty() ? "" : ",", module.name, module.sha256,
                                 module.words.size_bytes());
    return splat::format(
        "{\"version\": \"%s\", \"compiler\": %s, \"assertions\": %s, \"fault_points\": %s,\n"
        " \"shaders\": [%s]}",
        splat_version_string(), splat::json_quote(__VERSION__).c_str(), kAssertions,
        SPLAT_FAULT_POINTS != 0 ? "true" : "false", shaders.c_str());
}

}  // namespace

uint32_t splat_version(void) {
    return SPLAT_VERSION;
}

const char* splat_version_string(void) {
    return SPLAT_TEXT(SPLAT_VERSION_MAJOR) "." SPLAT_TEXT(SPLAT_VERSION_MINOR) "." SPLAT_TEXT(
        SPLAT_VERSION_PATCH);
}

const char* splat_build_info(void) {
    try {
        static const std::string info = make_build_info();
        return info.c_str();
    } catch (...) {
        return "{}";
    }
}
