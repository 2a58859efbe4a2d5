#pragma once

#include <string>
#include <vector>

#include "stress/network.h"
#include "stress/raster_bound.h"

namespace vkrun::stress {

/// A network with Gaussians as outputs, a camera, and a loss of the image.
struct WholeStep {
    std::string name;
    std::string input;
    Network net;
    std::vector<std::size_t> outputs;  ///< gaussian_head's: means, opacities, scales, rotations, sh
    RasterScene scene;                 ///< without Gaussians
    std::string loss;                  ///< an operator of two images
    std::vector<float> target;         ///< [1,3,H,W]
};
std::vector<WholeStep> whole_steps();

/// [H,W,3] to [3,H,W], and back.
template <class Real>
std::vector<Real> planes_of(const std::vector<Real>& pixels) {
    std::vector<Real> planes(pixels.size());
    const std::size_t count = pixels.size() / 3;
    for (std::size_t i = 0; i < pixels.size(); ++i) planes[i % 3 * count + i / 3] = pixels[i];
    return planes;
}
template <class Real>
std::vector<Real> pixels_of(const std::vector<Real>& planes) {
    std::vector<Real> pixels(planes.size());
    const std::size_t count = planes.size() / 3;
    for (std::size_t i = 0; i < planes.size(); ++i) pixels[i] = planes[i % 3 * count + i / 3];
    return pixels;
}

/// The scene of a step with the Gaussians of its head.
RasterScene scene_of(const WholeStep& step, const std::vector<Numbers>& head);

/// A step in float64.
class WholeInDouble {
  public:
    explicit WholeInDouble(const WholeStep& step) : step_(step), net(step.net) {}

    double forward(NetNoise* noise);
    void backward(NetNoise* noise);  ///< to net.gradients

  private:
    [[nodiscard]] splat::ref::OpArguments loss_arguments() const;

    const WholeStep& step_;
    RasterScene scene_;
    splat::ref::ProjectForward<double> projected_;
    Numbers rgb_;

  public:
    NetworkInDouble net;
};

}  // namespace vkrun::stress
