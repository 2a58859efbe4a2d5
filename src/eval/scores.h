#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "eval/image_scores.h"
#include "eval/image_table.h"
#include "eval/ledger.h"
#include "model/lpips_net.h"
#include "predict/predictor.h"
#include "predict/view_source.h"
#include "vk/context.h"

namespace splat::eval {

/// The network of LPIPS and the context that it runs on; by default none.
struct Lpips {
    vk::Context* context = nullptr;
    model::LpipsNet* net = nullptr;
};

/// Means over views, NaN if there are none. A perfect view (without any difference) has no PSNR and is
/// only counted.
struct Scores {
    double psnr = 0, ssim = 0;
    double lpips = 0;  ///< NaN without the weights of its network
    std::uint32_t views = 0;
    std::uint32_t perfect = 0;

    void add(const ImageScores& view, double distance);
    void finish();  ///< sums to means
};

/// The means by the names that files give them.
inline constexpr struct {
    const char* name;
    double Scores::*mean;
} kScoreMeans[] = {{"psnr", &Scores::psnr}, {"ssim", &Scores::ssim}, {"lpips", &Scores::lpips}};

/// Scores of one object in its conditioning and its novel views.
struct ObjectScores {
    std::string name;
    Scores conditioning, novel;  ///< NaN where the ledger finds numbers that are not finite
    std::vector<ViewScores> novel_views;
    std::uint32_t empty = 0;  ///< views whose target is all black, which are skipped
    double predict_seconds = 0, draw_seconds = 0;
    std::uint32_t drawn = 0;
    Ledger ledger;
};

/// The views of an object that are inputs, and those to predict.
struct EvaluatedViews {
    std::vector<std::uint32_t> conditioning, novel;

    [[nodiscard]] std::vector<std::uint32_t> all() const;  ///< the conditioning ones first
};

/// The published protocol of a format of data sets. Conditioning views are number 64 (and 128) of the
/// 251 views of SRN's test objects, 0 and 30 for two views of CO3D, else the first ones. Novel views are
/// all others, or `most` of them, evenly spread, unless that is 0. Errors: kFormat if there are
/// no novel views.
Result<EvaluatedViews> evaluated_views(std::uint32_t views_of_object, std::uint32_t inputs,
                                       std::uint32_t most, std::string_view format = {});

/// The same where a list names the first conditioning view, as NMR's does; the others are the first of the rest.
/// Errors: also kInvalidArgument for a view that is not there.
Result<EvaluatedViews> evaluated_views_from(std::uint32_t source, std::uint32_t views_of_object,
                                            std::uint32_t inputs, std::uint32_t most);

/// The same with given conditioning views. Errors: also kInvalidArgument for one that is not there or given
/// twice.
Result<EvaluatedViews> evaluated_views(std::uint32_t views_of_object,
                                       std::span<const std::uint32_t> conditioning,
                                       std::uint32_t most);

/// Predict an object and draw all of `views`: images [n,3,R,R]. Sets the times and the ledger of `scores`.
/// Locks the context for each operation of the device; other threads may use the predictor in between.
Result<std::vector<float>> draw_object(vk::Context& context, predict::Predictor& predictor,
                                       const predict::Views& views, ObjectScores& scores);

/// Compare `images` with those of `views`, which are `which`. Locks the context of LPIPS for each distance.
/// Errors: kShape for another number of images; those of the device.
Status score_images(const Lpips& lpips, std::span<const float> images, const predict::Views& views,
                    const EvaluatedViews& which, std::uint32_t side, ObjectScores& scores);

/// Read, predict, draw and score an object. `images` gets what was drawn, conditioning views first, and
/// `truths` the targets, [n,3,R,R]; either may be null. Errors: those of ViewSource::read, draw_object()
/// and score_images().
Result<ObjectScores> score_object(vk::Context& context, predict::Predictor& predictor,
                                  const predict::ViewSource& data, std::uint32_t object,
                                  const EvaluatedViews& which, const Lpips& lpips = {},
                                  std::vector<float>* images = nullptr,
                                  std::vector<float>* truths = nullptr);

/// The mean over objects, each counting the same; NaN if an object's scores are.
Scores mean_of(std::span<const ObjectScores> objects, Scores ObjectScores::*which);

}  // namespace splat::eval
