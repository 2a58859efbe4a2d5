#include "vkrun/train/network.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "vkrun/command.h"

namespace vkrun {
namespace {

/// Images per call of the rasterizer: few calls, and little memory.
constexpr std::uint32_t kDrawnAtOnce = 16;

/// [n,R,R,3] as the rasterizer gives them to [n,3,R,R].
void planes_of(const std::vector<float>& pixels, std::size_t count, std::size_t side,
               std::vector<float>& images) {
    const std::size_t area = side * side;
    const std::size_t start = images.size();
    images.resize(start + count * 3 * area);
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t p = 0; p < area; ++p)
            for (std::size_t c = 0; c < 3; ++c)
                images[start + (3 * i + c) * area + p] = pixels[3 * (i * area + p) + c];
}

}  // namespace

Json merged_config(const std::string& path, const std::vector<std::string>& changes) {
    std::string text;
    if (!path.empty()) {
        std::ifstream file(path);
        std::ostringstream all;
        all << file.rdbuf();
        if (!file) throw Failure(kUsageError, "cannot read the configuration '" + path + "'");
        text = all.str();
    }
    std::vector<const char*> values;
    for (const std::string& change : changes) values.push_back(change.c_str());
    std::size_t needed = 0;
    const char* const from = path.empty() ? nullptr : text.c_str();
    const splat_result result =
        splat_config_merge(from, values.data(), values.size(), nullptr, 0, &needed);
    if (result != SPLAT_INCOMPLETE)
        throw Failure(kUsageError, (path.empty() ? "" : path + ": ") + splat_last_error_message());
    std::string merged(needed, '\0');
    check(splat_config_merge(from, values.data(), values.size(), merged.data(), needed, nullptr));
    return Json::parse(merged.c_str());
}

std::string config_beside(const std::string& weights, const std::string& given) {
    if (!given.empty()) return given;
    const std::filesystem::path folder = std::filesystem::path(weights).parent_path();
    for (const char* name : {"config.json", "config.yaml"})
        if (std::filesystem::exists(folder / name)) return (folder / name).string();
    throw Failure(kUsageError, "no config.json or config.yaml beside '" + weights +
                                   "': name the configuration with --config");
}

Network::Network(splat_device device, const Json& config)
    : device_(device), channels_(ImageChannels::of(config)) {
    const Json& data = config.at("data");
    views_ = data.at("input_images");
    resolution_ = data.at("training_resolution");
    sh_degree_ = config.at("model").at("max_sh_degree");
    if (!data.at("white_background").get<bool>()) std::fill_n(background_, 3, 0.0F);
    const std::string text = config.dump();
    auto desc = sized<splat_model_desc>();
    desc.config = text.c_str();
    const auto precision = config.at("general").at("precision").get<std::string>();
    desc.precision = precision == "strict" ? SPLAT_PRECISION_STRICT
                     : precision == "fast" ? SPLAT_PRECISION_FAST
                                           : SPLAT_PRECISION_BALANCED;
    check(splat_model_create(device, &desc, model_.out()));
}

void Network::load(splat_weights weights, std::uint32_t flags) {
    check(splat_model_load(model_.get(), weights, flags));
}

Scene Network::predict(const Views& views) {
    auto input = sized<splat_model_input>();
    input.images = views.inputs.data();
    input.view_to_world = views.view_to_world.data();
    input.quaternions = views.quaternions.data();
    input.focals = views.focals.data();
    check(splat_model_forward(model_.get(), &input));
    Scene scene;
    check(splat_model_scene(model_.get(), 0, scene.out()));
    return scene;
}

std::vector<float> Network::draw(const Scene& scene, const std::vector<splat_camera>& cameras) {
    if (drawn_at_once_ == 0) {
        auto desc = sized<splat_rasterizer_desc>();
        desc.gaussians = views_ * resolution_ * resolution_;
        desc.views = kDrawnAtOnce;
        desc.width = desc.height = resolution_;
        desc.sh_degree = sh_degree_;
        check(splat_rasterizer_create(device_, &desc, rasterizer_.out()));
        drawn_at_once_ = kDrawnAtOnce;
    }
    std::vector<float> images;
    std::vector<float> pixels(std::size_t{drawn_at_once_} * resolution_ * resolution_ * 3);
    for (std::size_t first = 0; first < cameras.size(); first += drawn_at_once_) {
        // The last group is filled up with its last camera.
        std::vector<splat_camera> group;
        for (std::size_t i = 0; i < drawn_at_once_; ++i)
            group.push_back(cameras[std::min(first + i, cameras.size() - 1)]);
        check(splat_rasterizer_forward_scene(rasterizer_.get(), scene.get(), group.data(),
                                             drawn_at_once_, background_));
        check(splat_rasterizer_read(rasterizer_.get(), SPLAT_OUTPUT_RGB, pixels.data(),
                                    pixels.size() * sizeof(float)));
        planes_of(pixels, std::min<std::size_t>(drawn_at_once_, cameras.size() - first),
                  resolution_, images);
    }
    return images;
}

}  // namespace vkrun
