#include "eval/scores.h"

#include <algorithm>
#include <cmath>

#include "core/finite.h"
#include "core/stopwatch.h"

namespace splat::eval {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool is_black(std::span<const float> image) {
    return std::ranges::all_of(image, [](float value) { return value == 0; });
}

/// NaN without a network.
Result<double> distance(const Lpips& lpips, std::span<const float> image,
                        std::span<const float> target) {
    if (lpips.net == nullptr) return kNaN;
    const std::lock_guard lock(lpips.context->mutex);
    return lpips.net->compare(image, target);
}

/// The novel views of an object: all but the conditioning ones, or `most` of them.
void choose_novel(std::uint32_t count, std::uint32_t most, EvaluatedViews& views) {
    std::vector<std::uint32_t> others;
    for (std::uint32_t i = 0; i < count; ++i)
        if (std::ranges::find(views.conditioning, i) == views.conditioning.end())
            others.push_back(i);
    if (most == 0 || most >= others.size()) {
        views.novel = std::move(others);
        return;
    }
    for (std::size_t i = 0; i < most; ++i)
        views.novel.push_back(others[i * others.size() / most + others.size() / most / 2]);
}

}  // namespace

void Scores::add(const ImageScores& view, double distance) {
    ++views;
    ssim += view.ssim;
    lpips += distance;
    if (std::isinf(view.psnr))
        ++perfect;
    else
        psnr += view.psnr;
}

void Scores::finish() {
    // 0 / 0 is NaN.
    ssim /= views;
    lpips /= views;
    psnr /= views - perfect;
}

std::vector<std::uint32_t> EvaluatedViews::all() const {
    std::vector<std::uint32_t> numbers = conditioning;
    numbers.insert(numbers.end(), novel.begin(), novel.end());
    return numbers;
}

Result<EvaluatedViews> evaluated_views(std::uint32_t count, std::uint32_t inputs,
                                       std::uint32_t most, std::string_view format) {
    constexpr std::uint32_t kSrnViews = 251, kSrnStep = 64, kCo3dStep = 30;
    const bool is_co3d = format == "co3d";
    const bool srn = !is_co3d && count == kSrnViews && inputs <= 3;
    const bool co3d = is_co3d && inputs == 2 && count > kCo3dStep;
    std::vector<std::uint32_t> conditioning(inputs);
    for (std::uint32_t i = 0; i < inputs; ++i)
        conditioning[i] = srn ? kSrnStep * (i + 1) : co3d ? kCo3dStep * i : i;
    return evaluated_views(count, conditioning, most);
}

Result<EvaluatedViews> evaluated_views(std::uint32_t count,
                                       std::span<const std::uint32_t> conditioning,
                                       std::uint32_t most) {
    if (count <= conditioning.size())
        return damaged("an object has %u views, expected more than %zu", count,
                       conditioning.size());
    EvaluatedViews views;
    for (const std::uint32_t view : conditioning) {
        if (view >= count)
            return invalid("conditioning view %u does not exist: an object has %u views", view,
                           count);
        if (std::ranges::find(views.conditioning, view) != views.conditioning.end())
            return invalid("conditioning view %u is given twice", view);
        views.conditioning.push_back(view);
    }
    choose_novel(count, most, views);
    return views;
}

Result<EvaluatedViews> evaluated_views_from(std::uint32_t source, std::uint32_t count,
                                            std::uint32_t inputs, std::uint32_t most) {
    std::vector<std::uint32_t> conditioning = {source};
    for (std::uint32_t view = 0; view < count && conditioning.size() < inputs; ++view)
        if (view != source) conditioning.push_back(view);
    return evaluated_views(count, conditioning, most);
}

Result<std::vector<float>> draw_object(vk::Context& context, predict::Predictor& predictor,
                                       const predict::Views& views, ObjectScores& scores) {
    const Stopwatch predicting;
    std::uint64_t version = 0;
    const auto predict = [&]() -> Status {
        SPLAT_TRY(predictor.predict(views));
        version = predictor.model().sets().version;
        return {};
    };
    {
        const std::lock_guard lock(context.mutex);
        SPLAT_TRY(predict());
        scores.ledger.take(predictor.ledger());
    }
    scores.predict_seconds = predicting.seconds();
    const Stopwatch drawing;
    const std::span<const scene::Camera> cameras = views.cameras;
    std::vector<float> images;
    for (std::size_t first = 0; first < cameras.size(); first += predictor.kDrawnAtOnce) {
        const std::size_t count =
            std::min<std::size_t>(predictor.kDrawnAtOnce, cameras.size() - first);
        const std::lock_guard lock(context.mutex);
        // Another thread has predicted meanwhile; the same inputs give the same bits.
        if (predictor.model().sets().version != version) SPLAT_TRY(predict());
        SPLAT_ASSIGN(const std::vector<float> drawn, predictor.draw(cameras.subspan(first, count)));
        images.insert(images.end(), drawn.begin(), drawn.end());
    }
    scores.draw_seconds = drawing.seconds();
    scores.drawn = static_cast<std::uint32_t>(cameras.size());
    const std::size_t plane = images.size() / std::max<std::size_t>(cameras.size(), 1);
    for (std::size_t i = 0; i < cameras.size(); ++i)
        if (is_plain(std::span(images).subspan(i * plane, plane), predictor.background()))
            ++scores.ledger.images_blank;
    return images;
}

Status score_images(const Lpips& lpips, std::span<const float> images, const predict::Views& views,
                    const EvaluatedViews& which, std::uint32_t side, ObjectScores& scores) {
    const std::size_t inputs = which.conditioning.size();
    const std::size_t plane = std::size_t{3} * side * side;
    if (images.size() != views.images.size())
        return error(Code::kShape,
                     "%zu numbers of images, expected %zu: %zu views of 3 x %u x %u pixels",
                     images.size(), views.images.size(), views.images.size() / plane, side, side);
    const std::size_t count = images.size() / plane;
    for (std::size_t i = 0; i < count; ++i)
        if (find_not_finite(images.subspan(i * plane, plane)) < plane)
            ++scores.ledger.images_not_finite;
    for (std::size_t i = 0; i < count; ++i) {
        const std::span<const float> image = images.subspan(i * plane, plane);
        const std::span<const float> target(views.images.data() + i * plane, plane);
        if (is_black(target)) {
            ++scores.empty;
            continue;
        }
        ImageScores made{kNaN, kNaN, kNaN};
        double apart = kNaN;
        if (scores.ledger.finite()) {
            SPLAT_ASSIGN(made, compare_images(image, target, 3, side, side));
            SPLAT_ASSIGN(apart, distance(lpips, image, target));
        }
        (i < inputs ? scores.conditioning : scores.novel).add(made, apart);
        if (i >= inputs)
            scores.novel_views.push_back({which.novel[i - inputs], made.psnr, made.ssim, apart});
    }
    scores.conditioning.finish();
    scores.novel.finish();
    return {};
}

Result<ObjectScores> score_object(vk::Context& context, predict::Predictor& predictor,
                                  const predict::ViewSource& data, std::uint32_t object,
                                  const EvaluatedViews& which, const Lpips& lpips,
                                  std::vector<float>* images, std::vector<float>* truths) {
    const vk::DeviceCall call(context.mutex);
    const auto inputs = static_cast<std::uint32_t>(which.conditioning.size());
    SPLAT_ASSIGN(predict::Views views, data.read(object, which.all(), inputs));
    ObjectScores scores;
    scores.name = data.name(object);
    SPLAT_ASSIGN(std::vector<float> drawn, draw_object(context, predictor, views, scores));
    SPLAT_TRY(score_images(lpips, drawn, views, which, data.resolution(), scores));
    if (images != nullptr) *images = std::move(drawn);
    if (truths != nullptr) *truths = std::move(views.images);
    return scores;
}

Scores mean_of(std::span<const ObjectScores> objects, Scores ObjectScores::*which) {
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

}  // namespace splat::eval
