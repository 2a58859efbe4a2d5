// vkrun doctor: the machine without any device. Loader, driver files, environment, cache folder.

#include <dlfcn.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "vkrun/cli/files.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/text.h"
#include "vkrun/doctor/doctor.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;

constexpr const char* kInstallDrivers =
    "install a driver: on Debian `apt-get install mesa-vulkan-drivers` (AMD, Intel, and lavapipe, "
    "by software) or `apt-get install nvidia-vulkan-icd` (NVIDIA, from non-free), elsewhere the "
    "same of the system's packages, on a Mac MoltenVK";

std::vector<std::string> split(const std::string& text) {
    std::vector<std::string> parts;
    std::string part;
    for (const char c : text + ":") {
        if (c != ':') {
            part += c;
        } else if (!part.empty()) {
            parts.push_back(part);
            part.clear();
        }
    }
    return parts;
}

/// The variable that chooses the drivers, in the order of the loader; null if none does.
const char* driver_variable() {
    for (const char* name : {"VK_DRIVER_FILES", "VK_ICD_FILENAMES"})
        if (variable(name)) return name;
    return nullptr;
}

/// Where the loader looks for driver files by default.
std::vector<fs::path> driver_folders() {
    std::vector<std::string> roots;
    const auto add = [&](const std::vector<std::string>& more) {
        roots.insert(roots.end(), more.begin(), more.end());
    };
    const std::string home = variable("HOME").value_or("");
    add({variable("XDG_CONFIG_HOME").value_or(home + "/.config")});
    add(split(variable("XDG_CONFIG_DIRS").value_or("/etc/xdg")));
    add({"/etc", variable("XDG_DATA_HOME").value_or(home + "/.local/share")});
    add(split(variable("XDG_DATA_DIRS").value_or("/usr/local/share:/usr/share")));
    std::vector<fs::path> folders(roots.begin(), roots.end());
    for (fs::path& folder : folders) folder /= "vulkan/icd.d";
    return folders;
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
        for (const std::string& path : split(*variable(name))) add(path);
    } else {
        for (const fs::path& folder : driver_folders()) files.merge(json_files_of(folder));
    }
    if (const auto more = variable("VK_ADD_DRIVER_FILES"))
        for (const std::string& path : split(*more)) add(path);
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
    fs::path library = manifest["ICD"]["library_path"].get<std::string>();
    if (library.has_parent_path() && library.is_relative()) library = file.parent_path() / library;
    // Not closed: the loader opens it again.
    if (dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL) != nullptr) return {};
    const char* reason = dlerror();
    return reason != nullptr ? reason : "its library cannot be loaded";
}

Finding driver_trouble(const std::set<fs::path>& files, const std::string& problems,
                       bool have_device) {
    Finding finding{"drivers", have_device ? State::kWarning : State::kError, problems, ""};
    const char* chosen = driver_variable();
    if (chosen != nullptr)
        finding.remedy =
            std::string("unset ") + chosen + " or correct it; without a driver, " + kInstallDrivers;
    else if (files.empty())
        finding.remedy = kInstallDrivers;
    else
        finding.remedy =
            "reinstall the package of these files (`dpkg -S FILE` names it), for Mesa's `apt-get "
            "install --reinstall mesa-vulkan-drivers`; remove files whose package is gone";
    return finding;
}

}  // namespace

std::optional<std::string> variable(const char* name) {
    const char* value = std::getenv(name);
    if (value == nullptr || *value == '\0') return std::nullopt;
    return std::string(value);
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
    if (dlopen("libvulkan.so.1", RTLD_LAZY | RTLD_LOCAL) != nullptr)
        return {{"loader", State::kOk, "the Vulkan loader libvulkan.so.1 is there", ""}};
    const char* reason = dlerror();
    return {{"loader", State::kError,
             std::string("the Vulkan loader cannot be loaded: ") +
                 (reason != nullptr ? reason : "libvulkan.so.1"),
             "`apt-get install libvulkan1`"}};
}

Findings check_drivers(bool have_device) {
    const std::set<fs::path> files = driver_files();
    if (files.empty()) return {driver_trouble(files, "there is no driver file", have_device)};
    std::string names;
    std::string problems;
    for (const fs::path& file : files) {
        const std::string problem = driver_problem(file);
        std::string& list = problem.empty() ? names : problems;
        list += (list.empty() ? "" : problem.empty() ? ", " : "; ") + file.filename().string();
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
    std::error_code failed;
    for (auto it = fs::directory_iterator("/dev/dri", failed);
         !failed && it != fs::directory_iterator(); it.increment(failed)) {
        const std::string name = it->path().filename().string();
        if (name.rfind("renderD", 0) != 0) continue;
        if (access(it->path().c_str(), R_OK | W_OK) != 0)
            return {{"gpu", State::kWarning,
                     "there is a GPU, /dev/dri/" + name + ", which this user may not open",
                     "`adduser USER render`, then log in again"}};
        return {{"gpu", State::kWarning,
                 "there is a GPU, /dev/dri/" + name + ", but no Vulkan driver shows it",
                 kInstallDrivers}};
    }
    if (fs::exists("/dev/nvidiactl", failed))
        return {{"gpu", State::kWarning,
                 "there is an NVIDIA GPU, /dev/nvidiactl, but no Vulkan driver shows it",
                 kInstallDrivers}};
    return {};
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
    const std::string remedy = "set XDG_CACHE_HOME to a folder that can be written";
    const std::string effect = "; every process compiles its pipelines again";
    fs::path folder;
    if (const auto cache = variable("XDG_CACHE_HOME"); cache && fs::path(*cache).is_absolute())
        folder = fs::path(*cache) / "libsplat";
    else if (const auto home = variable("HOME"))
        folder = fs::path(*home) / ".cache/libsplat";
    else
        return {
            {"cache", State::kWarning, "neither XDG_CACHE_HOME nor HOME is set" + effect, remedy}};
    std::error_code failed;
    fs::create_directories(folder, failed);
    const fs::path probe = folder / format("doctor.%d.tmp", static_cast<int>(getpid()));
    std::ofstream file(probe);
    file << "probe\n";
    file.close();
    const bool written = !file.fail();
    fs::remove(probe, failed);
    if (!written)
        return {{"cache", State::kWarning,
                 "the pipeline cache folder " + folder.string() + " cannot be written" + effect,
                 remedy}};
    return {{"cache", State::kOk,
             "the pipeline cache folder " + folder.string() + " can be written", ""}};
}

}  // namespace vkrun
