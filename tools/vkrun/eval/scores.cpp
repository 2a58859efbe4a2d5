#include "vkrun/eval/scores.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/config/image_channels.h"
#include "vkrun/data/view_source.h"

namespace vkrun {
void Scores::add(const splat_image_scores& view, double distance) {
    ++views;
    ssim += view.ssim;
    lpips += distance;
    if (std::isfinite(view.psnr))
        psnr += view.psnr;
    else
        ++perfect;
}

void Scores::finish() {
    // 0 / 0 is NaN.
    ssim /= views;
    lpips /= views;
    psnr /= views - perfect;
}

bool is_black(const float* image, std::size_t count) {
    return std::all_of(image, image + count, [](float v) { return v == 0; });
}

EvaluatedViews evaluated_views(std::uint32_t count, std::uint32_t inputs, std::uint32_t most) {
    constexpr std::uint32_t kSrnViews = 251, kSrnStep = 64;
    const bool srn = count == kSrnViews && inputs <= 3;
    if (count <= inputs)
        throw Failure(kBadData, "an object has " + std::to_string(count) +
                                    " views, expected more than " + std::to_string(inputs));
    EvaluatedViews views;
    for (std::uint32_t i = 0; i < inputs; ++i)
        views.conditioning.push_back(srn ? kSrnStep * (i + 1) : i);
    std::vector<std::uint32_t> others;
    for (std::uint32_t i = 0; i < count; ++i)
        if (std::find(views.conditioning.begin(), views.conditioning.end(), i) ==
            views.conditioning.end())
            others.push_back(i);
    if (most == 0 || most >= others.size()) {
        views.novel = others;
        return views;
    }
    for (std::size_t i = 0; i < most; ++i)
        views.novel.push_back(others[i * others.size() / most + others.size() / most / 2]);
    return views;
}

std::vector<float> NetworkPredictor::draw(const Views& views, const EvaluatedViews&,
                                          ObjectScores& result) {
    const Stopwatch predicting;
    const Scene scene = network_.predict(views);
    result.predict_seconds = predicting.seconds();
    const Stopwatch drawing;
    std::vector<float> drawn = network_.draw(scene, views.cameras);
    result.draw_seconds = drawing.seconds();
    result.drawn = static_cast<std::uint32_t>(views.cameras.size());
    return drawn;
}

ObjectScores score_object(Predictor& predictor, const ImageChannels& channels,
                          const ViewSource& data, std::uint32_t object, const EvaluatedViews& which,
                          splat_lpips lpips, std::vector<float>* images,
                          std::vector<float>* truths) {
    std::vector<std::uint32_t> numbers = which.conditioning;
    numbers.insert(numbers.end(), which.novel.begin(), which.novel.end());
    const Views views =
        data.read(object, numbers, static_cast<std::uint32_t>(which.conditioning.size()), channels);
    ObjectScores result;
    result.name = data.name(object);
    const std::vector<float> drawn = predictor.draw(views, which, result);

    const std::uint32_t side = data.resolution();
    const std::size_t plane = std::size_t{3} * side * side;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const float* const target = views.images.data() + i * plane;
        if (is_black(target, plane)) {
            ++result.empty;
            continue;
        }
        auto scores = sized<splat_image_scores>();
        check(splat_image_compare(drawn.data() + i * plane, target, 3, side, side, &scores));
        double distance = std::numeric_limits<double>::quiet_NaN();
        if (lpips != nullptr)
            check(splat_lpips_compare(lpips, drawn.data() + i * plane, target, &distance));
        (i < which.conditioning.size() ? result.conditioning : result.novel).add(scores, distance);
    }
    result.conditioning.finish();
    result.novel.finish();
    if (images != nullptr) *images = drawn;
    if (truths != nullptr) *truths = views.images;
    return result;
}

Scores mean_of(const std::vector<ObjectScores>& objects, Scores ObjectScores::*which) {
    Scores mean;
    std::uint32_t seen = 0, differing = 0;
    for (const ObjectScores& object : objects) {
        const Scores& scores = object.*which;
        if (scores.views == 0) continue;
        mean.views += scores.views;
        mean.perfect += scores.perfect;
        mean.ssim += scores.ssim;
        mean.lpips += scores.lpips;
        ++seen;
        if (scores.views == scores.perfect) continue;
        mean.psnr += scores.psnr;
        ++differing;
    }
    mean.ssim /= seen;
    mean.lpips /= seen;
    mean.psnr /= differing;
    return mean;
}

}  // namespace vkrun
