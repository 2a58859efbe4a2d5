// vkrun doctor: the machine without any device. Loader, driver files, environment, cache folder.

#include <filesystem>
#include <fstream>
#include <set>

#include "core/os/drivers.h"
#include "core/os/graphics.h"
#include "core/os/library.h"
#include "core/os/path.h"
#include "core/os/process.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/text.h"
#include "vkrun/doctor/doctor.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

/// The variable that chooses the drivers, in the order of the loader; null if none does.
const char* driver_variable() {
    for (const char* name : {"VK_DRIVER_FILES", "VK_ICD_FILENAMES"})
        if (variable(name)) return name;
    return nullptr;
}

std::set<fs::path> json_files_of(const fs::path& folder) {
    std::set<fs::path> files;
    std::error_code failed;
    for (auto it = fs::directory_iterator(folder, failed);
         !failed && it != fs::directory_iterator(); it.increment(failed))
        if (it->path().extension() == ".json") files.insert(it->path());
    return files;
}

std::set<fs::path> driver_files() {
    std::set<fs::path> files;
    const auto add = [&](const fs::path& path) {
        if (fs::is_directory(path))
            files.merge(json_files_of(path));
        else
            files.insert(path);
    };
    if (const char* name = driver_variable()) {
        for (const std::string& path : os::listed_paths(*variable(name))) add(os::path_of(path));
    } else {
        for (const std::string& path : os::vulkan_drivers()) files.insert(os::path_of(path));
    }
    if (const auto more = variable("VK_ADD_DRIVER_FILES"))
        for (const std::string& path : os::listed_paths(*more)) add(os::path_of(path));
    return files;
}

/// Why a driver cannot be loaded; empty if it can.
std::string driver_problem(const fs::path& file) {
    std::ifstream stream = open_to_read(file);
    if (!stream) return "the file cannot be read";
    const Json manifest = Json::parse(stream, nullptr, false);
    if (!manifest.is_object() || !manifest.contains("ICD") || !manifest["ICD"].is_object() ||
        !manifest["ICD"].contains("library_path") || !manifest["ICD"]["library_path"].is_string())
        return "the file is not a driver description";
    fs::path library = os::path_of(manifest["ICD"]["library_path"].get<std::string>());
    if (library.has_parent_path() && library.is_relative()) library = file.parent_path() / library;
    std::string reason;
    return os::load_library(os::text_of(library), reason, true) != nullptr ? "" : reason;
}

Finding driver_trouble(const std::set<fs::path>& files, const std::string& problems,
                       bool have_device) {
    Finding finding{"drivers", have_device ? State::kWarning : State::kError, problems, ""};
    const char* chosen = driver_variable();
    if (chosen != nullptr)
        finding.remedy = std::string("unset ") + chosen + " or correct it; without a driver, " +
                         os::install_driver();
    else if (files.empty())
        finding.remedy = os::install_driver();
    else
        finding.remedy = os::reinstall_driver();
    return finding;
}

}  // namespace

std::optional<std::string> variable(const char* name) {
    auto value = os::variable(name);
    return value && !value->empty() ? value : std::nullopt;
}

Findings check_library() {
    const Json build = Json::parse(splat_build_info(), nullptr, false);
    std::string words = std::string("libsplat ") + splat_version_string();
    if (build.is_object()) {
        words += ", built by compiler " + build.value("compiler", "?");
        if (build.value("assertions", false)) words += ", with assertions";
        if (build.value("fault_points", false)) words += ", with fault points";
    }
    if (splat_version() != SPLAT_VERSION)
        return {{"library", State::kWarning,
                 words + format("; vkrun was built for %d.%d.%d", SPLAT_VERSION_MAJOR,
                                SPLAT_VERSION_MINOR, SPLAT_VERSION_PATCH),
                 "install vkrun and libsplat from one build; see LD_LIBRARY_PATH"}};
    return {{"library", State::kOk, words, ""}};
}

Findings check_loader() {
    std::string reason;
    if (os::load_library(os::vulkan_loader(), reason, true) != nullptr)
        return {
            {"loader", State::kOk, "the Vulkan loader " + os::vulkan_loader() + " is there", ""}};
    return {{"loader", State::kError, "the Vulkan loader cannot be loaded: " + reason,
             os::install_loader()}};
}

Findings check_drivers(bool have_device) {
    const std::set<fs::path> files = driver_files();
    if (files.empty()) return {driver_trouble(files, "there is no driver file", have_device)};
    std::string names;
    std::string problems;
    for (const fs::path& file : files) {
        const std::string problem = driver_problem(file);
        std::string& list = problem.empty() ? names : problems;
        list += (list.empty() ? "" : problem.empty() ? ", " : "; ") + os::text_of(file.filename());
        if (!problem.empty()) list += ": " + problem;
    }
    Findings findings;
    if (!names.empty()) {
        const char* chosen = driver_variable();
        const std::string by = chosen != nullptr ? std::string(" (chosen by ") + chosen + ")" : "";
        findings.push_back({"drivers", State::kOk, "drivers found: " + names + by, ""});
    }
    if (!problems.empty())
        findings.push_back(
            driver_trouble(files, "drivers that cannot be loaded: " + problems, have_device));
    return findings;
}

Findings check_gpu_nodes(const std::vector<splat_device_info>& devices) {
    for (const splat_device_info& info : devices)
        if (info.kind != SPLAT_DEVICE_KIND_CPU) return {};
    const std::vector<os::Gpu> gpus = os::gpus();
    if (gpus.empty()) return {};
    const std::string& name = gpus.front().name;
    if (!gpus.front().may_open)
        return {{"gpu", State::kWarning,
                 "there is a GPU, " + name + ", which this user may not open",
                 "`adduser USER render`, then log in again"}};
    const char* const kind = name == "/dev/nvidiactl" ? "an NVIDIA GPU, " : "a GPU, ";
    return {{"gpu", State::kWarning,
             std::string("there is ") + kind + name + ", but no Vulkan driver shows it",
             os::install_driver()}};
}

Findings check_environment() {
    std::string words;
    for (const char* name :
         {"SPLAT_KERNELS", "SPLAT_MAX_SUBMIT_MS", "SPLAT_SELF_TEST", "SPLAT_TIMEOUT_SCALE",
          "SPLAT_VALIDATION", "VK_DRIVER_FILES", "VK_ICD_FILENAMES", "VK_ADD_DRIVER_FILES",
          "VK_LOADER_DRIVERS_SELECT", "VK_LOADER_DRIVERS_DISABLE", "VK_INSTANCE_LAYERS",
          "VK_LAYER_PATH", "NODEVICE_SELECT", "MESA_VK_DEVICE_SELECT", "LP_NUM_THREADS"})
        if (const auto value = variable(name))
            words += (words.empty() ? "" : ", ") + std::string(name) + "=" + *value;
    if (words.empty())
        return {{"environment", State::kOk, "no variable changes what libsplat or Vulkan do", ""}};
    if (variable("SPLAT_VALIDATION").value_or("0") != "0" || variable("VK_INSTANCE_LAYERS"))
        return {{"environment", State::kWarning, "set: " + words + "; layers make everything slow",
                 "unset SPLAT_VALIDATION and VK_INSTANCE_LAYERS unless you are debugging"}};
    return {{"environment", State::kOk, "set: " + words, ""}};
}

Findings check_cache_folder() {
    const std::string remedy = os::name_cache();
    const std::string effect = "; every process compiles its pipelines again";
    const auto cache = os::cache_folder();
    if (!cache) return {{"cache", State::kWarning, os::no_cache() + effect, remedy}};
    const fs::path folder = os::path_of(*cache) / "libsplat";
    std::error_code failed;
    fs::create_directories(folder, failed);
    const fs::path probe =
        folder / os::path_of("doctor." + std::to_string(os::process_id()) + ".tmp");
    std::ofstream file(probe);
    file << "probe\n";
    file.close();
    const bool written = !file.fail();
    fs::remove(probe, failed);
    if (!written)
        return {{"cache", State::kWarning,
                 "the pipeline cache folder " + os::text_of(folder) + " cannot be written" + effect,
                 remedy}};
    return {{"cache", State::kOk,
             "the pipeline cache folder " + os::text_of(folder) + " can be written", ""}};
}

}  // namespace vkrun
