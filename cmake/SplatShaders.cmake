# splat_shader_library(<target> <path>...)
#
# A static library of embedded SPIR-V with its table (src/vk/shaders.h), from sources relative to the calling
# folder. A module is named after its file:
#   foo_fast.comp   modules foo_cpu and foo_gpu: the same source, reading and writing its arrays as each does
#                   fastest (shaders/include/load.glsl, store.glsl)
#   foo_cpu.comp    module foo_cpu, which reads through texel buffers
#   foo.comp        module foo; and foo_cpu, which differs in the same way, if it reads its arrays through
#                   load.glsl and has no file of its own
function(splat_shader_library target)
  set(names "")
  foreach(source IN LISTS ARGN)
    string(REGEX REPLACE "\\.comp$" "" path ${source})
    get_filename_component(name ${path} NAME)
    if(name MATCHES "_fast$")
      string(REGEX REPLACE "_fast$" "" name ${name})
      splat_shader_module(${path} ${name}_cpu -DTEXEL_LOADS=1)
      splat_shader_module(${path} ${name}_gpu -DTEXEL_LOADS=0)
    elseif(name MATCHES "_cpu$")
      splat_shader_module(${path} ${name} -DTEXEL_LOADS=1)
    else()
      splat_shader_module(${path} ${name} -DTEXEL_LOADS=0)
      splat_reads_arrays(${source} reads)
      if(reads AND NOT "${path}_cpu.comp" IN_LIST ARGN)
        splat_shader_module(${path} ${name}_cpu -DTEXEL_LOADS=1)
      endif()
    endif()
  endforeach()

  splat_embed_shaders(${CMAKE_CURRENT_BINARY_DIR}/${target}.cpp YES ${names})
  add_library(${target} STATIC ${CMAKE_CURRENT_BINARY_DIR}/${target}.cpp)
  if(CMAKE_HOST_WIN32)  # has no links, see splat_layer
    target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src)
  else()
    target_include_directories(${target} PRIVATE ${PROJECT_BINARY_DIR}/layers/vk)
  endif()
endfunction()

# splat_reads_arrays(<source> <variable>): whether it includes load.glsl, itself or by another file.
function(splat_reads_arrays source result)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${source})
  file(STRINGS ${source} includes REGEX "^#include \".*\\.glsl\"")
  set(reads NO)
  foreach(line IN LISTS includes)
    string(REGEX REPLACE "^#include \"(.*)\".*" "\\1" file ${line})
    if(file STREQUAL "load.glsl")
      set(reads YES)
    elseif(NOT reads)
      splat_reads_arrays(${PROJECT_SOURCE_DIR}/shaders/include/${file} reads)
    endif()
  endforeach()
  set(${result} ${reads} PARENT_SCOPE)
endfunction()

# splat_embed_shaders(<out.cpp> <with shader_modules(), YES or NO> <module>...): modules as C++ arrays.
function(splat_embed_shaders out table)
  set(files ${ARGN})
  list(TRANSFORM files PREPEND ${CMAKE_CURRENT_BINARY_DIR}/)
  list(TRANSFORM files APPEND .spv)
  add_custom_command(
    OUTPUT ${out}
    COMMAND ${CMAKE_COMMAND} "-DFILES=${files}" -DTABLE=${table} -DOUT=${out}
            -P ${PROJECT_SOURCE_DIR}/cmake/EmbedShaders.cmake
    DEPENDS ${files} ${PROJECT_SOURCE_DIR}/cmake/EmbedShaders.cmake
    COMMENT "Embedding shaders"
    VERBATIM)
endfunction()

# Altered builds, presets lanes and rounding: results must not need what lavapipe alone gives.
#   lanes      local indices run against subgroups and across them, except in kernels that count on lavapipe's order
#   rounding   quotients, roots and exponentials err by what Vulkan allows (AllowedErrors.py)
set(SPLAT_ALTERED_SHADERS "" CACHE STRING "For tests: lanes or rounding")
set(permuted_lanes
    "-Dgl_LocalInvocationID=uvec3(gl_WorkGroupSize.x - 1u - (gl_WorkGroupSize.x % 8u != 0u ? gl_LocalInvocationID.x \
: gl_LocalInvocationID.x % 8u * (gl_WorkGroupSize.x / 8u) + gl_LocalInvocationID.x / 8u), 0u, 0u)")
if(SPLAT_ALTERED_SHADERS STREQUAL "rounding")
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
endif()

# One module, compiled: <name>.spv in the caller's build folder. Appends to the caller's `names`. The test
# House.ShadersAreValid runs spirv-val.
macro(splat_shader_module source name)
  set(spv ${CMAKE_CURRENT_BINARY_DIR}/${name}.spv)
  set(permuted "")
  set(rounded "")
  # ST4_RUN of the second writes pairs of lanes.
  if(SPLAT_ALTERED_SHADERS STREQUAL "lanes" AND NOT "${source}${ARGN}" MATCHES "_cpu-|winograd_forward_weight-.*=1")
    set(permuted ${permuted_lanes})
  elseif(SPLAT_ALTERED_SHADERS STREQUAL "rounding")
    set(rounding ${PROJECT_SOURCE_DIR}/cmake/AllowedErrors.py)
    set(rounded COMMAND ${Python3_EXECUTABLE} ${rounding} ${spv} DEPENDS ${rounding})
  endif()
  add_custom_command(
    OUTPUT ${spv}
    COMMAND ${SPLAT_GLSLANG_VALIDATOR} --quiet -V --target-env vulkan1.2
            -I${PROJECT_SOURCE_DIR}/shaders/include ${ARGN} ${permuted} --depfile ${spv}.d
            -o ${spv} ${CMAKE_CURRENT_SOURCE_DIR}/${source}.comp
    ${rounded}
    DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${source}.comp
    DEPFILE ${spv}.d
    COMMENT "Shader ${name}"
    VERBATIM)
  list(APPEND names ${name})
endmacro()
