#include "vkrun/weights/published.h"

#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <vector>

#include "core/os/path.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/sha256.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

constexpr const char* kRepository =
    "https://huggingface.co/szymanowiczs/splatter-image-v1/resolve/main/";
constexpr const char* kUnknown = "not known";

/// Hash of LGM's model_fp16.safetensors from before its correction: its quaternions were normalised along the wrong
/// axis while it was trained, so that rotations are wrong here. The file of the name ..._fixrot is the right one.
constexpr const char* kLgmBeforeFix =
    "5a7ab3128a73dce6d2927d5c7c7ec79a7f7ca885fec960db86d991f272fe2e9d";

constexpr std::array kPublished = {
    PublishedWeights{"cars", "model_cars.pth", "677 MB",
                     "5f604bbab8dae0f2c984a6aab69744c1d07396a1f1b7388ea2c67901a7a41ace",
                     "cars of ShapeNet (SRN), 128 x 128 pixels"},
    PublishedWeights{"chairs", "model_chairs.pth", kUnknown, "",
                     "chairs of ShapeNet (SRN), 128 x 128 pixels"},
    PublishedWeights{"hydrants", "model_hydrants.pth", kUnknown, "", "hydrants of CO3D"},
    PublishedWeights{"teddybears", "model_teddybears.pth", kUnknown, "", "teddy bears of CO3D"},
    PublishedWeights{"nmr", "model_nmr.pth", kUnknown, "",
                     "13 categories of ShapeNet (NMR), 64 x 64 pixels"},
    PublishedWeights{"objaverse", "model_latest.pth", "677 MB",
                     "9f7aaf451fcbf655dc7ac2e1bd84751153957ac0b75eb7670b489bc88fd22832",
                     "objects of Objaverse-LVIS; also for Google Scanned Objects (gso)"},
};

}  // namespace

std::span<const PublishedWeights> published_weights() {
    return kPublished;
}

const PublishedWeights& published_weights(const std::string& name) {
    std::vector<std::string> names;
    std::string list;
    for (const PublishedWeights& one : kPublished) {
        if (name == one.name) return one;
        names.emplace_back(one.name);
        list += (list.empty() ? "" : ", ") + names.back();
    }
    const std::string nearest = nearest_word(name, names);
    throw Failure(kUsageError, "there are no published weights '" + name + "'" +
                                   (nearest.empty() ? "; there are: " + list
                                                    : "; did you mean '" + nearest + "'?"));
}

std::string published_address(const PublishedWeights& weights) {
    return std::string(kRepository) + weights.file;
}

std::string published_by_hash(const std::string& sha256) {
    for (const PublishedWeights& one : kPublished)
        if (!sha256.empty() && sha256 == one.sha256) return one.name;
    return "";
}

void warn_of_old_weights(const std::string& path) {
    constexpr std::uintmax_t kLeast = 829'000'000,
                             kMost = 832'000'000;  // bytes; hashing takes seconds
    std::error_code none;
    const std::uintmax_t bytes = std::filesystem::file_size(splat::os::path_of(path), none);
    if (none || bytes < kLeast || bytes > kMost) return;
    if (sha256_of_file(path) != kLgmBeforeFix) return;
    std::fprintf(
        stderr,
        "vkrun: warning: '%s' is LGM's model_fp16.safetensors from before its rotations were "
        "corrected: scenes will have wrong rotations; take model_fp16_fixrot.safetensors\n",
        path.c_str());
}

}  // namespace vkrun
