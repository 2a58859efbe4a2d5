#pragma once

#include "vkrun/config/image_channels.h"
#include "vkrun/data/view_source.h"
#include "vkrun/predict/network.h"

namespace vkrun {

/// Means over views, NaN if there are none. A perfect view (without any difference) has no PSNR and is only
/// counted.
struct Scores {
    double psnr = 0, ssim = 0;
    double lpips = 0;  ///< NaN without the weights of its network
    std::uint32_t views = 0;
    std::uint32_t perfect = 0;

    void add(const splat_image_scores& view, double distance);
    void finish();  ///< sums to means
};

/// Whether a target is all black; such views are skipped, as in published figures.
bool is_black(const float* image, std::size_t count);

/// Scores of one object in its conditioning and its novel views.
struct ObjectScores {
    std::string name;
    Scores conditioning, novel;
    std::uint32_t empty = 0;  ///< black views
    double predict_seconds = 0, draw_seconds = 0;
    std::uint32_t drawn = 0;
};

/// The views of an object that are inputs, and those to predict.
struct EvaluatedViews {
    std::vector<std::uint32_t> conditioning, novel;
};

/// Conditioning views are 64 (and 128) of the 251 views of SRN's test objects, else the first ones.
/// Novel views are all others, or `most` of them, evenly spread, unless that is 0.
EvaluatedViews evaluated_views(std::uint32_t views_of_object, std::uint32_t inputs,
                               std::uint32_t most);

/// The method under test: it draws all views of an object from the conditioning ones.
class Predictor {
  public:
    virtual ~Predictor() = default;

    /// Images [n,3,R,R] of `views`, the conditioning ones first. Sets the times in `result`.
    virtual std::vector<float> draw(const Views& views, const EvaluatedViews& which,
                                    ObjectScores& result) = 0;
};

class NetworkPredictor : public Predictor {
  public:
    explicit NetworkPredictor(Network& network) : network_(network) {}
    std::vector<float> draw(const Views& views, const EvaluatedViews& which,
                            ObjectScores& result) override;

  private:
    Network& network_;
};

/// Draw an object and compare it with its images, by LPIPS too unless `lpips` is null. `images` gets
/// what was drawn, conditioning views first, and `truths` the targets, [n,3,R,R]; either may be null.
ObjectScores score_object(Predictor& predictor, const ImageChannels& channels,
                          const ViewSource& data, std::uint32_t object, const EvaluatedViews& views,
                          splat_lpips lpips, std::vector<float>* images = nullptr,
                          std::vector<float>* truths = nullptr);

/// The mean over objects, each counting the same.
Scores mean_of(const std::vector<ObjectScores>& objects, Scores ObjectScores::*which);

}  // namespace vkrun
