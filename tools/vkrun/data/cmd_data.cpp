// vkrun data: sets of posed images. Only render needs a device.

#include <CLI/CLI.hpp>

#include "vkrun/cli/command.h"
#include "vkrun/cli/options.h"

namespace vkrun {

void add_data(CLI::App& app, int& exit_code) {
    CLI::App* data =
        add_command(app, "data", "Make, copy, check and show data sets of posed images.",
                    "'vkrun data COMMAND --help' describes a command.\n");
    data->require_subcommand(1);
    add_data_synth(*data, exit_code);
    add_data_render(*data, exit_code);
    add_data_co3d(*data, exit_code);
    add_data_check(*data, exit_code);
    add_data_show(*data, exit_code);
    add_data_import(*data, exit_code);
    add_data_export(*data, exit_code);
    add_data_split(*data, exit_code);
    add_data_tokens(*data, exit_code);
}

}  // namespace vkrun
