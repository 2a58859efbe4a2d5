#pragma once

#include <memory>

#include "vkrun/cli/json.h"
#include "vkrun/data/view_source.h"
#include "vkrun/eval/scores.h"

namespace vkrun {

/// The mean of all images of `data`, for any object and view.
class MeanImage : public Predictor {
  public:
    explicit MeanImage(const ViewSource& data);
    std::vector<float> draw(const Views& views, const EvaluatedViews& which,
                            ObjectScores& result) override;

  private:
    std::vector<float> mean_;  ///< [3,R,R]
};

/// The first view as a flat picture that faces its camera: one Gaussian per pixel, in the plane whose
/// depth between `near` and `far` gives the novel views their best mean PSNR: a choice that needs the truth.
class Billboard : public Predictor {
  public:
    Billboard(Network& network, double near, double far)
        : network_(network), near_(near), far_(far) {}
    std::vector<float> draw(const Views& views, const EvaluatedViews& which,
                            ObjectScores& result) override;

  private:
    Network& network_;
    double near_, far_;
};

/// name  "mean", of the training images that the configuration and `root` name, or "billboard". Throws a Failure.
std::unique_ptr<Predictor> make_baseline(const std::string& name, Network& network,
                                         const Json& config, const std::string& root);

}  // namespace vkrun
