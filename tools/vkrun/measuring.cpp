#include "vkrun/measuring.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string_view>

#include "core/os/child.h"
#include "core/os/process.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/program.h"

namespace vkrun {
namespace {

struct Command {
    const char* name;
    const char* sentence;
};

constexpr Command kCommands[] = {{"bench", kBenchSentence}, {"stress", kStressSentence}};

}  // namespace

void add_measuring(CLI::App& app) {
    for (const Command& command : kCommands) add_command(app, command.name, command.sentence, "");
}

bool is_measuring(int argc, char** argv) {
    for (int i = 1; i < argc; ++i) {
        const std::string_view word = argv[i];
        if (word == kDecodeScaleOption) ++i;  // skips the value of the option
        if (word.starts_with("-")) continue;
        for (const Command& command : kCommands)
            if (word == command.name) return true;
        return false;
    }
    return false;
}

int run_measuring(char** argv) {
    const std::string program = splat::os::program_beside("vkrun-bench");
    const int failed = splat::os::run_instead(program, argv);
    std::fprintf(
        stderr,
        "vkrun: cannot start '%s', which measures: %s; build it where you built vkrun ('cmake "
        "--build --preset release')\n",
        program.c_str(), splat::os::reason(failed).c_str());
    return kFailed;
}

}  // namespace vkrun
