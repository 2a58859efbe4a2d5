#include "predict/predictor.h"

#include <algorithm>

#include "config/config_file.h"
#include "io/compress.h"
#include "model/adapters.h"

namespace splat::predict {
namespace {

/// Quads [count,R,R] of RGB and alpha to [count,3,R,R].
std::vector<float> planes_of(const std::vector<float>& quads, std::size_t count, std::size_t area) {
    std::vector<float> images(count * 3 * area);
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t p = 0; p < area; ++p)
            for (std::size_t c = 0; c < 3; ++c)
                images[(3 * i + c) * area + p] = quads[4 * (i * area + p) + c];
    return images;
}

config::ModelConfig without_adapters(config::ModelConfig network) {
    network.lora = {};
    network.frozen.clear();
    return network;
}

}  // namespace

Predictor::Predictor(vk::Context& context, const config::Settings& settings)
    : context_(context),
      background_(background_of(settings)),
      adapted_(settings.network.lora.rank > 0),
      lora_alpha_(static_cast<double>(settings.network.lora.alpha)),
      config_checksum_(io::crc32_of(io::as_bytes(config::merged_config_text(settings)))) {}

Result<std::unique_ptr<Predictor>> Predictor::create(vk::Context& context,
                                                     const config::Settings& settings) {
    std::unique_ptr<Predictor> self(new Predictor(context, settings));
    model::ModelOptions options;
    options.build.precision = settings.training.precision;
    SPLAT_ASSIGN(self->model_,
                 model::Model::create(context, without_adapters(settings.network), options));
    return self;
}

Status Predictor::check(vk::Context& context, const config::Settings& settings,
                        const io::WeightsFile& file) {
    const config::ModelConfig plain = without_adapters(settings.network);
    model::LoadOptions options;
    options.source = model::channels_of(plain);
    options.graft =
        settings.network.lora.rank > 0 && model::has_adapters(file.tensors);  // folded later
    return model::check_state(context, plain, file.tensors, options);
}

Status Predictor::load(const io::WeightsFile& file, model::LoadReport& report) {
    model::LoadOptions options;
    options.take_rays = true;
    if (!adapted_ || !model::has_adapters(file.tensors))
        return model::load_state(*model_, file.tensors, options, report);
    SPLAT_ASSIGN(const io::NamedTensors folded,
                 model::merge_adapters(file.tensors, file.tensors, lora_alpha_, 1));
    return model::load_state(*model_, folded, options, report);
}

Result<std::string> Predictor::checksum() {
    SPLAT_ASSIGN(const io::NamedTensors state, model::save_state(*model_));
    std::uint32_t sum = config_checksum_;
    for (const io::NamedTensor& tensor : state) {
        sum = io::crc32_of(io::as_bytes(tensor.name), sum);
        sum = io::crc32_of(std::as_bytes(std::span(tensor.values)), sum);
    }
    return format("%08x", sum);
}

Status Predictor::predict(const Views& views) {
    const model::IdentityPoses identity(this->views());
    const std::size_t n = this->views();
    const auto first = [&](const std::vector<float>& values, std::size_t each) {
        return std::span(values).first(std::min(values.size(), n * each));
    };
    model::ModelInput input;
    input.images = views.inputs;
    input.view_to_world = views.view_to_world.empty()
                              ? std::span<const float>(identity.view_to_world)
                              : first(views.view_to_world, 16);
    input.quaternions = views.quaternions.empty() ? std::span<const float>(identity.quaternions)
                                                  : first(views.quaternions, 4);
    if (config().fov_degrees == 0) input.focals = first(views.focals, 2);
    input.embedding = views.embedding;
    input.tokens = views.tokens;
    SPLAT_TRY(model_->set_input(input));
    return model_->forward();
}

Result<std::vector<float>> Predictor::draw(std::span<const scene::Camera> cameras) {
    SPLAT_ASSERT(cameras.size() <= kDrawnAtOnce);
    if (cameras.empty()) return std::vector<float>();
    SPLAT_ASSERT(model_->sets().version != 0);  // predict() comes first
    if (rasterizer_ == nullptr) {
        raster::RasterDesc desc;
        static_cast<gaussians::SetDesc&>(desc) = model_->set_desc();
        desc.views = kDrawnAtOnce;
        desc.width = desc.height = resolution();
        SPLAT_ASSIGN(rasterizer_, raster::Rasterizer::create(context_, desc));
    }
    // The group is filled up with its last camera.
    std::vector<scene::Camera> group(cameras.begin(), cameras.end());
    group.resize(kDrawnAtOnce, group.back());
    SPLAT_ASSIGN(const raster::PackedViews packed,
                 raster::pack_views(rasterizer_->desc(), group, background_));
    SPLAT_TRY(rasterizer_->forward(model_->set(0), packed));
    const std::size_t area = std::size_t{resolution()} * resolution();
    std::vector<float> quads(cameras.size() * area * 4);
    SPLAT_TRY(context_.read(rasterizer_->workspace().image.range(), quads.data(),
                            quads.size() * sizeof(float)));
    return planes_of(quads, cameras.size(), area);
}

}  // namespace splat::predict
