# splat_presets(OUT FOLDER): write to OUT the source of splat::config::presets() (src/config/presets.h) with the
# contents of FOLDER/*.yaml.
function(splat_presets out folder)
  file(GLOB files CONFIGURE_DEPENDS ${folder}/*.yaml)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${files})
  set(rows "")
  foreach(file IN LISTS files)
    get_filename_component(name ${file} NAME_WE)
    file(READ ${file} text)
    string(APPEND rows "    {\"${name}\", R\"yaml(${text})yaml\"},\n")
  endforeach()
  file(CONFIGURE OUTPUT ${out} @ONLY CONTENT [[
#include "config/presets.h"

namespace splat::config {
namespace {

constexpr Preset kPresets[] = {
@rows@};

}  // namespace

std::span<const Preset> presets() {
    return kPresets;
}

}  // namespace splat::config
]])
endfunction()
