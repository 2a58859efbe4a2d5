# splat_embed_presets(<source file>)
#
# Writes a source file with the presets of src/prior_models/presets/, sorted by name. It is written anew
# when one of them changes.
function(splat_embed_presets to)
  set(folder ${PROJECT_SOURCE_DIR}/src/prior_models/presets)
  file(GLOB files CONFIGURE_DEPENDS RELATIVE ${folder} ${folder}/*.json)
  list(TRANSFORM files REPLACE "[.]json$" "")
  list(SORT files)
  set(entries "")
  foreach(name IN LISTS files)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${folder}/${name}.json)
    file(READ ${folder}/${name}.json text)
    string(APPEND entries "    {\"${name}\", R\"preset(${text})preset\"},\n")
  endforeach()
  file(CONFIGURE OUTPUT ${to} @ONLY CONTENT
"#include \"prior_models/embedded_presets.h\"

namespace splat::prior_models {
namespace {

constexpr EmbeddedPreset kPresets[] = {
@entries@};

}  // namespace

std::span<const EmbeddedPreset> embedded_presets() {
    return kPresets;
}

}  // namespace splat::prior_models
")
endfunction()
