#include "vkrun/data/open_data.h"

#include <algorithm>

#include "vkrun/config/image_channels.h"
#include "vkrun/data/transfer.h"

namespace vkrun {

void import_first(const std::string& folder, const std::string& format, const std::string& split) {
    if (!format.empty() && format != "tables") return;
    auto desc = sized<splat_dataset_import_desc>();
    desc.path = folder.c_str();
    desc.split = split.c_str();
    with_progress("importing " + split, [&](splat_progress_callback callback, void* user) {
        const splat_result result = splat_dataset_import(&desc, callback, user);
        // No tables, or no such split of them: opening the data set tells.
        return result == SPLAT_ERROR_NOT_FOUND ? SPLAT_OK : result;
    });
}

Dataset open_data(const Json& config, const std::string& root, const std::string& split) {
    const Json& data = config.at("data");
    const std::string folder = root.empty() ? data.at("root").get<std::string>() : root;
    if (folder.empty())
        throw Failure(kUsageError, "no data: name its folder with --data, or as data.root");
    const auto format = data.at("format").get<std::string>();
    const auto text_of = [&data](const char* key) {
        const auto& text = data.at(key).get_ref<const std::string&>();
        return text.empty() ? nullptr : text.c_str();
    };
    import_first(folder, format, split);
    auto desc = sized<splat_dataset_desc>();
    desc.category = text_of("category");
    desc.objects_file = text_of("objects_file");
    desc.excluded_file = text_of("excluded_file");
    desc.views_file = text_of("views_file");
    desc.flags = ImageChannels::of(config).flags();
    if (data.at("allow_missing").get<bool>()) desc.flags |= SPLAT_DATA_ALLOW_MISSING;
    desc.path = folder.c_str();
    desc.format = format.empty() ? nullptr : format.c_str();
    desc.split = split.c_str();
    desc.resolution = data.at("training_resolution");
    const auto subset = data.at("subset").get<std::int64_t>();
    desc.limit = subset > 0 ? static_cast<std::uint32_t>(subset) : 0;
    desc.cache_bytes = data.at("cache_mib").get<std::uint64_t>() << 20U;
    const bool white = data.at("white_background");
    std::fill_n(desc.background, 3, white ? 1.0F : 0.0F);
    Dataset dataset;
    if (splat_dataset_open(&desc, dataset.out()) != SPLAT_OK)
        throw Failure(kBadData, library_message());
    return dataset;
}

}  // namespace vkrun
