#include <string>

#include "api/api_guard.h"
#include "api/structs.h"
#include "core/json_writer.h"
#include "vk/shaders.h"

#define SPLAT_TEXT_(x) #x
#define SPLAT_TEXT(x) SPLAT_TEXT_(x)

namespace {

#ifdef NDEBUG
constexpr bool kAssertions = false;
#else
constexpr bool kAssertions = true;
#endif

std::string make_build_info() {
    splat::JsonWriter json;
    json.begin_object().member("version", splat_version_string()).member("compiler", __VERSION__);
    json.member("assertions", kAssertions).member("fault_points", SPLAT_FAULT_POINTS != 0);
    json.newline(1).key("shaders").begin_array();
    for (const splat::vk::ShaderModule& module : splat::vk::shader_modules()) {
        json.newline(2).begin_object().member("name", module.name).member("hash", module.sha256);
        json.member("bytes", module.words.size_bytes()).end();
    }
    json.end().newline(1).key("structs").begin_object();
#define SPLAT_STRUCT_SIZE(type) json.member(#type, sizeof(type));
    SPLAT_STRUCTS(SPLAT_STRUCT_SIZE)
#undef SPLAT_STRUCT_SIZE
    json.end().end();
    return json.text();
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
