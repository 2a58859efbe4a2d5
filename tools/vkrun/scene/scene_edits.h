#pragma once

#include <string>
#include <vector>

#include "vkrun/scene/scene_file.h"

namespace CLI {
class App;
}  // namespace CLI

namespace vkrun {

struct EditKind;

/// One edit of a command line, checked.
struct SceneEdit {
    const EditKind* kind = nullptr;
    std::string text;             ///< value, as it was given
    std::vector<double> numbers;  ///< numbers of the value
};

/// How edits are meant.
struct EditOptions {
    splat_frame frame = SPLAT_FRAME_RDF;  ///< axes of their numbers
    bool lenient = false;                 ///< for --merge
};

/// What an edit did.
struct EditResult {
    std::string edit;         ///< "--scale 2"
    std::uint64_t count = 0;  ///< Gaussians after it
    bool changed = false;     ///< false: the scene is as before
};

/// Options for all edits, each of which may be repeated.
void add_edit_options(CLI::App& command);

/// A table for help texts: edits, and the function of the C API that each calls.
std::string edits_text();

/// The edits of a parsed command line, in its order. Throws a usage Failure for a value that cannot be.
std::vector<SceneEdit> edits_of(const CLI::App& command);

/// The degree that the last --sh-degree gives; -1 without one.
int sh_degree_of(const std::vector<SceneEdit>& edits);

/// The files of each --merge.
std::vector<std::string> merged_files(const std::vector<SceneEdit>& edits);

/// Apply the edits one after the other, and warn of what is lost. Throws a Failure.
std::vector<EditResult> apply_edits(SceneFile& file, const std::vector<SceneEdit>& edits,
                                    const EditOptions& options);

}  // namespace vkrun
