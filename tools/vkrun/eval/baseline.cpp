#include "vkrun/eval/baseline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/picture.h"
#include "vkrun/data/open_data.h"
#include "vkrun/predict/drawing.h"

namespace vkrun {
namespace {

/// Steps of the billboard's depth: at 64 pixels, neighbouring ones differ by less than a tenth of a dB.
constexpr int kDepths = 16;

/// Colour of a Gaussian's spherical harmonic of degree 0 (3DGS): 0.5 + Y00 * sh.
const double kY00 = 0.5 * std::sqrt(1 / std::numbers::pi);

/// The pixels of `image` [3,R,R] as Gaussians at this depth before the camera of the first view.
Scene flat_scene(const float* image, const splat_camera& camera, double depth) {
    const std::uint32_t side = camera.width;
    const std::size_t count = std::size_t{side} * side;
    std::vector<float> means, scales, sh;
    // Half a pixel of standard deviation: neighbours merge, edges stay.
    const double sigma_x = 0.5 * depth / camera.fx, sigma_y = 0.5 * depth / camera.fy;
    for (std::size_t p = 0; p < count; ++p) {
        const auto x = static_cast<double>(p % side) + 0.5;
        const auto y = static_cast<double>(p / side) + 0.5;
        for (const double v :
             {(x - camera.cx) / camera.fx * depth, (y - camera.cy) / camera.fy * depth, depth})
            means.push_back(static_cast<float>(v));
        for (const double s : {sigma_x, sigma_y, 1e-2 * sigma_x})
            scales.push_back(static_cast<float>(std::log(s)));
        for (std::size_t c = 0; c < 3; ++c)
            sh.push_back(
                static_cast<float>((static_cast<double>(image[c * count + p]) - 0.5) / kY00));
    }
    const std::vector<float> opacities(count, 6.0F);  // logit: 0.9975
    auto desc = sized<splat_scene_desc>();
    desc.count = count;
    desc.means = means.data();
    desc.log_scales = scales.data();
    desc.opacity_logits = opacities.data();
    desc.sh = sh.data();
    Scene scene;
    check(splat_scene_create(&desc, scene.out()));
    return scene;
}

bool all_black(const float* image, std::size_t count) {
    return std::all_of(image, image + count, [](float v) { return v == 0; });
}

/// The mean of the novel views that differ from their targets, which are not black.
double novel_psnr(const std::vector<float>& images, const ObjectViews& views) {
    const std::size_t plane = std::size_t{3} * views.side * views.side;
    double sum = 0;
    std::uint32_t differing = 0;
    for (std::size_t i = views.inputs; i < views.cameras.size(); ++i) {
        const float* const target = views.images.data() + i * plane;
        if (all_black(target, plane)) continue;
        auto view = sized<splat_image_scores>();
        const splat_image drawn = planar_image(images.data() + i * plane, views.side, 3);
        const splat_image truth = planar_image(target, views.side, 3);
        check(splat_image_compare(&drawn, &truth, &view));
        if (!std::isfinite(view.psnr)) continue;
        sum += view.psnr;
        ++differing;
    }
    return differing == 0 ? std::numeric_limits<double>::infinity() : sum / differing;
}

}  // namespace

MeanImage::MeanImage(splat_dataset data) {
    const Json report = library_json(splat_dataset_report, data);
    const std::size_t side = report.at("resolution");
    const std::size_t plane = 3 * side * side;
    std::vector<double> sum(plane);
    std::size_t images = 0;
    std::uint32_t object = 0;
    for (const std::uint32_t count : report.at("views_of").get<std::vector<std::uint32_t>>()) {
        std::vector<std::uint32_t> numbers(count);
        std::iota(numbers.begin(), numbers.end(), 0U);
        std::vector<float> values(count * plane);
        auto views = sized<splat_dataset_views>();
        views.images = values.data();
        check(splat_dataset_read(data, object++, numbers.data(), count, &views), kBadData);
        for (std::size_t i = 0; i < values.size(); ++i)
            sum[i % plane] += static_cast<double>(values[i]);
        images += count;
    }
    for (const double value : sum)
        mean_.push_back(static_cast<float>(value / static_cast<double>(images)));
}

std::vector<float> MeanImage::draw(const ObjectViews& views) {
    std::vector<float> images;
    for (std::size_t i = 0; i < views.cameras.size(); ++i)
        images.insert(images.end(), mean_.begin(), mean_.end());
    return images;
}

std::vector<float> Billboard::draw(const ObjectViews& views) {
    std::vector<float> best;
    double best_psnr = -1;
    for (int i = 0; i < kDepths; ++i) {
        const double depth = near_ + (far_ - near_) * (i + 0.5) / kDepths;
        std::vector<float> images =
            draw_scene(device_, flat_scene(views.images.data(), views.cameras.front(), depth),
                       views.cameras, background_);
        const double psnr = novel_psnr(images, views);
        if (psnr <= best_psnr) continue;
        best_psnr = psnr;
        best = std::move(images);
    }
    return best;
}

std::unique_ptr<Baseline> make_baseline(const std::string& name, splat_device device,
                                        const Json& config, const std::string& root) {
    if (name.empty()) return nullptr;
    const Json& data = config.at("data");
    if (name == "mean") return std::make_unique<MeanImage>(open_data(config, root, "train").get());
    if (name == "billboard")
        return std::make_unique<Billboard>(device, data.at("znear").get<double>(),
                                           data.at("zfar").get<double>(),
                                           data.at("white_background").get<bool>() ? 1.0F : 0.0F);
    throw Failure(kUsageError, "--baseline " + name + ": expected mean or billboard");
}

}  // namespace vkrun
