#include "predict/predictor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "config/config_file.h"
#include "core/finite.h"
#include "io/compress.h"
#include "model/adapters.h"
#include "scene/activate.h"
#include "scene/camera_pose.h"

namespace splat::predict {
namespace {

/// The values of object `index`.
Result<std::vector<float>> read_part(vk::Context& context, const vk::BufferView& all,
                                     std::uint32_t objects, std::uint32_t index) {
    vk::BufferView part = all;
    const std::uint64_t count = all.shape.elements() / objects;
    part.bytes = count * sizeof(float);
    part.offset += part.bytes * index;
    std::vector<float> values(count);
    SPLAT_TRY(context.read(part, values.data(), part.bytes));
    return values;
}

raster::RasterDesc raster_desc(const scene::Gaussians& gaussians, std::uint32_t side,
                               std::uint32_t views) {
    raster::RasterDesc desc;
    desc.gaussians = static_cast<std::uint32_t>(gaussians.count());
    desc.sh_degree = gaussians.sh_degree;
    desc.views = views;
    desc.width = desc.height = side;
    return desc;
}

/// Quads [count,R,R] of RGB and alpha to [count,3,R,R].
std::vector<float> planes_of(const std::vector<float>& quads, std::size_t count, std::size_t area) {
    std::vector<float> images(count * 3 * area);
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t p = 0; p < area; ++p)
            for (std::size_t c = 0; c < 3; ++c)
                images[(3 * i + c) * area + p] = quads[4 * (i * area + p) + c];
    return images;
}

}  // namespace

Result<scene::Gaussians> gaussians_of(vk::Context& context, const model::Model& model,
                                      std::uint32_t objects, std::uint32_t index) {
    const auto outputs = model.outputs();
    const auto read = [&](const vk::BufferView& view) {
        return read_part(context, view, objects, index);
    };
    scene::Gaussians made;
    made.sh_degree = model.config().sh_degree;
    SPLAT_ASSIGN(made.means, read(outputs.means));
    SPLAT_ASSIGN(made.rotations, read(outputs.rotations));
    SPLAT_ASSIGN(made.sh, read(outputs.sh));
    // Scenes hold logarithms and logits, as files of Gaussians do.
    SPLAT_ASSIGN(made.log_scales, read(outputs.scales));
    // exp() of the network's output may be 0 in float32. Such a flat Gaussian is still drawn.
    constexpr float kLeastScale = std::numeric_limits<float>::min();
    for (float& scale : made.log_scales) scale = std::log(std::max(scale, kLeastScale));
    SPLAT_ASSIGN(made.opacity_logits, read(outputs.opacities));
    for (float& opacity : made.opacity_logits)
        opacity = static_cast<float>(scene::logit_of(static_cast<double>(opacity)));
    return made;
}

Predictor::Predictor(vk::Context& context, const config::Settings& settings)
    : context_(context),
      background_(background_of(settings)),
      adapted_(settings.network.lora.rank > 0),
      lora_alpha_(static_cast<double>(settings.network.lora.alpha)),
      config_checksum_(io::crc32_of(io::as_bytes(config::merged_config_text(settings)))) {}

Result<std::unique_ptr<Predictor>> Predictor::create(vk::Context& context,
                                                     const config::Settings& settings) {
    std::unique_ptr<Predictor> self(new Predictor(context, settings));
    config::ModelConfig plain = settings.network;
    plain.lora = {};
    plain.frozen.clear();
    model::ModelOptions options;
    options.build.precision = settings.training.precision;
    SPLAT_ASSIGN(self->model_, model::Model::create(context, plain, options));
    return self;
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

Result<scene::Gaussians> Predictor::predict(const Views& views) {
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
    SPLAT_TRY(model_->forward());
    return gaussians_of(context_, *model_, 1, 0);
}

Result<bool> Predictor::finite_output() const {
    const vk::BufferView& raw = model_->raw_output();
    std::vector<float> values(raw.shape.elements());
    SPLAT_TRY(context_.read(raw, values.data(), values.size() * sizeof(float)));
    return find_not_finite(values) == values.size();
}

Status Predictor::show(const scene::Gaussians& gaussians) {
    const raster::RasterDesc desc = raster_desc(gaussians, resolution(), kDrawnAtOnce);
    if (rasterizer_ == nullptr || rasterizer_->desc().gaussians != desc.gaussians ||
        rasterizer_->desc().sh_degree != desc.sh_degree) {
        rasterizer_.reset();
        SPLAT_ASSIGN(scene_, raster::allocate_packed(context_, desc));
        SPLAT_ASSIGN(rasterizer_, raster::Rasterizer::create(context_, desc));
    }
    rasterizer_->invalidate();
    ++version_;
    shown_degree_ = gaussians.sh_degree;
    return raster::upload_scene(context_, desc, gaussians, scene_);
}

Result<std::vector<float>> Predictor::draw(std::span<const scene::Camera> cameras) {
    SPLAT_ASSERT(rasterizer_ != nullptr && cameras.size() <= kDrawnAtOnce);
    if (cameras.empty()) return std::vector<float>();
    // The group is filled up with its last camera.
    std::vector<scene::Camera> group(cameras.begin(), cameras.end());
    group.resize(kDrawnAtOnce, group.back());
    SPLAT_ASSIGN(const raster::PackedViews packed,
                 raster::pack_views(rasterizer_->desc(), group, background_));
    SPLAT_TRY(rasterizer_->forward(scene_.scene(version_, shown_degree_), packed));
    const std::size_t area = std::size_t{resolution()} * resolution();
    std::vector<float> quads(cameras.size() * area * 4);
    SPLAT_TRY(context_.read(rasterizer_->workspace().image.range(), quads.data(),
                            quads.size() * sizeof(float)));
    return planes_of(quads, cameras.size(), area);
}

Result<std::vector<float>> Predictor::draw(const scene::Gaussians& gaussians,
                                           std::span<const scene::Camera> cameras) {
    SPLAT_TRY(show(gaussians));
    std::vector<float> images;
    for (std::size_t first = 0; first < cameras.size(); first += kDrawnAtOnce) {
        SPLAT_ASSIGN(const std::vector<float> drawn,
                     draw(cameras.subspan(
                         first, std::min<std::size_t>(kDrawnAtOnce, cameras.size() - first))));
        images.insert(images.end(), drawn.begin(), drawn.end());
    }
    return images;
}

Result<Depth> Predictor::draw_depth(const scene::Gaussians& gaussians,
                                    const scene::Camera& camera) {
    raster::RasterDesc desc = raster_desc(gaussians, resolution(), 1);
    desc.extra = true;
    SPLAT_ASSIGN(const raster::PackedBuffers packed, raster::allocate_packed(context_, desc));
    SPLAT_TRY(raster::upload_scene(context_, desc, gaussians, packed));
    SPLAT_ASSIGN(const auto rasterizer, raster::Rasterizer::create(context_, desc));
    SPLAT_ASSIGN(const raster::PackedViews views,
                 raster::pack_views(desc, std::span(&camera, 1), background_));
    SPLAT_TRY(rasterizer->forward(packed.scene(0, gaussians.sh_degree), views));
    const std::size_t area = std::size_t{resolution()} * resolution();
    std::vector<float> image(4 * area), extra(4 * area);
    const raster::Workspace& space = rasterizer->workspace();
    SPLAT_TRY(context_.read(space.image.range(), image.data(), image.size() * sizeof(float)));
    SPLAT_TRY(context_.read(space.extra.range(), extra.data(), extra.size() * sizeof(float)));
    Depth drawn{std::vector<float>(area), std::vector<float>(area)};
    for (std::size_t p = 0; p < area; ++p) {
        drawn.depth[p] = extra[4 * p + 1];  // the expected one
        drawn.alpha[p] = image[4 * p + 3];
    }
    return drawn;
}

Result<scene::Camera> Predictor::camera() const {
    if (config().fov_degrees == 0)
        return error(Code::kInvalidArgument,
                     "'data.fov' is 0: each view has a focal length of its own");
    return scene::camera_from_fov(
        resolution(), resolution(),
        static_cast<double>(config().fov_degrees) * std::numbers::pi / 180);
}

}  // namespace splat::predict
