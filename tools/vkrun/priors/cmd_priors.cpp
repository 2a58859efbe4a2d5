// vkrun priors: depth maps, normals, masks, edges and planes of pictures, and shapes.

#include <CLI/CLI.hpp>

#include "vkrun/cli/command.h"
#include "vkrun/cli/options.h"

namespace vkrun {

void add_priors(CLI::App& app, int& exit_code) {
    CLI::App* priors =
        add_command(app, "priors", "Make and judge depth maps, normals and masks of pictures.",
                    "'vkrun priors COMMAND --help' describes a command.\n");
    priors->require_subcommand(1);
    add_priors_make(*priors, exit_code);
    add_priors_where(*priors, exit_code);
    add_priors_get(*priors, exit_code);
    add_priors_eval(*priors, exit_code);
    add_priors_points(*priors, exit_code);
}

}  // namespace vkrun
