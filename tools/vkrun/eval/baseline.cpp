#include "vkrun/eval/baseline.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/data/view_source.h"

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

double novel_psnr(const std::vector<float>& images, const Views& views, const EvaluatedViews& which,
                  std::uint32_t side) {
    const std::size_t plane = std::size_t{3} * side * side;
    const std::size_t given = which.conditioning.size();
    Scores scores;
    for (std::size_t i = given; i < given + which.novel.size(); ++i) {
        if (is_black(views.images.data() + i * plane, plane)) continue;
        auto view = sized<splat_image_scores>();
        check(splat_image_compare(images.data() + i * plane, views.images.data() + i * plane, 3,
                                  side, side, &view));
        scores.add(view, 0);
    }
    if (scores.views == scores.perfect) return std::numeric_limits<double>::infinity();
    scores.finish();
    return scores.psnr;
}

}  // namespace

MeanImage::MeanImage(const ViewSource& data) {
    const std::size_t plane = std::size_t{3} * data.resolution() * data.resolution();
    std::vector<double> sum(plane);
    std::size_t images = 0;
    for (std::uint32_t object = 0; object < data.objects(); ++object) {
        std::vector<std::uint32_t> numbers(data.views_of(object));
        std::iota(numbers.begin(), numbers.end(), 0U);
        const Views views = data.read(object, numbers, 0, {});
        for (std::size_t i = 0; i < views.images.size(); ++i)
            sum[i % plane] += static_cast<double>(views.images[i]);
        images += numbers.size();
    }
    for (const double value : sum)
        mean_.push_back(static_cast<float>(value / static_cast<double>(images)));
}

std::vector<float> MeanImage::draw(const Views& views, const EvaluatedViews&, ObjectScores&) {
    std::vector<float> images;
    for (std::size_t i = 0; i < views.cameras.size(); ++i)
        images.insert(images.end(), mean_.begin(), mean_.end());
    return images;
}

std::vector<float> Billboard::draw(const Views& views, const EvaluatedViews& which, ObjectScores&) {
    std::vector<float> best;
    double best_psnr = -1;
    for (int i = 0; i < kDepths; ++i) {
        const double depth = near_ + (far_ - near_) * (i + 0.5) / kDepths;
        std::vector<float> images = network_.draw(
            flat_scene(views.images.data(), views.cameras.front(), depth), views.cameras);
        const double psnr = novel_psnr(images, views, which, network_.resolution());
        if (psnr <= best_psnr) continue;
        best_psnr = psnr;
        best = std::move(images);
    }
    return best;
}

std::unique_ptr<Predictor> make_baseline(const std::string& name, Network& network,
                                         const Json& config, const std::string& root) {
    if (name == "mean") return std::make_unique<MeanImage>(ViewSource(config, root, "train"));
    if (name == "billboard")
        return std::make_unique<Billboard>(network, config.at("data").at("znear").get<double>(),
                                           config.at("data").at("zfar").get<double>());
    throw Failure(kUsageError, "--baseline " + name + ": expected mean or billboard");
}

}  // namespace vkrun
