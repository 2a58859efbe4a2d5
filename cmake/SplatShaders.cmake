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

  splat_embed_shaders(${CMAKE_CURRENT_BINARY_DIR}/${target}.cpp YES ${names})
  add_library(${target} STATIC ${CMAKE_CURRENT_BINARY_DIR}/${target}.cpp)
  target_include_directories(${target} PRIVATE ${PROJECT_BINARY_DIR}/layers/vk)
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

# One module, compiled: <name>.spv in the caller's build folder. Appends to the caller's `names`. The test
# House.ShadersAreValid runs spirv-val.
macro(splat_shader_module source name)
  set(spv ${CMAKE_CURRENT_BINARY_DIR}/${name}.spv)
  add_custom_command(
    OUTPUT ${spv}
    COMMAND ${GLSLANG_VALIDATOR} --quiet -V --target-env vulkan1.2
            -I${PROJECT_SOURCE_DIR}/shaders/include ${ARGN} --depfile ${spv}.d
            -o ${spv} ${CMAKE_CURRENT_SOURCE_DIR}/${source}.comp
    DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${source}.comp
    DEPFILE ${spv}.d
    COMMENT "Shader ${name}"
    VERBATIM)
  list(APPEND names ${name})
endmacro()
