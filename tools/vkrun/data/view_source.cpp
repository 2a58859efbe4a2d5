#include "vkrun/data/view_source.h"

#include <algorithm>

namespace vkrun {

ViewSource::ViewSource(const Json& config, const std::string& root, const std::string& split) {
    const Json& data = config.at("data");
    const std::string folder = root.empty() ? data.at("root").get<std::string>() : root;
    if (folder.empty())
        throw Failure(kUsageError, "no data: name its folder with --data, or as data.root");
    const auto format = data.at("format").get<std::string>();
    auto desc = sized<splat_dataset_desc>();
    desc.flags = ImageChannels::of(config).flags();
    desc.path = folder.c_str();
    desc.format = format.empty() ? nullptr : format.c_str();
    desc.split = split.c_str();
    desc.resolution = resolution_ = data.at("training_resolution");
    const auto subset = data.at("subset").get<std::int64_t>();
    desc.limit = subset > 0 ? static_cast<std::uint32_t>(subset) : 0;
    desc.cache_bytes = data.at("cache_mib").get<std::uint64_t>() << 20U;
    const bool white = data.at("white_background");
    std::fill_n(desc.background, 3, white ? 1.0F : 0.0F);
    if (splat_dataset_open(&desc, dataset_.out()) != SPLAT_OK)
        throw Failure(kBadData, splat_last_error_message());
    report_ = library_json(splat_dataset_report, dataset_.get());
    names_ = report_.at("names").get<std::vector<std::string>>();
    views_ = report_.at("views_of").get<std::vector<std::uint32_t>>();
}

Views ViewSource::read(std::uint32_t object, const std::vector<std::uint32_t>& numbers,
                       std::uint32_t inputs, const ImageChannels& channels) const {
    const std::size_t n = numbers.size();
    const std::size_t pixels = std::size_t{resolution_} * resolution_;
    Views views;
    views.images.resize(n * 3 * pixels);
    views.view_to_world.resize(16 * n);
    views.quaternions.resize(4 * n);
    views.focals.resize(2 * n);
    std::vector<float> depths(channels.depth ? n * pixels : 0);
    std::vector<float> normals(channels.normal ? n * 3 * pixels : 0);
    std::vector<float> masks(channels.mask ? n * pixels : 0);
    std::vector<float> distances(n);
    const auto wanted = [](std::vector<float>& values) {
        return values.empty() ? nullptr : values.data();
    };
    auto out = sized<splat_dataset_views>();
    out.images = views.images.data();
    out.depths = wanted(depths);
    out.normals = wanted(normals);
    out.masks = wanted(masks);
    out.view_to_world = views.view_to_world.data();
    out.quaternions = views.quaternions.data();
    out.focals = views.focals.data();
    out.origin_distances = distances.data();
    if (splat_dataset_read(dataset_.get(), object, numbers.data(), static_cast<std::uint32_t>(n),
                           &out) != SPLAT_OK)
        throw Failure(kBadData, splat_last_error_message());

    for (std::size_t i = 0; i < inputs; ++i) {
        const auto append = [&](const std::vector<float>& planes, std::size_t count) {
            const auto from = planes.begin() + static_cast<std::ptrdiff_t>(i * count * pixels);
            views.inputs.insert(views.inputs.end(), from,
                                from + static_cast<std::ptrdiff_t>(count * pixels));
        };
        append(views.images, 3);
        if (channels.depth) append(depths, 1);
        if (channels.normal) append(normals, 3);
        if (channels.mask) append(masks, 1);
        if (channels.origin_distance) views.inputs.insert(views.inputs.end(), pixels, distances[i]);
    }
    for (std::size_t i = 0; i < n; ++i) {
        splat_camera camera{};
        camera.width = camera.height = resolution_;
        camera.fx = static_cast<double>(views.focals[2 * i]);
        camera.fy = static_cast<double>(views.focals[2 * i + 1]);
        camera.cx = camera.cy = resolution_ / 2.0;
        const auto pose = inverse_pose(views.view_to_world.data() + 16 * i);
        std::copy(pose.begin(), pose.end(), camera.world_to_camera);
        views.cameras.push_back(camera);
    }
    return views;
}

std::array<double, 16> inverse_pose(const float* m) {
    std::array<double, 16> pose{};
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column) {
            // Row vectors: m is the transpose of the camera-to-world rotation, that is, its inverse.
            const auto r = static_cast<double>(m[4 * row + column]);
            pose[4 * row + column] = r;
            pose[4 * row + 3] -= r * static_cast<double>(m[12 + column]);
        }
    }
    pose[15] = 1;
    return pose;
}

}  // namespace vkrun
