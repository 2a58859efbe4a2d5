#include "raster/raster_session.h"

#include <algorithm>
#include <cmath>

#include "raster/fragile.h"
#include "raster/raster_scenes.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {

RasterSession::RasterSession(vk::Context& context, const RasterCase& from,
                             const raster::RasterDesc& desc)
    : background(from.background), context_(context), count_(from.count()) {
    cameras_.assign(desc.views, camera_of(from));
    auto packed = PackedCase::create(context, from, desc);
    auto made = raster::Rasterizer::create(context, desc);
    status_ = !packed.ok() ? packed.status() : made.status();
    if (!status_.ok()) return;
    packed_ = std::move(packed.value());
    rasterizer_ = std::move(made.value());
}

Status RasterSession::forward(std::uint64_t version) {
    return forward(cameras_, version);
}

Status RasterSession::forward(std::span<const scene::Camera> cameras, std::uint64_t version) {
    gaussians::SetViews scene = packed_.scene.views();
    scene.version = version;
    return draw(scene, cameras);
}

Status RasterSession::draw(const gaussians::SetViews& scene,
                           std::span<const scene::Camera> cameras) {
    SPLAT_ASSIGN(const raster::PackedViews views,
                 raster::pack_views(rasterizer_->desc(), cameras, background));
    return rasterizer_->forward(scene, views);
}

Status RasterSession::backward(const std::vector<float>& grad_image,
                               const std::vector<float>& grad_depth) {
    const std::vector<float> none(grad_image.size() / 4);
    const vk::Buffer image = upload(context_, grad_image);
    const vk::Buffer depth = upload(context_, grad_depth.empty() ? none : grad_depth);
    return rasterizer_->backward(image.range(), depth.range(), packed_.gradients.views());
}

std::vector<float> RasterSession::image() {
    const auto pixels = static_cast<std::size_t>(rasterizer_->desc().pixels());
    return download(context_, rasterizer_->workspace().image.range(), 4 * pixels);
}

std::vector<float> RasterSession::exported() {
    const auto items = static_cast<std::size_t>(rasterizer_->desc().items());
    return download(context_, rasterizer_->workspace().exported.range(), 12 * items);
}

std::vector<float> RasterSession::gradients() {
    std::vector<float> all = download(context_, packed_.gradients.gaussians.range(), 12 * count_);
    const std::size_t quads = rasterizer_->desc().color_quads();
    const std::vector<float> colors =
        download(context_, packed_.gradients.colors.range(), 4 * quads * count_);
    all.insert(all.end(), colors.begin(), colors.end());
    return all;
}

std::vector<float> raster_image(vk::Context& context, const RasterCase& from,
                                const raster::RasterDesc& desc) {
    RasterSession session(context, from, desc);
    const Status status = session.status().ok() ? session.forward() : session.status();
    EXPECT_OK(status) << from.name;
    return status.ok() ? session.image() : std::vector<float>();
}

raster::RasterDesc with_gradients(raster::RasterDesc desc) {
    desc.backward = true;
    desc.export_gradients = true;
    desc.grad_pose = true;
    desc.grad_intrinsics = true;
    desc.contributions = true;
    desc.grad_depth = true;
    return desc;
}

double relative_difference(std::span<const float> got, std::span<const float> expected) {
    EXPECT_EQ(got.size(), expected.size());
    double most = 0;
    double size = 0;
    for (std::size_t i = 0; i < std::min(got.size(), expected.size()); ++i) {
        const auto wanted = static_cast<double>(expected[i]);
        const double off = std::abs(static_cast<double>(got[i]) - wanted);
        if (!(off <= most)) most = off;  // NaN stays
        size = std::max(size, std::abs(wanted));
    }
    return size > 0 ? most / size : most;
}

namespace {

ref::RasterLoss<float> in_float32(const ref::RasterLoss<double>& loss) {
    const auto narrow = [](const std::vector<double>& values) {
        return std::vector<float>(values.begin(), values.end());
    };
    return {narrow(loss.grad_rgb), narrow(loss.grad_alpha), narrow(loss.grad_depth)};
}

}  // namespace

ReferenceRun expect_like_reference(vk::Context& context, const RasterCase& from,
                                   const RasterMode& mode, ref::RasterGradient gradient,
                                   bool or_float32) {
    const auto scene = reference_scene<double>(from, mode, gradient);
    const RasterJudge judge =
        has_needles(from) ? RasterJudge::kFloat32Needles : RasterJudge::kFloat32;
    RasterSubject subject = {
        from.name + " " + mode.name, judge, fragile_pixels(scene), {}, from.opacities};
    ref::RasterLoss<double> loss;
    loss.grad_rgb = to_double(loss_weights(subject.fragile, 3, 21));
    loss.grad_alpha = to_double(loss_weights(subject.fragile, 1, 22));
    loss.grad_depth = to_double(loss_weights(subject.fragile, 1, 23));
    raster::RasterDesc desc = raster_desc(from, mode);
    desc.original_gradient = gradient == ref::RasterGradient::kOriginal;
    ReferenceRun result{run_raster(context, from, desc, &loss), 0};
    EXPECT_OK(result.run.status) << subject.what;
    if (!result.run.status.ok()) return result;
    EXPECT_TRUE(outputs_match(result.run.outputs, reference_outputs(scene), subject));
    RasterGradients expected = reference_gradients(scene, loss);
    if (!expected.world_to_camera.empty()) expected.world_to_camera.resize(12);  // [R|t]
    RasterGradients in_float;
    if (or_float32 && !gradients_match(result.run.gradients, expected, subject)) {
        in_float =
            reference_gradients(reference_scene<float>(from, mode, gradient), in_float32(loss));
        if (!in_float.world_to_camera.empty()) in_float.world_to_camera.resize(12);
        subject.in_float = &in_float;
    }
    EXPECT_TRUE(gradients_match(result.run.gradients, expected, subject));
    const auto spoiled = std::count(subject.fragile.begin(), subject.fragile.end(), true);
    result.fragile = static_cast<double>(spoiled) / static_cast<double>(subject.fragile.size());
    return result;
}

}  // namespace splat::test
