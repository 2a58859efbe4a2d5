#pragma once

#include "vkrun/config/image_channels.h"
#include "vkrun/data/view_source.h"
#include "vkrun/predict/network.h"

namespace vkrun {

/// Means over views, NaN if there are none. A perfect view (no difference at all) has no PSNR and is only
/// counted.
struct Scores {
    double psnr = 0, ssim = 0;
    double lpips = 0;  ///< NaN without the weights of its network
    std::uint32_t views = 0;
    std::uint32_t perfect = 0;

    void add(const splat_image_scores& view, double distance);
    void finish();  ///< sums to means
};

/// A target that is black all over: left out, as published figures do.
bool is_black(const float* image, std::size_t count);

/// How well one object was predicted, from its conditioning views and from others.
struct ObjectScores {
    std::string name;
    Scores conditioning, novel;
    std::uint32_t empty = 0;  ///< black views
    double predict_seconds = 0, draw_seconds = 0;
    std::uint32_t drawn = 0;
};

/// Which views of an object are given and which are asked for.
struct EvaluatedViews {
    std::vector<std::uint32_t> conditioning, novel;
};

/// View 64 (and 128) of an object of the 251 views of SRN's tests, else the first; all others are
/// novel, or `most` of them, evenly spread, unless that is 0.
EvaluatedViews evaluated_views(std::uint32_t views_of_object, std::uint32_t inputs,
                               std::uint32_t most);

/// What is scored: draws all views of an object, knowing the conditioning ones.
class Predictor {
  public:
    virtual ~Predictor() = default;

    /// Images [n,3,R,R] of `views`, the conditioning ones first; `result` takes the times.
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

/// Draw an object and compare; with `lpips`, that too. `images`, if not null, gets what was drawn,
/// conditioning views first, and `truths` the targets, [n,3,R,R].
ObjectScores score_object(Predictor& predictor, const ImageChannels& channels,
                          const ViewSource& data, std::uint32_t object, const EvaluatedViews& views,
                          splat_lpips lpips, std::vector<float>* images = nullptr,
                          std::vector<float>* truths = nullptr);

/// The mean over objects, each counting the same.
Scores mean_of(const std::vector<ObjectScores>& objects, Scores ObjectScores::*which);

}  // namespace vkrun
