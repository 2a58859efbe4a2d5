# splat_embed_page(<source file>)
#
# Writes a source file with the script and the style of tools/vkrun/view/page/. It is written anew when one of their
# files changes.
function(splat_embed_page to)
  set(folder ${PROJECT_SOURCE_DIR}/tools/vkrun/view/page)
  foreach(name IN ITEMS painter.js scene.js camera.js viewer.js viewer.css)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${folder}/${name})
    file(READ ${folder}/${name} text)
    if(name MATCHES "css$")
      set(style "R\"page(${text})page\"")
    else()
      string(APPEND scripts "    R\"page(${text})page\"\n")
    endif()
  endforeach()
  file(CONFIGURE OUTPUT ${to} @ONLY CONTENT
"#include \"vkrun/view/embedded_page.h\"

namespace vkrun {

const char* const kViewerScript =
@scripts@;

const char* const kViewerStyle = @style@;

}  // namespace vkrun
")
endfunction()
