#include "vkrun/ranks/ranks.h"

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "core/os/console.h"
#include "core/os/library.h"
#include "core/os/path.h"
#include "core/os/process.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/log.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/program.h"
#include "vkrun/cli/text.h"
#include "vkrun/ranks/launcher.h"
#include "vkrun/ranks/mpi_plugin.h"

namespace vkrun {
namespace {

vkrun_mpi g_mpi = {};

/// Ends all ranks with an error of this one. Most errors are those of all, so that rank 0 gets the time to tell them
/// and to end the others before they do. Ends even if MPI does not.
[[noreturn]] void end_all(int exit_code, const std::string& sentence) {
    splat::os::release_interrupts();  // MPI ends the others by SIGTERM
    if (g_mpi.rank != 0) std::this_thread::sleep_for(std::chrono::seconds(4));
    print_failure(sentence);
    std::fflush(stderr);
    std::thread([exit_code] {
        std::this_thread::sleep_for(std::chrono::seconds(4));
        std::_Exit(exit_code);
    }).detach();
    g_mpi.end_all(exit_code);
    std::_Exit(exit_code);
}

/// Where plugins are: beside vkrun in a build tree, else where they are installed.
std::vector<std::string> places(const std::string& kind) {
    const std::string file = splat::os::library_file("vkrun-mpi-" + kind);
    return {splat::os::program_beside(file), splat::os::program_beside(VKRUN_PLUGINS "/" + file)};
}

std::string mpi_name(const std::string& kind) {
    return kind == "mpich" ? "MPICH" : "Open MPI";
}

/// What to do instead of starting ranks.
std::string alone(const Launcher& launcher) {
    return launcher.count <= 1 ? ""
                               : "; or let each process train for itself, in its own --out "
                                 "(--ranks none)";
}

std::string find_plugin(const Launcher& launcher) {
    std::string names, missing;
    for (const std::string& kind : launcher.kinds) {
        for (const std::string& path : places(kind)) {
            std::error_code none;
            if (std::filesystem::exists(splat::os::path_of(path), none)) return path;
            missing += (missing.empty() ? "'" : ", '") + path + "'";
        }
        names += (names.empty() ? "" : " or ") + mpi_name(kind);
    }
    throw Failure(kUsageError,
                  "ranks need vkrun's plugin for " + names + ", and there is no " + missing +
                      ": install that MPI for developers and build vkrun again, or build the "
                      "plugin alone and name its file with --ranks (docs/ranks.md)" +
                      alone(launcher));
}

void start(const std::string& path, const RankOptions& options, const Launcher& launcher) {
    std::string failed;
    void* const library = splat::os::load_library(path, failed);
    if (library == nullptr)
        throw Failure(kUsageError, "cannot load the plugin '" + path + "': " + failed);
    const auto function = reinterpret_cast<vkrun_mpi_start_function>(
        splat::os::function_of(library, "vkrun_mpi_start"));
    if (function == nullptr)
        throw Failure(kUsageError, "'" + path + "' is no plugin of vkrun for MPI (docs/ranks.md)");
    g_mpi.timeout_seconds = options.timeout;
    g_mpi.message_bytes = std::uint64_t{64} << 20U;
    const std::int32_t result = function(VKRUN_MPI_VERSION, &g_mpi);
    if (result == VKRUN_MPI_OTHER_VERSION)
        throw Failure(kUsageError, "the plugin '" + path + "' is of another vkrun: build it again");
    if (result != 0)
        throw Failure(kFailed, "the plugin '" + path + "' does not start: " + g_mpi.failed);
    if (g_mpi.count == launcher.count || launcher.name.empty()) return;
    const std::string sentence = format(
        "%s started %u processes, but %s sees %u: %s%s", launcher.name.c_str(), launcher.count,
        g_mpi.library, g_mpi.count,
        launcher.name == "srun"
            ? "choose its kind of MPI, such as srun --mpi=pmix ('srun --mpi=list' lists them)"
            : "use the mpirun of the same MPI, or name another plugin with --ranks",
        alone(launcher).c_str());
    // Ranks that do not see each other are ended by their launcher.
    throw Failure(kUsageError, sentence);
}

}  // namespace

void add_rank_options(CLI::App& command, RankOptions& options) {
    command
        .add_option("--ranks", options.ranks,
                    "Processes that train together: auto, those that mpirun or srun\n"
                    "started; none; openmpi or mpich, those of that MPI; or the file of a\n"
                    "plugin for another one")
        ->type_name("WORD")
        ->capture_default_str()
        ->check(any_like({"auto", "none", "openmpi", "mpich"}));
    command
        .add_option("--rank-timeout", options.timeout,
                    "Seconds that a rank waits for another one before all end")
        ->type_name("SECONDS")
        ->capture_default_str();
}

Ranks::Ranks(const RankOptions& options) : group_(sized<splat_group>()) {
    group_.count = 1;
    check_number("--rank-timeout", options.timeout, 0.1, 1e9);
    if (options.ranks == "none") return;
    Launcher launcher = find_launcher(splat::os::variable);
    std::string plugin;
    if (options.ranks != "auto") {
        launcher.kinds = {options.ranks};
        if (options.ranks != "openmpi" && options.ranks != "mpich") plugin = options.ranks;
    } else if (launcher.count <= 1) {
        return;
    } else if (launcher.kinds.empty()) {
        throw Failure(
            kUsageError,
            format("torchrun started %u processes (WORLD_SIZE): it is for programs in Python, such "
                   "as bindings/python/examples/train_ranks.py; vkrun needs MPI: mpirun -n %u "
                   "vkrun train ...",
                   launcher.count, launcher.count) +
                alone(launcher));
    }
    start(plugin.empty() ? find_plugin(launcher) : plugin, options, launcher);
    group_.rank = g_mpi.rank;
    group_.count = g_mpi.count;
    group_.send_receive = g_mpi.send_receive;
    group_.broadcast = g_mpi.broadcast;
    group_.barrier = g_mpi.barrier;
    group_.describe = g_mpi.describe;
    if (!leads()) speak_as(format("rank %u: ", group_.rank));
    on_failure(end_all);
}

splat_device_desc Ranks::device_desc(const std::string& device) const {
    splat_device_desc desc = vkrun::device_desc(device);
    if (!several()) return desc;
    const std::vector<std::uint32_t> shared = devices_to_share(desc, all_devices());
    if (!shared.empty()) {
        desc.select = SPLAT_SELECT_BY_INDEX;
        desc.index = shared[g_mpi.local_rank % shared.size()];
    }
    if (!leads()) return desc;
    std::string indices;
    for (const std::uint32_t index : shared)
        indices += (indices.empty() ? "" : ", ") + std::to_string(index);
    std::fprintf(stderr, "%u ranks by %s, %u of them on this machine, on %s %s%s\n", g_mpi.count,
                 g_mpi.library, g_mpi.local_count, shared.size() > 1 ? "its devices" : "device",
                 shared.empty() ? device.c_str() : indices.c_str(),
                 g_mpi.local_count > shared.size() ? ", which they share" : "");
    return desc;
}

void Ranks::wait(const std::string& what) const {
    if (!several()) return;
    const std::int32_t failed = group_.barrier(nullptr);
    if (failed == 0) return;
    const char* const text = group_.describe(nullptr, failed);
    throw Failure(kFailed, "waiting for " + what + ": " + (text == nullptr ? "MPI fails" : text));
}

void Ranks::finish() const {
    std::fflush(stdout);
    wait("all ranks to end");
    if (g_mpi.finish != nullptr) g_mpi.finish();
}

}  // namespace vkrun
