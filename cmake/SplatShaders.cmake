# splat_shader_library(<target> [SHADERS <path>...] [FAST <path>...] [LOADS <path>...] [CPU <path>...])
#
# A static library of embedded SPIR-V with its table (src/vk/shaders.h). Paths have no extension and
# are relative to the calling folder; a module is named after its file.
#   SHADERS  one module <stem> from <stem>.comp
#   FAST     modules <stem>_cpu and <stem>_gpu from <stem>_fast.comp: the same source, reading and
#            writing its arrays as each does fastest (shaders/include/load.glsl, store.glsl)
#   LOADS    modules <stem> and <stem>_cpu from <stem>.comp, which differ in the same way
#   CPU      module <stem>_cpu from <stem>_cpu.comp, which reads through texel buffers
function(splat_shader_library target)
  cmake_parse_arguments(ARG "" "" "SHADERS;FAST;LOADS;CPU" ${ARGN})
  set(sources "")
  set(names "")
  foreach(path IN LISTS ARG_SHADERS)
    get_filename_component(name ${path} NAME)
    splat_shader_module(${path} ${name})
  endforeach()
  foreach(path IN LISTS ARG_FAST)
    get_filename_component(name ${path} NAME)
    splat_shader_module(${path}_fast ${name}_cpu -DTEXEL_LOADS=1)
    splat_shader_module(${path}_fast ${name}_gpu -DTEXEL_LOADS=0)
  endforeach()

  foreach(path IN LISTS ARG_LOADS)
    get_filename_component(name ${path} NAME)
    splat_shader_module(${path} ${name} -DTEXEL_LOADS=0)
    splat_shader_module(${path} ${name}_cpu -DTEXEL_LOADS=1)
  endforeach()
  foreach(path IN LISTS ARG_CPU)
    get_filename_component(name ${path} NAME)
    splat_shader_module(${path}_cpu ${name}_cpu -DTEXEL_LOADS=1)
  endforeach()

  set(declarations "")
  set(rows "")
  foreach(name IN LISTS names)
    string(APPEND declarations "extern const std::span<const std::uint32_t> ${name};\n"
                               "extern const char* const ${name}_sha256;\n")
    string(APPEND rows "        {\"${name}\", embedded::${name}, embedded::${name}_sha256},\n")
  endforeach()
  set(table ${CMAKE_CURRENT_BINARY_DIR}/${target}_table.cpp)
  file(CONFIGURE OUTPUT ${table} CONTENT [[#include "vk/shaders.h"

namespace splat::vk {
namespace embedded {
@declarations@}

std::span<const ShaderModule> shader_modules() {
    static const ShaderModule modules[] = {
@rows@    };
    return modules;
}

}  // namespace splat::vk
]] @ONLY)
  add_library(${target} STATIC ${sources} ${table})
  target_include_directories(${target} PRIVATE ${PROJECT_BINARY_DIR}/layers/vk)
endfunction()

# One module of the library above: compiled, validated, embedded. Appends to the caller's lists.
macro(splat_shader_module source name)
  set(spv ${CMAKE_CURRENT_BINARY_DIR}/${name}.spv)
  set(cpp ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  add_custom_command(
    OUTPUT ${spv} ${cpp}
    COMMAND ${GLSLANG_VALIDATOR} --quiet -V --target-env vulkan1.2
            -I${PROJECT_SOURCE_DIR}/shaders/include ${ARGN} --depfile ${spv}.d
            -o ${spv} ${CMAKE_CURRENT_SOURCE_DIR}/${source}.comp
    COMMAND ${SPIRV_VAL} --target-env vulkan1.2 ${spv}
    COMMAND ${CMAKE_COMMAND} -DSPV=${spv} -DNAME=${name} -DOUT=${cpp}
            -P ${PROJECT_SOURCE_DIR}/cmake/EmbedShader.cmake
    DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${source}.comp
            ${PROJECT_SOURCE_DIR}/cmake/EmbedShader.cmake
    DEPFILE ${spv}.d
    COMMENT "Shader ${name}"
    VERBATIM)
  list(APPEND sources ${cpp})
  list(APPEND names ${name})
endmacro()
