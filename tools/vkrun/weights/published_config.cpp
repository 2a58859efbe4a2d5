#include "vkrun/weights/published_config.h"

#include <algorithm>
#include <vector>

#include "vkrun/cli/json.h"
#include "vkrun/cli/sha256.h"
#include "vkrun/weights/published.h"

namespace vkrun {

PublishedConfig published_config(const std::string& path, splat_weights weights) {
    const Json published = library_json(splat_weights_report, weights).at("published");
    const auto names = published.at("fit").get<std::vector<std::string>>();
    PublishedConfig found{"", published.at("sentence")};
    if (names.size() == 1) found.name = names[0];
    if (names.size() < 2) return found;
    const std::string name = published_by_hash(sha256_of_file(path));
    if (std::find(names.begin(), names.end(), name) != names.end()) found.name = name;
    return found;
}

}  // namespace vkrun
