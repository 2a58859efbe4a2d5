#include "vkrun/eval/shard_merge.h"

#include <cstdio>
#include <filesystem>
#include <limits>

#include "core/os/path.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

constexpr const char* kObjectsFile = "/objects.json";
constexpr const char* kSettingsFile = "/settings.json";

/// Throws a Failure unless the shard of this folder was scored with `expected`, the settings of shard `merging`.
void check_settings(const std::string& folder, std::uint32_t merging, const Json& expected) {
    const std::string path = folder + kSettingsFile;
    const Json found = std::filesystem::exists(splat::os::path_of(path))
                           ? Json::parse(read_text(path), nullptr, false)
                           : Json::object();
    for (const auto& [key, value] : expected.items()) {
        if (!found.is_object() || !found.contains(key))
            throw Failure(kBadData, "'" + path + "' has no " + key + ": score that shard again");
        if (found.at(key) == value) continue;
        throw Failure(kBadData, "'" + folder + "' has scores of " + key + " " +
                                    found.at(key).dump() + ", expected " + value.dump() +
                                    format(" as in shard %u: score them all with the same "
                                           "options, or choose another --out",
                                           merging));
    }
}

}  // namespace

bool merge_shards(const std::string& out, const Shard& shard, const Json& settings,
                  splat_evaluator evaluator) {
    const auto folder_of = [&](std::uint32_t index) {
        return out + format("/shard_%u_of_%u", index, shard.count);
    };
    const std::string own = folder_of(shard.index);
    make_folder(own);
    std::error_code none;
    std::filesystem::remove(splat::os::path_of(own + kObjectsFile),
                            none);  // left by earlier settings
    replace_file(own + kSettingsFile, settings.dump(2) + "\n");
    check(splat_evaluator_save(evaluator, own.c_str()));
    std::string missing;
    for (std::uint32_t i = 0; i < shard.count; ++i)
        if (!std::filesystem::exists(splat::os::path_of(folder_of(i) + kObjectsFile)))
            missing += format(missing.empty() ? "%u" : ", %u", i);
    if (!missing.empty()) {
        std::fprintf(stderr, "note: shard %u of %u is scored; not yet: %s\n", shard.index,
                     shard.count, missing.c_str());
        return false;
    }
    for (std::uint32_t i = 0; i < shard.count; ++i) {
        if (i == shard.index) continue;
        check_settings(folder_of(i), shard.index, settings);
        check(splat_evaluator_load(evaluator, folder_of(i).c_str()), kBadData);
    }
    return true;
}

std::vector<ObjectRow> saved_rows(const std::string& folder) {
    const Json saved = Json::parse(read_text(folder + kObjectsFile));
    std::vector<ObjectRow> rows;
    for (const Json& object : saved.at("objects")) {
        const auto number = [&object](const char* key) {
            const Json& value = object.at(key);
            return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
        };
        rows.push_back({static_cast<std::uint32_t>(rows.size()), object.at("object"),
                        number("psnr_novel"), number("ssim_novel"), number("psnr_cond")});
    }
    return rows;
}

}  // namespace vkrun
