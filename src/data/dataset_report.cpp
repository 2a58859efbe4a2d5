#include "core/json.h"
#include "data/dataset.h"

namespace splat::data {

std::string report_text(const Dataset& dataset) {
    const DatasetIndex& index = dataset.index();
    std::string maps;
    for (const MapKind kind : kMaps)
        if ((index.maps & flag_of(kind)) != 0)
            maps += (maps.empty() ? "" : ", ") + json_quote(map_name(kind));
    std::string names;
    std::string views_of;
    std::uint64_t views = 0;
    for (std::size_t i = 0; i < index.names.size(); ++i) {
        names += (i == 0 ? "" : ", ") + json_quote(index.names[i]);
        views_of += (i == 0 ? "" : ", ") + std::to_string(index.views_of[i]);
        views += index.views_of[i];
    }
    return format(
               "{\"format\": %s, \"split\": %s, \"objects\": %zu, \"views\": %llu, \"resolution\": "
               "%u, "
               "\"stored_resolution\": %u, \"maps\": [",
               json_quote(index.format).c_str(), json_quote(index.split).c_str(),
               index.names.size(), static_cast<unsigned long long>(views), dataset.resolution(),
               index.resolution) +
           maps + "], \"names\": [" + names + "], \"views_of\": [" + views_of + "]}";
}

}  // namespace splat::data
