# cmake "-DFILES=<a.spv;b.spv...>" -DTABLE=<YES|NO> -DOUT=<out.cpp> -P EmbedShaders.cmake
#
# Writes SPIR-V files as C++ arrays, one process for all of them: std::span splat::vk::embedded::<stem> each, and with
# TABLE the function shader_modules() of src/vk/shaders.h.
set(text "#include <cstdint>\n#include <span>\n")
if(TABLE)
  string(APPEND text "#include \"vk/shaders.h\"\n")
endif()
string(APPEND text "namespace splat::vk {\nnamespace embedded {\n")
set(rows "")
foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME_WE)
  file(READ ${file} bytes HEX)
  file(SHA256 ${file} hash)
  string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${bytes}")
  string(APPEND text "static const std::uint32_t ${name}_words[] = {${words}};\n"
                     "extern const std::span<const std::uint32_t> ${name};\n"
                     "const std::span<const std::uint32_t> ${name}(${name}_words);\n")
  string(APPEND rows "        {\"${name}\", embedded::${name}_words, \"${hash}\"},\n")
endforeach()
string(APPEND text "}  // namespace embedded\n")
if(TABLE)
  string(APPEND text "std::span<const ShaderModule> shader_modules() {
    static const ShaderModule modules[] = {
${rows}    };
    return modules;
}
")
endif()
string(APPEND text "}  // namespace splat::vk\n")
file(WRITE ${OUT} "${text}")
