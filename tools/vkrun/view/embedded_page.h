#pragma once

namespace vkrun {

/// The files of page/, which the build embeds (cmake/EmbedPage.cmake).
extern const char* const kViewerScript;
extern const char* const kViewerStyle;

}  // namespace vkrun
