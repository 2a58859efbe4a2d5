#pragma once

namespace CLI {
class App;
}

namespace vkrun {

/// Lists the commands of vkrun-bench, a program of its own, which takes half as long to compile as all others.
void add_measuring(CLI::App& app);

/// True if the command line names one of them.
bool is_measuring(int argc, char** argv);

/// Replaces this process by vkrun-bench, which lies beside vkrun; returns an exit status where it cannot.
int run_measuring(char** argv);

}  // namespace vkrun
