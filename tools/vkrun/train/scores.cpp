#include "vkrun/train/scores.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "vkrun/command.h"

namespace vkrun {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

void Scores::add(const splat_image_scores& view) {
    ++views;
    ssim += view.ssim;
    if (std::isfinite(view.psnr))
        psnr += view.psnr;
    else
        ++perfect;
}

void Scores::finish() {
    if (views > 0) ssim /= views;
    if (views > perfect) psnr /= views - perfect;
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

ObjectScores score_object(Network& network, const DataSet& data, std::uint32_t object,
                          const EvaluatedViews& which, std::vector<float>* images,
                          std::vector<float>* truths) {
    std::vector<std::uint32_t> numbers = which.conditioning;
    numbers.insert(numbers.end(), which.novel.begin(), which.novel.end());
    const Views views = data.read(object, numbers, network.views(), network.channels());
    ObjectScores result;
    result.name = data.name(object);
    auto start = std::chrono::steady_clock::now();
    const Scene scene = network.predict(views);
    result.predict_seconds = seconds_since(start);
    start = std::chrono::steady_clock::now();
    const std::vector<float> drawn = network.draw(scene, views.cameras);
    result.draw_seconds = seconds_since(start);
    result.drawn = static_cast<std::uint32_t>(numbers.size());

    const std::uint32_t side = network.resolution();
    const std::size_t plane = std::size_t{3} * side * side;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const float* const target = views.images.data() + i * plane;
        if (std::all_of(target, target + plane, [](float v) { return v == 0; })) {
            ++result.empty;
            continue;
        }
        auto scores = sized<splat_image_scores>();
        check(splat_image_compare(drawn.data() + i * plane, target, 3, side, side, &scores));
        (i < which.conditioning.size() ? result.conditioning : result.novel).add(scores);
    }
    result.conditioning.finish();
    result.novel.finish();
    if (images != nullptr) *images = drawn;
    if (truths != nullptr) *truths = views.images;
    return result;
}

Scores mean_of(const std::vector<ObjectScores>& objects, Scores ObjectScores::*which) {
    Scores mean;
    std::uint32_t counted = 0;
    for (const ObjectScores& object : objects) {
        const Scores& scores = object.*which;
        mean.views += scores.views;
        mean.perfect += scores.perfect;
        mean.ssim += scores.ssim;
        if (scores.views == scores.perfect) continue;
        mean.psnr += scores.psnr;
        ++counted;
    }
    if (!objects.empty()) mean.ssim /= static_cast<double>(objects.size());
    if (counted > 0) mean.psnr /= counted;
    return mean;
}

}  // namespace vkrun
