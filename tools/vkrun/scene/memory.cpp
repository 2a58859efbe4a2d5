#include "vkrun/scene/memory.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/os/memory.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/text.h"
#include "vkrun/scene/scene_file.h"

namespace vkrun {
namespace {

/// What a process has besides scenes: its libraries, and a driver that compiles kernels.
constexpr double kBesides = 64 << 20;
constexpr double kDriver = 160 << 20;

struct Size {
    double count, coefficients, file;
    bool merged = false, edited = false;
    std::string from, to;  ///< files; nothing: it is not written

    /// Bytes of a Gaussian, and of one in a packed format.
    [[nodiscard]] double gaussian() const { return 4 * (11 + 3 * coefficients); }
    [[nodiscard]] double packed() const { return 20 + 3 * (coefficients - 1); }
};

/// What writers hold besides the scene: copies of it, its packed arrays, and other bytes of each Gaussian.
struct Writing {
    const char* extension;
    double copies, packed, bytes;
};
constexpr Writing kWriting[] = {
    {".compressed.ply", 1, 1, 48},  // the places of a Morton order, too
    {".spz", 0, 1, 0},
    {".gltf", 3.4, 0, 12},  // arrays, and those in base64
    {".glb", 1, 0, 12},
    {".sog", 2, 0, 64},
};

/// While a scene is read or written. Files of plain arrays are given back as they are read; others are beside their
/// arrays and the Gaussians. Merging holds the parts beside the whole; other edits hold the scene before and after.
double host_bytes(const Size& scene) {
    const double gaussians = scene.count * scene.gaussian();
    const bool plain =
        scene.from.ends_with(".splat") || (scene.from.ends_with(".ply") && scene.file >= gaussians);
    double reading = scene.file + gaussians + scene.count * scene.packed();
    if (plain) reading = std::max(scene.file, gaussians);
    // Numbers lie in files beside it, or in base64.
    if (scene.from.ends_with(".gltf"))
        reading = scene.file + scene.count * (2 * scene.gaussian() + 8);
    if (scene.merged) reading = scene.file + 2 * gaussians;
    double writing = scene.edited ? 2 * gaussians : gaussians;
    for (const Writing& format : kWriting)
        if (scene.to.ends_with(format.extension))
            writing = std::max(writing,
                               (1 + format.copies) * gaussians +
                                   scene.count * (format.packed * scene.packed() + format.bytes));
    return kBesides + std::max(reading, writing);
}

/// While a CPU, whose bindings hold so many bytes, draws: the scene, the set, what the rasterizer has of each
/// Gaussian and of four pairs with a tile (src/raster/workspace.cpp). Beyond a binding, the scene's Gaussians of a
/// band, gathered.
double drawing_bytes(const Size& scene, double binding) {
    constexpr double kItem = 102, kPairs = 4 * 18, kReach = 4, kIndex = 8;
    const double gaussian = scene.gaussian();
    const double set = 16 * (3 + std::ceil(3 * scene.coefficients / 4));
    const double drawn = std::min(scene.count, binding / 48);
    const double gathered = drawn < scene.count ? gaussian + kIndex : 0;
    return kBesides + kDriver + scene.count * (gaussian + kReach) +
           drawn * (set + kItem + kPairs + gathered);
}

std::string lower_case(std::string text) {
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

/// Bytes that the system gives without swapping; infinite where it does not say.
double available_bytes() {
    const std::uint64_t bytes = splat::os::machine_bytes_left();
    return bytes == 0 ? HUGE_VAL : static_cast<double>(bytes);
}

/// Bytes of a binding of the named device, if that is a CPU; else 0.
double cpu_binding(const std::string& name) {
    const splat_device_desc desc = device_desc(name);
    const auto devices = all_devices();
    const auto best = best_device(devices);
    for (std::size_t i = 0; i < devices.size(); ++i) {
        const splat_device_info& info = devices[i];
        const bool named = desc.select == SPLAT_SELECT_BY_INDEX  ? info.index == desc.index
                           : desc.select == SPLAT_SELECT_BY_KIND ? info.kind == desc.kind
                           : desc.select == SPLAT_SELECT_BY_UUID
                               ? std::equal(desc.uuid, desc.uuid + 16, info.uuid)
                               : best == i;
        if (named && info.kind == SPLAT_DEVICE_KIND_CPU)
            return static_cast<double>(info.max_storage_buffer_bytes);
    }
    return 0;
}

}  // namespace

void add_memory_option(CLI::App& command, std::uint64_t& bytes) {
    const CLI::Validator size(
        [](std::string& text) {
            const bool none = text.find_first_not_of('0') == text.npos;
            return none || text[0] == '-' ? "is '" + text + "', expected a size such as 800M or 2G"
                                          : std::string();
        },
        "");
    command
        .add_option("--memory", bytes,
                    "Memory that may be taken, such as 800M or 2G; a scene that\nneeds more is "
                    "refused. Default: what the system has available")
        ->type_name("BYTES")
        ->transform(CLI::AsSizeValue(false).description(""))
        ->transform(size);
}

void check_memory(const std::string& path, const splat_scene_file_desc& desc, std::uint64_t allowed,
                  const SceneUse& use) {
    std::vector<std::string> files = {path};
    files.insert(files.end(), use.merged.begin(), use.merged.end());
    std::uint64_t count = 0;
    std::uint32_t degree = use.sh_degree > 0 ? static_cast<std::uint32_t>(use.sh_degree) : 0;
    std::uint64_t bytes = 0;
    for (const std::string& file : files) {
        std::uint64_t count_here = 0;
        std::uint32_t degree_here = 0;
        if (splat_scene_peek(file.c_str(), &desc, &count_here, &degree_here) != SPLAT_OK) return;
        count += count_here;
        degree = std::max(degree, degree_here);
        bytes = std::max(bytes, scene_bytes(file));
    }
    const Size scene{static_cast<double>(count),
                     std::pow(degree + 1, 2),
                     static_cast<double>(bytes),
                     !use.merged.empty(),
                     use.edited,
                     lower_case(path),
                     lower_case(use.written)};
    const double most = allowed != 0 ? static_cast<double>(allowed) : available_bytes();
    double needed = host_bytes(scene);
    if (!use.device.empty() && drawing_bytes(scene, HUGE_VAL) > most) {
        const double binding = cpu_binding(use.device);
        if (binding > 0) needed = std::max(needed, drawing_bytes(scene, binding));
    }
    if (needed <= most) return;
    constexpr double kMiB = 1 << 20;
    throw Failure(
        kBadData,
        format(
            "'%s'%s has %llu Gaussians of degree %u, which take about %.0f MiB of memory, but %.0f "
            "MiB %s; --memory %.0fM does it nevertheless",
            path.c_str(), use.merged.empty() ? "" : " with those to --merge",
            static_cast<unsigned long long>(count), degree, needed / kMiB, most / kMiB,
            allowed != 0 ? "are allowed by --memory" : "are available", std::ceil(needed / kMiB)));
}

}  // namespace vkrun
