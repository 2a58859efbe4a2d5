// vkrun: the command line of libsplat. One cmd_<verb>.cpp per command.

#include <splat.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <numeric>

#include "vkrun/command.h"
#include "vkrun/objects.h"

namespace vkrun {
namespace {

constexpr const char* kAbout =
    "vkrun: libsplat on the command line.\n"
    "Results go to standard output, messages to standard error.";

constexpr const char* kMainFooter = R"(Exit status:
  0  success
  1  failure: a check failed, a result is wrong, a file cannot be written, or an error
     of the library
  2  wrong usage of the command line
  3  no Vulkan loader, no driver, or no usable device
  4  data that is missing, damaged or does not fit together
  5  out of memory, of the host or the device
  6  a comparison or a gate that was missed
  7  numbers that are not finite
  130  interrupted

Environment:
  SPLAT_KERNELS=auto|plain|cpu|gpu  which shaders run, on every device
  SPLAT_TIMEOUT_SCALE=X             multiplies every wait for a device (60 s)
  SPLAT_VALIDATION=1                run under the Khronos validation layer
  VK_DRIVER_FILES=FILE[:FILE]...    the Vulkan drivers that are considered

'vkrun COMMAND --help' tells more about a command. Start with 'vkrun doctor'.
)";

std::string version_text() {
    return "vkrun " + std::to_string(SPLAT_VERSION_MAJOR) + "." +
           std::to_string(SPLAT_VERSION_MINOR) + "." + std::to_string(SPLAT_VERSION_PATCH) +
           " (libsplat " + splat_version_string() + ")";
}

/// How many insertions, deletions and replacements of a letter lead from a to b.
std::size_t edit_distance(const std::string& a, const std::string& b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
        }
    }
    return row.back();
}

/// The words that could stand in the place of an unknown one: options or commands.
std::vector<std::string> words_of(const CLI::App& command, bool options) {
    std::vector<std::string> words;
    if (options)
        for (const CLI::Option* option : command.get_options())
            for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
    else
        for (const CLI::App* child : command.get_subcommands({}))
            words.push_back(child->get_name());
    return words;
}

/// The command that was being read when reading stopped.
const CLI::App& innermost(const CLI::App& app) {
    const std::vector<CLI::App*> chosen = app.get_subcommands();
    return chosen.empty() ? app : innermost(*chosen.back());
}

/// "vkrun bench ops"
std::string path_of(const CLI::App& command) {
    const CLI::App* parent = command.get_parent();
    return (parent != nullptr ? path_of(*parent) + " " : "") + command.get_name();
}

std::string usage_sentence(const CLI::App& app, const CLI::ParseError& error) {
    const CLI::App& command = innermost(app);
    const std::vector<std::string> unknown = app.remaining(true);
    if (unknown.empty() && error.get_name() == "RequiredError") {
        std::string names;
        for (const std::string& name : words_of(command, false))
            names += (names.empty() ? "" : ", ") + name;
        if (!names.empty()) return "a command is missing; there are: " + names;
    }
    if (unknown.empty()) return error.what();
    const std::string& word = unknown.front();
    const bool option = word.rfind('-', 0) == 0;
    std::string sentence =
        (option ? "unknown option '" : "unknown command or argument '") + word + "'";
    const std::string bare = word.substr(0, word.find('='));
    std::string nearest;
    std::size_t least = std::max<std::size_t>(2, bare.size() / 3) + 1;
    for (const std::string& candidate : words_of(command, option))
        if (const std::size_t distance = edit_distance(bare, candidate); distance < least) {
            least = distance;
            nearest = candidate;
        }
    if (!nearest.empty()) sentence += "; did you mean '" + nearest + "'?";
    return sentence;
}

int fail(int exit_code, const std::string& sentence) {
    std::fflush(stdout);
    std::fprintf(stderr, "vkrun: %s\n", sentence.c_str());
    return exit_code;
}

int run_main(int argc, char** argv) {
    int exit_code = kSuccess;
    bool verbose = false;
    CLI::App app(kAbout, "vkrun");
    app.set_version_flag("--version", version_text(), "Print the versions and exit");
    app.set_help_flag("-h,--help", "Print this text and exit");
    app.add_flag("-v,--verbose", verbose, "Show all messages of the library, not only warnings");
    app.require_subcommand(1);
    app.fallthrough();
    app.footer(kMainFooter);
    app.get_formatter()->column_width(28);
    app.get_formatter()->label("SUBCOMMAND", "COMMAND");
    app.parse_complete_callback([&verbose] { set_verbose(verbose); });
    add_devices(app, exit_code);
    add_doctor(app, exit_code);
    add_render(app, exit_code);
    add_inspect(app, exit_code);
    add_convert(app, exit_code);
    add_weights(app, exit_code);
    add_predict(app, exit_code);
    add_train(app, exit_code);
    add_config(app, exit_code);
    add_eval(app, exit_code);
    add_report(app, exit_code);
    add_data(app, exit_code);
    add_compare(app, exit_code);
    add_bench(app, exit_code);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return app.exit(error);  // --help and --version
        return fail(kUsageError, usage_sentence(app, error) + "\n       see '" +
                                     path_of(innermost(app)) + " --help'");
    }
    return exit_code;
}

}  // namespace
}  // namespace vkrun

int main(int argc, char** argv) {
    int exit_code = vkrun::kFailed;
    try {
        exit_code = vkrun::run_main(argc, argv);
    } catch (const vkrun::Failure& failure) {
        exit_code = vkrun::fail(failure.code(), failure.what());
    } catch (const std::filesystem::filesystem_error& error) {
        exit_code = vkrun::fail(vkrun::kFailed, "cannot use '" + error.path1().string() +
                                                    "': " + error.code().message());
    } catch (const std::exception& error) {
        exit_code = vkrun::fail(vkrun::kFailed, error.what());
    }
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
        return vkrun::fail(vkrun::kFailed, "cannot write to standard output");
    return exit_code;
}
