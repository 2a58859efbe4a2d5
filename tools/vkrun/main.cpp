// vkrun: the command line of libsplat. README.md says where each command lives.

#include "core/os/console.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/program.h"
#include "vkrun/measuring.h"

namespace vkrun {
namespace {

void add_commands(CLI::App& app, int& exit_code) {
    add_doctor(app, exit_code);
    add_devices(app, exit_code);
    add_predict(app, exit_code);
    add_demo(app, exit_code);
    add_render(app, exit_code);
    add_view(app, exit_code);
    add_inspect(app, exit_code);
    add_convert(app, exit_code);
    add_data(app, exit_code);
    add_fit(app, exit_code);
    add_train(app, exit_code);
    add_config(app, exit_code);
    add_eval(app, exit_code);
    add_compare(app, exit_code);
    add_report(app, exit_code);
    add_priors(app, exit_code);
    add_weights(app, exit_code);
    add_completion(app, exit_code);
    add_measuring(app);
}

}  // namespace
}  // namespace vkrun

int main(int argc, char** argv) {
    argv = splat::os::arguments(argc, argv);
    if (vkrun::is_measuring(argc, argv)) return vkrun::run_measuring(argv);
    return vkrun::run_program(argc, argv, vkrun::add_commands);
}
