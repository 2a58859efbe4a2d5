# cmake -DSPV=<in> -DNAME=<module> -DOUT=<out.cpp> -P EmbedShader.cmake
#
# Writes a SPIR-V file as a C++ array.
file(READ ${SPV} bytes HEX)
file(SHA256 ${SPV} hash)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${bytes}")
file(WRITE ${OUT} "#include <cstdint>
#include <span>
namespace splat::vk::embedded {
static const std::uint32_t ${NAME}_words[] = {${words}};
extern const std::span<const std::uint32_t> ${NAME};
extern const char* const ${NAME}_sha256;
const std::span<const std::uint32_t> ${NAME}(${NAME}_words);
const char* const ${NAME}_sha256 = \"${hash}\";
}
")
