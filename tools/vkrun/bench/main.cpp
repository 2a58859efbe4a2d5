// vkrun-bench: the commands of vkrun that measure. vkrun starts it, see ../measuring.h.

#include "core/os/console.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/program.h"

namespace vkrun {
namespace {

void add_commands(CLI::App& app, int& exit_code) {
    add_bench(app, exit_code);
    add_stress(app, exit_code);
}

}  // namespace
}  // namespace vkrun

int main(int argc, char** argv) {
    argv = splat::os::arguments(argc, argv);
    return vkrun::run_program(argc, argv, vkrun::add_commands);
}
