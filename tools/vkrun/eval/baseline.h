#pragma once

#include <memory>
#include <string>

#include "vkrun/cli/json.h"
#include "vkrun/eval/object_views.h"

namespace vkrun {

/// A simple method to compare a network with.
class Baseline {
  public:
    virtual ~Baseline() = default;

    /// Images [n,3,R,R] of all views of an object. Throws a Failure.
    virtual std::vector<float> draw(const ObjectViews& views) = 0;
};

/// The mean of all images of a data set, for any object and view.
class MeanImage : public Baseline {
  public:
    explicit MeanImage(splat_dataset data);
    std::vector<float> draw(const ObjectViews& views) override;

  private:
    std::vector<float> mean_;  ///< [3,R,R]
};

/// The first view as a flat picture that faces its camera: one Gaussian per pixel, in the plane whose
/// depth between `near` and `far` gives the novel views their best mean PSNR: a choice that needs the truth.
class Billboard : public Baseline {
  public:
    Billboard(splat_device device, double near, double far, float background)
        : device_(device),
          near_(near),
          far_(far),
          background_{background, background, background} {}
    std::vector<float> draw(const ObjectViews& views) override;

  private:
    splat_device device_;
    double near_, far_;
    float background_[3];
};

/// name  "" (none), "mean", of the training images that the configuration and `root` name, or "billboard".
/// Throws a Failure.
std::unique_ptr<Baseline> make_baseline(const std::string& name, splat_device device,
                                        const Json& config, const std::string& root);

}  // namespace vkrun
