// vkrun data: sets of posed images. Needs no device.

#include <CLI/CLI.hpp>

#include "vkrun/data/data_commands.h"

namespace vkrun {

void add_data(CLI::App& app, int& exit_code) {
    CLI::App* data = app.add_subcommand("data", "Make data sets of posed images.");
    data->group("Commands");
    data->require_subcommand(1);
    data->footer("'vkrun data synth --help' and so on tell more.\n");
    add_data_synth(*data, exit_code);
}

}  // namespace vkrun
