// vkrun bench: the benchmarks of tools/bench.

#include <CLI/CLI.hpp>

#include "vkrun/cli/command.h"
#include "vkrun/cli/options.h"

namespace vkrun {

void add_bench(CLI::App& app, int& exit_code) {
    CLI::App* bench = add_command(app, "bench", kBenchSentence,
                                  "'vkrun bench COMMAND --help' describes a command.\n");
    bench->require_subcommand(1);
    add_bench_ops(*bench, exit_code);
    add_bench_raster(*bench, exit_code);
    add_bench_model(*bench, exit_code);
    add_bench_start(*bench, exit_code);
    add_bench_dispatch(*bench, exit_code);
}

}  // namespace vkrun
