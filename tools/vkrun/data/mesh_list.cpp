#include "vkrun/data/mesh_list.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <set>

#include "core/os/path.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/path_name.h"
#include "vkrun/cli/sha256.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

bool is_mesh_file(const fs::path& path) {
    const std::set<std::string> extensions = {".obj", ".glb", ".gltf"};
    return extensions.count(extension_of(path)) != 0;
}

std::string name_of(const fs::path& file) {
    const std::set<std::string> of_nothing = {"model", "model_normalized", "scene"};
    std::error_code failed;
    fs::path whole = fs::absolute(file, failed).lexically_normal();
    std::string stem = os::text_of(whole.stem());
    if (of_nothing.count(stem) == 0) return PathName(stem).text();
    fs::path folder = whole.parent_path();
    if (folder.filename() == "models") folder = folder.parent_path();
    const std::string name = os::text_of(folder.filename());
    return PathName(name.empty() ? stem : name).text();
}

void add_folder(const fs::path& folder, std::vector<fs::path>& files) {
    std::error_code failed;
    const auto links = fs::directory_options::follow_directory_symlink;
    for (fs::recursive_directory_iterator entry(folder, links, failed), end;
         !failed && entry != end; entry.increment(failed)) {
        const bool hidden = os::text_of(entry->path().filename()).rfind('.', 0) == 0;
        std::error_code none;
        if (entry->is_directory(none)) {
            if (hidden) entry.disable_recursion_pending();
        } else if (!hidden && is_mesh_file(entry->path())) {
            files.push_back(entry->path());
        }
    }
    if (failed)
        throw Failure(kBadData,
                      "cannot read the folder '" + os::text_of(folder) + "': " + failed.message());
}

/// Where a name comes in the order that is dealt.
std::string rank_of(const std::string& name, std::uint64_t seed) {
    const std::string text = std::to_string(seed) + "\n" + name;
    Sha256 hash;
    hash.add(text.data(), text.size());
    return hash.text();
}

/// How many of `count` go to each split.
std::array<std::size_t, 3> parts_of(std::size_t count, const std::array<double, 3>& shares) {
    const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
    std::array<std::size_t, 3> parts{};
    for (std::size_t k = 0; k < 3; ++k) {
        const double part = std::round(shares[k] / sum * static_cast<double>(count));
        parts[k] = shares[k] > 0 ? std::max<std::size_t>(static_cast<std::size_t>(part), 1) : 0;
    }
    const auto total = [&parts] { return parts[0] + parts[1] + parts[2]; };
    while (total() < count) ++*std::max_element(parts.begin(), parts.end());
    while (total() > count) {
        std::size_t& most = *std::max_element(parts.begin(), parts.end());
        if (most > 1)
            --most;
        else  // there are as many meshes as splits or fewer
            *std::find(parts.rbegin(), parts.rend(), 1U) = 0;
    }
    return parts;
}

}  // namespace

std::vector<MeshFile> find_meshes(const std::vector<std::string>& from) {
    std::vector<fs::path> files;
    for (const std::string& text : from) {
        const fs::path path = os::path_of(text);
        std::error_code none;
        if (fs::is_directory(path, none))
            add_folder(path, files);
        else if (!fs::exists(path, none))
            throw Failure(kBadData, "there is no '" + text + "'");
        else if (!is_mesh_file(path))
            throw Failure(kUsageError, "'" + text + "' is no mesh, expected .obj, .glb or .gltf");
        else
            files.push_back(path);
    }
    if (files.empty())
        throw Failure(kBadData, "no .obj, .glb or .gltf is in '" + from.front() + "'" +
                                    (from.size() > 1 ? " and the others" : ""));
    std::map<std::string, MeshFile> by_name;
    for (const fs::path& file : files) {
        const MeshFile mesh{os::text_of(file), name_of(file), "train"};
        const auto [other, is_new] = by_name.emplace(os::one_name(mesh.name), mesh);
        if (!is_new && other->second.path != mesh.path)
            throw Failure(kUsageError, "'" + other->second.path + "' and '" + mesh.path +
                                           "' would both be the object '" + mesh.name +
                                           "': give one of them, or rename it");
    }
    std::vector<MeshFile> meshes;
    for (auto& [key, mesh] : by_name) meshes.push_back(std::move(mesh));
    return meshes;
}

void deal_meshes(std::vector<MeshFile>& meshes, const std::array<double, 3>& shares,
                 std::uint64_t seed) {
    const std::array<std::size_t, 3> parts = parts_of(meshes.size(), shares);
    std::vector<std::pair<std::string, std::size_t>> order;
    for (std::size_t i = 0; i < meshes.size(); ++i)
        order.emplace_back(rank_of(meshes[i].name, seed), i);
    std::sort(order.begin(), order.end());
    for (std::size_t i = 0; i < order.size(); ++i)
        meshes[order[i].second].split = i < parts[0]              ? "train"
                                        : i < parts[0] + parts[1] ? "val"
                                                                  : "test";
}

}  // namespace vkrun
