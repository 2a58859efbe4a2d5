#include "vkrun/predict/network.h"

#include <algorithm>
#include <numbers>
#include <string_view>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/text.h"
#include "vkrun/config/image_channels.h"
#include "vkrun/weights/model_load.h"

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

Rasterizer make_rasterizer(splat_device device, const splat_scene_info& info, std::uint32_t side,
                           std::uint32_t views, std::uint32_t flags) {
    auto desc = sized<splat_rasterizer_desc>();
    desc.flags = flags;
    desc.gaussians = static_cast<std::uint32_t>(info.count);
    desc.sh_degree = info.sh_degree;
    desc.views = views;
    desc.width = desc.height = side;
    Rasterizer rasterizer;
    check(splat_rasterizer_create(device, &desc, rasterizer.out()));
    return rasterizer;
}

/// Under the names of state dicts or of PEFT, as splat_weights_fold() knows them.
bool has_adapters(splat_weights weights) {
    std::uint32_t count = 0;
    check(splat_weights_count(weights, &count));
    for (std::uint32_t i = 0; i < count; ++i) {
        auto info = sized<splat_weights_info>();
        check(splat_weights_get_info(weights, i, &info));
        const std::string_view name = info.name;
        if (name.ends_with(".lora_A") ||
            (name.starts_with("base_model.model.") && name.ends_with(".lora_A.weight")))
            return true;
    }
    return false;
}

}  // namespace

Network::Network(splat_device device, const Json& config)
    : device_(device), channels_(ImageChannels::of(config)) {
    const Json& data = config.at("data");
    views_ = data.at("input_images");
    resolution_ = data.at("training_resolution");
    fov_degrees_ = data.at("fov");
    if (!data.at("white_background").get<bool>()) std::fill_n(background_, 3, 0.0F);
    Json plain = config;
    adapted_ = plain["opt"].value("lora_finetune", false);
    lora_alpha_ = plain["opt"].value("lora_alpha", 1.0);
    for (const char* key : {"lora_finetune", "freeze"}) plain["opt"].erase(key);
    const std::string text = plain.dump();
    auto desc = sized<splat_model_desc>();
    desc.config = text.c_str();
    const auto precision = config.at("general").at("precision").get<std::string>();
    desc.precision = precision == "strict" ? SPLAT_PRECISION_STRICT
                     : precision == "fast" ? SPLAT_PRECISION_FAST
                                           : SPLAT_PRECISION_BALANCED;
    check(splat_model_create(device, &desc, model_.out()), kUsageError);
}

void Network::load(const std::string& path) {
    const Weights weights = load_weights(path);
    load(weights.get());
    warn_of_rays(path, weights.get(), library_json(splat_model_report, model_.get()));
}

void Network::load(splat_weights weights) {
    Weights folded;
    if (adapted_ && has_adapters(weights)) {
        check(splat_weights_fold(weights, nullptr, lora_alpha_, 0, folded.out()), kBadData);
        weights = folded.get();
    }
    check(splat_model_load(model_.get(), weights, SPLAT_LOAD_TAKE_RAYS), kBadData);
}

Scene Network::predict(const Views& views) {
    // The library reads `needed` numbers from a bare pointer.
    const std::size_t needed = std::size_t{views_} * channels_.count() * resolution_ * resolution_;
    if (views.inputs.size() != needed)
        throw Failure(kFailed, format("the input holds %zu numbers, expected %zu: %u views of %u "
                                      "channels of %u x %u pixels",
                                      views.inputs.size(), needed, views_, channels_.count(),
                                      resolution_, resolution_));
    auto input = sized<splat_model_input>();
    input.images = views.inputs.data();
    input.view_to_world = views.view_to_world.data();
    input.quaternions = views.quaternions.data();
    if (fov_degrees_ == 0) input.focals = views.focals.data();
    input.channels = channels_.count();
    check(splat_model_forward(model_.get(), &input));
    Scene scene;
    check(splat_model_scene(model_.get(), 0, scene.out()));
    return scene;
}

std::vector<float> Network::draw(const Scene& scene, const std::vector<splat_camera>& cameras) {
    auto info = sized<splat_scene_info>();
    check(splat_scene_get_info(scene.get(), &info));
    if (rasterizer_.get() == nullptr || gaussians_ != info.count) {
        rasterizer_ = make_rasterizer(device_, info, resolution_, kDrawnAtOnce, 0);
        gaussians_ = info.count;
    }
    std::vector<float> images;
    std::vector<float> pixels(std::size_t{kDrawnAtOnce} * resolution_ * resolution_ * 3);
    for (std::size_t first = 0; first < cameras.size(); first += kDrawnAtOnce) {
        // The last group is filled up with its last camera.
        std::vector<splat_camera> group;
        for (std::size_t i = 0; i < kDrawnAtOnce; ++i)
            group.push_back(cameras[std::min(first + i, cameras.size() - 1)]);
        check(splat_rasterizer_forward_scene(rasterizer_.get(), scene.get(), group.data(),
                                             kDrawnAtOnce, background_));
        check(splat_rasterizer_read(rasterizer_.get(), SPLAT_OUTPUT_RGB, pixels.data(),
                                    pixels.size() * sizeof(float)));
        planes_of(pixels, std::min<std::size_t>(kDrawnAtOnce, cameras.size() - first), resolution_,
                  images);
    }
    return images;
}

Depth Network::draw_depth(const Scene& scene, const splat_camera& camera) {
    auto info = sized<splat_scene_info>();
    check(splat_scene_get_info(scene.get(), &info));
    const Rasterizer rasterizer =
        make_rasterizer(device_, info, resolution_, 1, SPLAT_RASTERIZER_DEPTH);
    check(splat_rasterizer_forward_scene(rasterizer.get(), scene.get(), &camera, 1, background_));
    Depth drawn;
    drawn.depth.resize(std::size_t{resolution_} * resolution_);
    drawn.alpha.resize(drawn.depth.size());
    const std::size_t bytes = drawn.depth.size() * sizeof(float);
    check(splat_rasterizer_read(rasterizer.get(), SPLAT_OUTPUT_EXPECTED_DEPTH, drawn.depth.data(),
                                bytes));
    check(splat_rasterizer_read(rasterizer.get(), SPLAT_OUTPUT_ALPHA, drawn.alpha.data(), bytes));
    return drawn;
}

splat_camera Network::camera() const {
    splat_camera camera{};
    check(splat_camera_from_fov(resolution_, resolution_, fov_degrees_ * std::numbers::pi / 180,
                                &camera));
    return camera;
}

}  // namespace vkrun
