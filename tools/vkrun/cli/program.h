#pragma once

#include <string>

namespace CLI {
class App;
}

namespace vkrun {

/// The one option before a command that has a value.
constexpr const char* kDecodeScaleOption = "--decode-scale";

/// Adds commands, each of which leaves its exit status in `exit_code`.
using AddCommands = void (*)(CLI::App& app, int& exit_code);

/// Has an error end this process by `end`, after which nothing runs, in place of its message alone.
void on_failure(void (*end)(int exit_code, const std::string& sentence));

/// Runs the command that the command line names, and returns the exit status of the process.
int run_program(int argc, char** argv, AddCommands add_commands);

}  // namespace vkrun
