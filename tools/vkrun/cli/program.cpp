#include "vkrun/cli/program.h"

#include <splat.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <new>
#include <stdexcept>

#include "core/os/console.h"
#include "core/os/path.h"
#include "vkrun/cli/candidates.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/log.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/process.h"
#include "vkrun/cli/usage.h"

namespace vkrun {
namespace {

constexpr const char* kAbout =
    "vkrun: 3D Gaussian splatting and Splatter Image on the command line.\n"
    "Results go to standard output, messages to standard error.";

constexpr const char* kOutOfMemorySentence =
    "host memory ran out: free some and repeat the command, or ask for less at once";

constexpr const char* kMainFooter = R"(Exit status:
  0    success
  1    failure: a failed check, a wrong result, a file that cannot be written, or an
       error of the library
  2    wrong usage of the command line
  3    no Vulkan loader, no driver, or no usable device
  4    data that is missing, damaged or does not fit together
  5    out of memory, on the host or on the device
  6    a comparison found something worse
  7    a loss, gradients or results that are not finite
  130  interrupted

Environment:
  SPLAT_KERNELS=auto|plain|cpu|gpu  the shaders to run, on every device
  SPLAT_MASK_MODEL=FILE             the network that 'vkrun predict' cuts objects out with
  SPLAT_MIRROR=https://HOST/DIR     has the files that 'weights get' and 'priors get' fetch
  SPLAT_ONNXRUNTIME_LIBRARY=FILE    ONNX Runtime, which runs networks of 'vkrun priors'
  SPLAT_PRIORS_DIR=DIR              where their models are looked for
  SPLAT_TIMEOUT_SCALE=X             multiplies every wait for a device (60 s)
  SPLAT_VALIDATION=1                run under the Khronos validation layer
  VK_DRIVER_FILES=FILE...           the Vulkan drivers to consider, listed as in PATH

'vkrun COMMAND --help' describes a command. Start with 'vkrun doctor'.
)";

std::string version_text() {
    return "vkrun " + std::to_string(SPLAT_VERSION_MAJOR) + "." +
           std::to_string(SPLAT_VERSION_MINOR) + "." + std::to_string(SPLAT_VERSION_PATCH) +
           " (libsplat " + splat_version_string() + ")";
}

void (*g_end)(int exit_code, const std::string& sentence) = nullptr;

int fail(int exit_code, const std::string& sentence) {
    std::fflush(stdout);
    if (g_end != nullptr) g_end(exit_code, sentence);
    print_failure(sentence);
    return exit_code;
}

int run_commands(int argc, char** argv, AddCommands add_commands) {
    int exit_code = kSuccess;
    bool verbose = false;
    std::uint32_t decode_scale = 1;
    CLI::App app(kAbout, "vkrun");
    app.set_version_flag("--version", version_text(), "Print the versions and exit");
    app.set_help_flag("-h,--help", "Print this text and exit");
    app.add_flag("-v,--verbose", verbose, "Show all messages of the library, not only warnings");
    add_count_option(app, kDecodeScaleOption, decode_scale,
                     "Multiply what a file may cost when it is read: 64 times its size\n"
                     "and 64 MiB of memory, 100 scans of a JPEG, 10^6 tensors",
                     1, 1000);
    app.require_subcommand(1);
    app.fallthrough();
    app.allow_windows_style_options(false);  // "/name" is a path on every system
    app.footer(kMainFooter);
    app.formatter(help_formatter());
    app.parse_complete_callback([&] {
        set_verbose(verbose);
        scale_decode_limits(decode_scale);
    });
    add_commands(app, exit_code);
    if (argc > 1 && std::string(argv[1]) == kCompleteOption) {
        std::fputs(candidates(app, {argv + 2, argv + argc}).c_str(), stdout);
        return kSuccess;
    }
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        const bool asks_for_text = error.get_exit_code() == 0;  // --help or --version
        if (asks_for_text && !has_unknown_command(app)) return app.exit(error);
        return fail(kUsageError, usage_sentence(app, error));
    }
    return exit_code;
}

}  // namespace

void on_failure(void (*end)(int exit_code, const std::string& sentence)) {
    g_end = end;
}

int run_program(int argc, char** argv, AddCommands add_commands) {
    splat::os::prepare_program();
    int exit_code = kFailed;
    try {
        exit_code = run_commands(argc, argv, add_commands);
    } catch (const Failure& failure) {
        exit_code = fail(failure.code(), failure.what());
    } catch (const std::filesystem::filesystem_error& error) {
        exit_code = fail(kFailed, "cannot use '" + splat::os::text_of(error.path1()) +
                                      "': " + error.code().message());
    } catch (const std::bad_alloc&) {
        exit_code = fail(kOutOfMemory, kOutOfMemorySentence);
    } catch (const std::length_error&) {  // a vector that no memory could hold
        exit_code = fail(kOutOfMemory, kOutOfMemorySentence);
    } catch (const std::exception& error) {
        exit_code = fail(kFailed, error.what());
    }
    const bool written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
    // A training that a closed pipe or terminal interrupts has nobody to tell.
    if (!written && exit_code != kInterrupted)
        return fail(kFailed, "cannot write to standard output");
    return exit_code;
}

}  // namespace vkrun
