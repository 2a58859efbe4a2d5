#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>

#include "fit/refine.h"
#include "fit/schedule.h"
#include "fit/truths.h"
#include "raster/rasterizer.h"

namespace splat::fit {

/// What one step of a fit did.
struct FitStep {
    double loss = 0;                    ///< mean of the views
    double l1 = 0, ssim = 0;            ///< means over the valid pixels
    double squared = 0;                 ///< mean squared error
    PriorLosses priors;                 ///< without their weights
    bool skipped = false;               ///< loss or Gaussians are not finite: nothing was updated
    std::vector<ViewGradient> refined;  ///< gradients of its views in order, if refined
    raster::RasterStats drawn;
    double raster_seconds = 0, loss_seconds = 0, update_seconds = 0, grow_seconds = 0;
};

/// Canvases that are kept: photographs of many sizes make them anew.
inline constexpr std::size_t kMostCanvases = 3;

/// Bytes of the device that the parts of a fit take.
struct FitCosts {
    double gaussian = 0;  ///< a Gaussian: parameters, moments and gradients
    double moved = 0;     ///< a Gaussian more, while the set is rearranged
    double item = 0;      ///< a Gaussian in the rasterizer of all views of a step
    double drawn_pixel = 0, loss_pixel = 0;  ///< a pixel of these views
    double photo_pixel = 4;                  ///< a pixel of a fitted photograph
};

/// What a fit does without since memory ran out.
struct Spared {
    std::uint32_t most_gaussians = ~0U;  ///< end of growth
    std::uint32_t views = kStepViews;    ///< views of a step
};

/// The image that a rasterizer of one view drew last, [3,height,width].
Result<std::vector<float>> drawn_image(vk::Context& context, const raster::Rasterizer& rasterizer);

/// The optimisation of Gaussians for photographs, a pair of views a step, all of it on the device but the choice of
/// rows that grow.
///
///   loss = (1 - s) L1 + s (1 - SSIM), means over the valid pixels of a view, then over the views; s = 0.2
///
/// and the losses of prior_loss.h for photographs with maps.
///
/// Errors       kOutOfDeviceMemory; those of the rasterizer and of Context::run. A step that failed is tried again by
///              the same call. Where the device failed while it updated, every later call is kInvalidState
/// Determinism  bit-exact for any thread count
/// Source       Kerbl et al. 2023, with the changes that schedule.cpp and growth.h state
class Fitter {
  public:
    struct Desc {
        std::vector<data::PosedPhoto> photos;  ///< photographs to fit
        Schedule schedule;
        std::uint64_t seed = 0;
        double near_plane = 0.01;              ///< scene units
        std::array<float, 3> background = {};  ///< RGB behind the Gaussians
        Priors priors = {};                    ///< for photographs that have maps
        bool refine_poses = false, refine_exposure = false;
    };
    /// Errors: also kUnsupported for more Gaussians or larger photographs than the device takes.
    static Result<std::unique_ptr<Fitter>> create(vk::Context& context, Desc desc);
    static Result<FitCosts> costs(vk::Context& context, std::uint32_t sh_degree, bool maps,
                                  bool poses, bool exposure);

    /// Begin with these Gaussians, or with a state: `grown` and `spared` are those of the fitter that saved it.
    Status begin(const scene::Gaussians& scene) { return set_.begin(scene); }
    Status load(const io::NamedTensors& state, std::uint64_t grown, const Spared& spared);
    Status save(io::NamedTensors& state);

    /// The latest step before which the set was rearranged, so that one that is done again does not grow twice.
    [[nodiscard]] std::uint64_t grown() const { return grown_; }

    /// Take less memory from here on, for a step that ran out of it. Returns how; empty if there is nothing to spare.
    std::string spare();
    [[nodiscard]] const Spared& spared() const { return spared_; }
    void set_spared(const Spared& spared) {
        canvases_.clear();  // made for what was spared before
        spared_ = spared;
    }

    /// Step number `step`, from 0; `attempt` chooses the views.
    Status step(std::uint64_t step, std::uint64_t attempt, FitStep& done);

    /// Draw a view, [3,height,width] over the background. Where memory runs out it is tried again with less, alone.
    Result<std::vector<float>> draw(const scene::Camera& camera, std::uint32_t sh_degree);

    /// The photographs that are fitted, and the refined camera of one.
    [[nodiscard]] std::span<const data::PosedPhoto> photos() const { return photos_; }
    [[nodiscard]] scene::Camera camera(std::size_t i) const {
        return refinement_.camera(i, photos_[i].camera);
    }

    /// Seconds of a step over those of the cost model, by drawing and comparing a few views of each size. Changes
    /// nothing. Takes means, as other work on the machine slows a fit, too.
    Result<double> slowness();

    [[nodiscard]] const Schedule& schedule() const { return schedule_; }
    /// Go by another schedule, of at most as many Gaussians as the first one.
    void set_schedule(Schedule schedule) { schedule_ = std::move(schedule); }
    [[nodiscard]] FitSet& set() { return set_; }

  private:
    using Views = std::vector<const Truth*>;  ///< views of one size
    /// What views of one size need.
    struct Canvas {
        std::unique_ptr<raster::Rasterizer> rasterizer;
        vk::Buffer grad_image, workspace;
        std::vector<vk::Buffer> sums;            ///< one for each view
        vk::Buffer grad_depth, prior_workspace;  ///< where photographs have maps
        std::vector<vk::Buffer> prior_sums;
    };

    Fitter(vk::Context& context, Desc desc, FitSet set)
        : context_(context),
          photos_(std::move(desc.photos)),
          schedule_(std::move(desc.schedule)),
          seed_(desc.seed),
          near_plane_(desc.near_plane),
          background_(desc.background),
          priors_(std::move(desc.priors)),
          set_(std::move(set)),
          refinement_({desc.refine_poses, desc.refine_exposure, schedule_.desc().extent}, photos_) {
    }
    Status use_size(std::uint32_t factor);
    Result<Canvas*> canvas(std::uint32_t width, std::uint32_t height, bool grows,
                           std::uint32_t factor);
    std::size_t view_of(std::uint64_t turn);
    Views views_of(const Truths& truths, std::uint64_t attempt);
    Status grow(std::uint64_t step);
    Status compare(const Views& views, Canvas& canvas, FitStep& done);
    Status read_refined(const Views& views, const Canvas& canvas, FitStep& done);
    [[nodiscard]] std::size_t number_of(const Truth* view) const {
        return static_cast<std::size_t>(view - &truths_->at(0));
    }
    // fitter_priors.cpp
    [[nodiscard]] bool has_priors() const;
    [[nodiscard]] PriorLossDesc prior_desc(const Views& views, std::size_t i) const;
    Status make_priors(const raster::RasterDesc& desc, Canvas& canvas);
    Status record_priors(vk::Recorder& recorder, const Views& views, Canvas& canvas);
    Status read_priors(const Views& views, const Canvas& canvas, FitStep& done);
    Status draw_and_compare(const Views& views, std::uint32_t degree, Canvas& canvas,
                            FitStep& done);

    [[nodiscard]] Status check_size(std::uint32_t width, std::uint32_t height) const;
    [[nodiscard]] std::uint32_t views_at_once(std::uint32_t width, std::uint32_t height) const;
    [[nodiscard]] Status usable() const;
    /// Record by `record(recorder)` and run what must not be done by half, nor cancelled.
    template <class Record>
    Status run_whole(const Record& record);

    vk::Context& context_;
    std::vector<data::PosedPhoto> photos_;
    Schedule schedule_;
    std::uint64_t seed_;
    double near_plane_;
    std::array<float, 3> background_;
    Priors priors_;
    double prior_decay_ = 1;  ///< factor of the weights in the step that goes on
    FitSet set_;
    Refinement refinement_;
    std::vector<std::size_t> order_;  ///< views of the round that goes on
    std::uint64_t round_ = 0;
    std::optional<Truths> truths_;  ///< photographs at 1 / factor_
    std::uint32_t factor_ = 0;
    std::map<std::pair<std::uint32_t, std::uint32_t>, Canvas>
        canvases_;                       ///< by size, the latest ones
    bool canvases_grow_ = true;          ///< they export what growth goes by
    std::uint32_t canvases_factor_ = 0;  ///< they are of photographs at 1 / that
    std::uint64_t grown_ = 0;
    Spared spared_;
    bool broken_ = false;  ///< the device failed while it updated
    vk::Buffer no_depth_;
};

}  // namespace splat::fit
