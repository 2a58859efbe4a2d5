#include <string>

#include "api/api_guard.h"
#include "core/json.h"
#include "vk/shaders.h"

#define SPLAT_TEXT_(x) #x
#define SPLAT_TEXT(x) SPLAT_TEXT_(x)

namespace {

std::string make_build_info() {
    splat::Json shaders = splat::Json::array();
    for (const splat::vk::ShaderModule& module : splat::vk::shader_modules())
        shaders.push_back(
            {{"name", module.name}, {"hash", module.sha256}, {"bytes", module.words.size_bytes()}});
    const splat::Json info = {
        {"version", splat_version_string()},
        {"compiler", __VERSION__},
#ifdef NDEBUG
        {"assertions", false},
#else
        {"assertions", true},
#endif
        {"fault_points", SPLAT_FAULT_POINTS != 0},
        {"shaders", shaders},
    };
    return info.dump();
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
