#pragma once

#include <cstdint>
#include <vector>

#include "fit/fit_set.h"

namespace splat::fit {

/// Views of a step: two cost less than two steps of one.
inline constexpr std::uint32_t kStepViews = 2;

/// Most steps of a schedule, which holds 8 bytes for each.
inline constexpr std::uint64_t kMostSteps = 10'000'000;

/// How a fit grows, and what it leaves out.
struct Strategy {
    /// Relocate faint Gaussians and add new ones by opacity, with noise and regularisers (Kheradmand et al. 2024),
    /// instead of splitting by gradients (growth.h).
    bool mcmc = false;
    double mcmc_noise = 5e5;  ///< in units of the means' rate, for cameras within a radius of 5
    double opacity_weight = 0.01, scale_weight = 0.01;  ///< mcmc's regularisers
    std::uint64_t growth_every = 0;                     ///< steps; 0: by the length of the fit
    double rate = 1;                                    ///< factor of all rates
    bool skip_sizes = true;    ///< draw small views at first, instead of full ones
    bool skip_bands = true;    ///< begin with a degree of 0, instead of the highest
    bool skip_unseen = false;  ///< leave parameters without gradient, with their moments
    bool skip_tiles = true;    ///< leave out tiles without a valid pixel
};

/// What the length of a step depends on.
struct ScheduleDesc {
    std::uint32_t gaussians = 0;       ///< there are to begin with
    std::uint32_t most_gaussians = 0;  ///< 0: by the length of the fit
    double pixels = 0;                 ///< mean of the views, at the fit's size
    double extent = 1;                 ///< radius of the cameras, scene units
    std::uint32_t sh_degree = 3;       ///< the highest
    std::uint32_t least_degree = 0;    ///< degree of a scene to begin with
    std::uint32_t capacity = ~0U;      ///< Gaussians for which there is memory
    Strategy strategy = {};
};

/// One step of a schedule.
struct StepPlan {
    float fraction = 0;       ///< share of the fit's time before the step
    std::uint8_t factor = 1;  ///< views are drawn at 1 / factor of their size
    std::uint8_t degree = 0;  ///< active degree of the harmonics
};

/// Milliseconds of a step by the cost model: least squares over fits on two CPU cores. Only ratios of steps matter
/// to a schedule; what a machine takes is measured by the fit.
double step_milliseconds(double gaussians, std::uint32_t sh_degree, double pixels);

/// How a fit goes on from its first to its last step: sizes of views, degrees, rates and growth, chosen by its
/// length. The same for the same numbers on every machine.
class Schedule {
  public:
    /// A fit of 1 to kMostSteps steps.
    static Schedule of_steps(const ScheduleDesc& desc, std::uint64_t steps);
    /// A fit of so many seconds of the cost model, or of kMostSteps steps.
    static Schedule of_seconds(const ScheduleDesc& desc, double seconds);

    [[nodiscard]] const ScheduleDesc& desc() const { return desc_; }
    [[nodiscard]] std::uint64_t steps() const { return plan_.size(); }
    /// Steps count from 0.
    [[nodiscard]] const StepPlan& at(std::uint64_t step) const { return plan_[step]; }
    [[nodiscard]] Rates rates(double fraction) const;
    /// Gaussians at the start, and at most.
    [[nodiscard]] std::uint32_t first_gaussians() const { return first_; }
    [[nodiscard]] std::uint32_t most_gaussians() const { return most_; }

    /// True if Gaussians are split before a later step, so that their gradients must be summed.
    [[nodiscard]] bool splits_after(std::uint64_t step) const {
        return !desc_.strategy.mcmc && static_cast<double>(at(step).fraction) <= shape_.growth_to;
    }
    /// True if the set is rearranged before the step: faint Gaussians are dropped, and others split.
    [[nodiscard]] bool grows(std::uint64_t step) const;
    /// How many Gaussians there should be then; none are added once growth has ended.
    [[nodiscard]] std::uint32_t wanted(double fraction) const;

  private:
    /// What depends on the length of a fit.
    struct Shape {
        double seconds;  ///< length, by the cost model
        double most_gaussians;
        double rate;                  ///< factor of all rates
        double rate_at_end;           ///< factor at the end, of all but the means' rate
        double half_from, full_from;  ///< fractions: views at half and at full size
        double degree_from[3];        ///< degrees 1 to 3
        double growth_from, growth_to;
    };
    static const Shape kShapes[];
    static Shape shape_of(double seconds);
    explicit Schedule(const ScheduleDesc& desc) : desc_(desc) {}
    void build(double seconds);

    ScheduleDesc desc_;
    Shape shape_{};
    std::uint32_t first_ = 0, most_ = 0;
    std::vector<StepPlan> plan_;
};

}  // namespace splat::fit
