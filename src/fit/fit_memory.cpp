#include "fit/fit_memory.h"

#include <algorithm>
#include <set>

#include "core/checked_math.h"
#include "core/os/memory.h"

namespace splat::fit {
namespace {

constexpr std::uint32_t kLeastGaussians = 5000;
constexpr std::uint32_t kLeastSide = 32;  ///< pixels of a view
constexpr std::uint32_t kMostFactor = 64;

/// A pair beyond those that a rasterizer begins with: two entries with their slots, a record of its gradient, a rank.
constexpr double kPairBytes = 76;
constexpr double kFirstPairs = 4;  ///< for each Gaussian of each view
/// Most pairs of a view in fits of 50 photographs of 270 x 480 and 540 x 960 pixels, and half as many again.
constexpr double kTilePairs = 75, kGaussianPairs = 2;
constexpr double kPairGrowth = 1.25;  ///< arrays are made longer than it takes

std::uint64_t whole(double bytes) {
    return static_cast<std::uint64_t>(bytes);
}

}  // namespace

std::string megabytes(std::uint64_t bytes) {
    return format("%llu MB", llu((bytes + 500'000) / 1'000'000));
}

FitMemory fit_memory(const FitCosts& costs, std::span<const data::PosedPhoto> photos,
                     std::uint32_t gaussians, std::uint32_t factor) {
    std::set<std::pair<std::uint64_t, std::uint64_t>> sizes;  // pixels and tiles
    std::uint64_t fitted = 0;                                 // pixels
    for (const data::PosedPhoto& photo : photos) {
        const std::uint64_t width = photo.width / factor, height = photo.height / factor;
        sizes.insert({width * height, ceil_div(width, 16) * ceil_div(height, 16)});
        fitted += photo.held_out ? 0 : width * height;
    }
    const double count = gaussians;
    FitMemory needs;
    needs.photographs = whole(costs.photo_pixel * static_cast<double>(fitted));
    needs.gaussians = whole((costs.gaussian + costs.moved) * count);
    std::size_t canvases = 0;
    for (auto size = sizes.rbegin(); size != sizes.rend() && canvases < kMostCanvases; ++size) {
        ++canvases;
        const auto pixels = static_cast<double>(size->first);
        const double pairs =
            kPairGrowth * kStepViews *
            (kTilePairs * static_cast<double>(size->second) + kGaussianPairs * count);
        needs.rasterizer +=
            whole(costs.item * count + costs.drawn_pixel * pixels +
                  kPairBytes * std::max(pairs - kFirstPairs * kStepViews * count, 0.0));
        needs.loss += whole(costs.loss_pixel * pixels);
    }
    needs.blocks = vk::MemoryDesc().block_bytes;
    // Photographs of half the sides, and a state, which is about as large as what it is read from.
    needs.host =
        whole(costs.photo_pixel * static_cast<double>(fitted) / 4 + costs.gaussian * count);
    return needs;
}

Result<MemoryPlan> plan_memory(const FitCosts& costs, std::span<const data::PosedPhoto> photos,
                               std::uint64_t bytes, bool is_cpu, const MemoryWish& wish) {
    MemoryPlan plan;
    plan.factor = wish.factor;
    const std::uint32_t wanted = wish.gaussians;
    const auto fits = [&](std::uint32_t gaussians) {
        plan.gaussians = gaussians;
        plan.needs = fit_memory(costs, photos, gaussians, plan.factor);
        return plan.needs.device() + (is_cpu ? plan.needs.host : 0) <= bytes;
    };
    std::uint32_t side = UINT32_MAX;
    for (const data::PosedPhoto& photo : photos) side = std::min({side, photo.width, photo.height});
    const std::uint32_t least =
        std::min(wanted, std::max({wanted / 4, kLeastGaussians, wish.least}));
    for (;; plan.factor *= 2) {
        if (fits(wanted)) return plan;
        if (fits(least)) break;
        if (2 * plan.factor > kMostFactor || side / (2 * plan.factor) < kLeastSide)
            return error(
                Code::kOutOfDeviceMemory,
                "the fit needs about %s%s even with %u Gaussians and 1/%u of the "
                "photographs' sides, but has %s: allow more memory, or fit fewer "
                "photographs or Gaussians",
                megabytes(plan.needs.device()).c_str(),
                is_cpu
                    ? format(", and %s of the host's,", megabytes(plan.needs.host).c_str()).c_str()
                    : "",
                least, plan.factor, megabytes(bytes).c_str());
    }
    std::uint32_t low = least, high = wanted;  // low fits, high does not
    while (high - low > 1) {
        const std::uint32_t middle = low + (high - low) / 2;
        (fits(middle) ? low : high) = middle;
    }
    (void)fits(low);
    return plan;
}

std::uint64_t memory_left(vk::Context& context) {
    const vk::MemoryUse use = context.memory().use();
    std::uint64_t left = use.budget - std::min(use.used, use.budget);
    if (context.device().info().kind != vk::DeviceKind::kCpu) return left;
    const std::uint64_t machine = os::machine_bytes_left();
    return machine == 0 ? left : std::min(left, machine);
}

// The parts of a fit are measured by small ones, as all of them are proportional to Gaussians and pixels.
Result<FitCosts> Fitter::costs(vk::Context& context, std::uint32_t sh_degree, bool maps, bool poses,
                               bool exposure) {
    struct Taken {
        double set, drawn, loss;
    };
    const auto take = [&](std::uint32_t gaussians, std::uint32_t side) -> Result<Taken> {
        const auto live = [&] { return static_cast<double>(context.memory().use().live); };
        const double before = live();
        const ScheduleDesc desc{
            .gaussians = gaussians, .most_gaussians = gaussians, .sh_degree = sh_degree};
        data::PosedPhoto photo;
        photo.width = photo.height = side;
        if (maps) photo.nearness = {0};
        SPLAT_ASSIGN(const auto small, create(context, {.photos = {std::move(photo)},
                                                        .schedule = Schedule::of_steps(desc, 1),
                                                        .refine_poses = poses,
                                                        .refine_exposure = exposure}));
        const double set = live() - before;
        SPLAT_ASSIGN(Canvas* const made, small->canvas(side, side, true, 1));
        const auto drawn = static_cast<double>(made->rasterizer->workspace().bytes());
        return Taken{set, drawn, live() - before - set - drawn};
    };
    constexpr std::uint32_t kFew = 4096, kSmall = 64;
    SPLAT_ASSIGN(const Taken few, take(kFew, kSmall));
    SPLAT_ASSIGN(const Taken many, take(2 * kFew, kSmall));
    SPLAT_ASSIGN(const Taken wide, take(kFew, 2 * kSmall));
    const double pixels = 3.0 * kSmall * kSmall;
    const gaussians::SetDesc desc{.sh_degree = sh_degree};
    return FitCosts{.gaussian = (many.set - few.set) / kFew,
                    .moved = 12 + 16.0 * std::max(desc.color_quads(), 3U),
                    .item = (many.drawn - few.drawn) / kFew,
                    .drawn_pixel = (wide.drawn - few.drawn) / pixels,
                    .loss_pixel = (wide.loss - few.loss) / pixels,
                    .photo_pixel = maps ? 12.0 : 4.0};
}

std::string Fitter::spare() {
    canvases_.clear();  // made for fewer Gaussians and views
    if (spared_.most_gaussians > set_.count()) {
        spared_.most_gaussians = set_.count();
        return format("from here on there are at most %u Gaussians", set_.count());
    }
    if (spared_.views > 1) {
        spared_.views = 1;
        return "from here on a step draws one view";
    }
    return {};
}

}  // namespace splat::fit
