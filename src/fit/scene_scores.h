#pragma once

#include <memory>

#include "data/posed_photos.h"
#include "raster/rasterizer.h"
#include "run/run.h"

namespace splat::fit {

/// The cameras of photographs as a fit sees them.
struct PhotoFrame {
    scene::Vec3 center{0};  ///< mean of the cameras; the origin of a fit, for float32's sake
    double extent = 1;      ///< radius of the cameras, scene units

    /// Near plane of a fit and of its scores, scene units.
    [[nodiscard]] double near_plane() const { return 0.0025 * extent; }
};

/// data::load_posed_photos(), which splat_device_cancel ends: kCancelled.
Result<data::PosedPhotos> load_photos(vk::Context& context, const std::string& folder,
                                      data::PosedPhotosOptions options);

/// Moves the cameras so that their center is the origin.
PhotoFrame center_photos(std::span<data::PosedPhoto> photos);

/// Compares a drawn view with its photograph, over the pixels that are there: fills `done` with name, size, both
/// images, "val_psnr" (dB) and "val_ssim". The drawn image is cut to 0 to 1.
///
/// drawn        [3,height,width]
/// border       0 to below 0.5; above 0 there are also "inner_psnr" and "inner_ssim", over the pixels at least that
///              share of the width and height away from the edges; NaN if none is there
Status score_photo(const data::PosedPhoto& photo, std::vector<float> drawn, double border,
                   run::Piece& done);

/// Means over views, each over those that have the score.
run::Numbers mean_scores(std::span<const run::Numbers> views);

struct SceneScoresDesc {
    std::string data;                 ///< folder of photographs and cameras
    data::PosedPhotosOptions photos;  ///< test_every 0: all photographs are scored
    double border = 0;                ///< argument of score_photo()
};

/// Scores a scene on photographs that are held out, one a call, then their means, as a fit scores itself. The scene is
/// drawn as its file says.
///
/// Locks the context's mutex around each view.
class SceneScores : public run::Work {
  public:
    /// `scene` is in the photographs' frame. Errors: those of load_posed_photos(); kInvalidArgument for a scene without
    /// Gaussians, a border out of its range, and no photograph that is held out.
    static Result<std::unique_ptr<SceneScores>> open(std::shared_ptr<vk::Context> context,
                                                     const SceneScoresDesc& desc,
                                                     scene::Gaussians scene,
                                                     const Interrupt& interrupt);
    ~SceneScores() override;

    /// Errors: those of the rasterizer and of Context::run; kInvalidArgument for a drawn image that is not finite.
    Status next(run::Event& event) override;
    [[nodiscard]] run::Figures figures() const override;

  private:
    /// What needs the context's mutex to be destroyed.
    struct OnDevice : vk::DeferredWork {
        std::unique_ptr<raster::Rasterizer> rasterizer;
        gaussians::GaussianSet set;
    };

    SceneScores(std::shared_ptr<vk::Context> context, double border, const Interrupt& interrupt)
        : context_(std::move(context)),
          border_(border),
          interrupt_(interrupt),
          device_(std::make_unique<OnDevice>()) {}
    Result<std::vector<float>> draw(const scene::Camera& camera);
    Status score(run::Event& event);
    void sum_up(run::Event& event);

    std::shared_ptr<vk::Context> context_;
    double border_;
    const Interrupt& interrupt_;
    const std::uint64_t raised_before_ = interrupt_.count();
    std::unique_ptr<OnDevice> device_;
    raster::RasterDesc raster_;          ///< but the size
    std::array<float, 3> background_{};  ///< 0 or 1, which are the same linear and in sRGB
    bool linear_colors_ = false;         ///< images are converted to sRGB
    std::vector<data::PosedPhoto> photos_;
    run::Messages messages_;
    std::uint32_t piece_ = 0;  ///< the next one
    std::vector<run::Numbers> scores_;
    std::optional<run::EventKind> ended_;
    double psnr_ = NAN, ssim_ = NAN;
};

}  // namespace splat::fit
