// Times the rasterizer: two devices draw each view alternately.

#include "bench/raster/raster_bench.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>

#include "bench/median.h"
#include "bench/raster/raster_reference.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/stopwatch.h"

namespace vkrun::bench {
namespace {

/// Timing repeats calls, so the skip of unchanged ones is off.
constexpr std::uint32_t kDrawAlways = SPLAT_SKIP_UNCHANGED;

/// One rasterizer with the tensors of its gradients.
class Side {
  public:
    Side(splat_device device, const RasterCase& from, std::uint32_t disabled_skips, bool backward,
         std::uint32_t most_degree = 3)
        : device_(device), from_(from) {
        auto info = sized<splat_scene_info>();
        check(splat_scene_get_info(from.scene.get(), &info));
        auto desc = sized<splat_rasterizer_desc>();
        desc.flags = backward ? SPLAT_RASTERIZER_BACKWARD : 0;
        desc.flags |= info.drawn_as;
        desc.gaussians = static_cast<std::uint32_t>(info.count);
        desc.width = from.cameras[0].width;
        desc.height = from.cameras[0].height;
        desc.sh_degree = std::min(info.sh_degree, most_degree);
        desc.convention = from.convention;
        desc.disabled_skips = disabled_skips;
        check(splat_rasterizer_create(device, &desc, rasterizer_.out()));
        if (!backward) return;
        const auto n = static_cast<std::int64_t>(info.count);
        const std::int64_t terms = std::int64_t{info.sh_degree + 1} * (info.sh_degree + 1);
        shapes_ = {{"means", {n, 3}},
                   {"scales", {n, 3}},
                   {"rotations", {n, 4}},
                   {"opacities", {n}},
                   {"sh", {n, terms, 3}}};
        for (const auto& [name, dims] : shapes_)
            gradients_[name] = make_tensor(device, "grad_" + name, dims, {});
    }

    void forward(std::size_t view) {
        check(splat_rasterizer_forward_scene(rasterizer_.get(), nullptr, from_.scene.get(),
                                             &from_.cameras[view], 1, from_.background));
    }

    void set_loss(const std::vector<float>& grad_rgb) {
        grad_rgb_ = make_tensor(device_, "grad_rgb",
                                {1, from_.cameras[0].height, from_.cameras[0].width, 3}, grad_rgb);
    }

    void backward() {
        auto desc = sized<splat_gradients_desc>();
        desc.grad_rgb = grad_rgb_.get();
        desc.grad_means = gradients_.at("means").get();
        desc.grad_scales = gradients_.at("scales").get();
        desc.grad_rotations = gradients_.at("rotations").get();
        desc.grad_opacities = gradients_.at("opacities").get();
        desc.grad_sh = gradients_.at("sh").get();
        check(splat_rasterizer_backward(rasterizer_.get(), nullptr, &desc));
    }

    [[nodiscard]] std::vector<float> rgb() const {
        std::vector<float> values(std::size_t{3} * from_.cameras[0].width *
                                  from_.cameras[0].height);
        check(splat_rasterizer_read(rasterizer_.get(), nullptr, SPLAT_OUTPUT_RGB, values.data(),
                                    values.size() * sizeof(float)));
        return values;
    }

    [[nodiscard]] std::map<std::string, std::vector<float>> gradients() const {
        std::map<std::string, std::vector<float>> values;
        for (const auto& [name, tensor] : gradients_) values[name] = read_tensor(tensor.get());
        return values;
    }

    [[nodiscard]] splat_rasterizer_info info() const {
        auto info = sized<splat_rasterizer_info>();
        check(splat_rasterizer_get_info(rasterizer_.get(), nullptr, &info));
        return info;
    }

    [[nodiscard]] splat_device device() const { return device_; }

  private:
    splat_device device_;
    const RasterCase& from_;
    Rasterizer rasterizer_;
    Tensor grad_rgb_;
    std::map<std::string, std::vector<std::int64_t>> shapes_;
    std::map<std::string, Tensor> gradients_;
};

/// Copies between the caller's layout and the packed one are counted apart from the rasterizer's stages.
std::string stage_of(const std::string& op) {
    return op == "strided_copy" || op == "fill" ? "layout" : op;
}

using StageTimes = std::map<std::string, double>;

/// Device time of each stage of one call.
StageTimes stages_of(splat_device device, const std::function<void()>& call) {
    check(splat_device_profile_reset(device));
    call();
    const auto profile = library_json(splat_device_profile_json, device);
    StageTimes times;
    for (const Json& row : profile.at("ops"))
        times[stage_of(row.at("op").get<std::string>())] += row.at("total_ms").get<double>();
    return times;
}

void take_minima(StageTimes& shortest, const StageTimes& times) {
    for (const auto& [stage, ms] : times) {
        const auto [at, is_new] = shortest.emplace(stage, ms);
        if (!is_new) at->second = std::min(at->second, ms);
    }
}

/// True to measure another round: until the wanted time has passed and, if that takes at most ten times as
/// long, for `rounds` rounds.
bool more_rounds(int round, int rounds, double passed, double wanted) {
    return passed < wanted || (round < rounds && passed < 10 * wanted);
}

/// A rasterizer that only draws, and one that keeps what its backward pass needs.
struct Sides {
    Side render, train;
    RasterFigures* figures;

    Sides(splat_device device, const RasterCase& from, RasterFigures& into)
        : render(device, from, kDrawAlways, false),
          train(device, from, kDrawAlways, true),
          figures(&into) {}
};

/// All views once.
void round_of(Sides& sides, std::size_t views) {
    for (std::size_t view = 0; view < views; ++view) {
        sides.figures->render.wall_ms.push_back(timed_ms([&] { sides.render.forward(view); }));
        sides.figures->forward.wall_ms.push_back(timed_ms([&] { sides.train.forward(view); }));
        sides.figures->backward.wall_ms.push_back(timed_ms([&] { sides.train.backward(); }));
    }
}

void warm_up(Sides& sides, const RasterReference& reference) {
    sides.render.forward(0);
    sides.train.forward(0);
    sides.train.set_loss(reference.grad_rgb());
    sides.train.backward();
    sides.figures->error = reference.compare(sides.train.rgb(), sides.train.gradients());
}

/// The shortest time of some rounds for each view and stage, as the mean over the views.
void profile_stages(Sides& sides, std::size_t views, double seconds) {
    const std::pair<RasterTimes*, std::function<void(std::size_t)>> directions[] = {
        {&sides.figures->render, [&](std::size_t view) { sides.render.forward(view); }},
        {&sides.figures->forward, [&](std::size_t view) { sides.train.forward(view); }},
        {&sides.figures->backward, [&](std::size_t) { sides.train.backward(); }}};
    std::vector<std::array<StageTimes, 3>> shortest(views);
    const Stopwatch watch;
    for (int round = 0; round < 1 || more_rounds(round, 3, watch.seconds(), seconds); ++round) {
        for (std::size_t view = 0; view < views; ++view) {
            for (std::size_t i = 0; i < 3; ++i)
                take_minima(shortest[view][i],
                            stages_of(sides.train.device(), [&] { directions[i].second(view); }));
            if (round == 0)
                sides.figures->mean_pairs +=
                    static_cast<double>(sides.train.info().pairs) / static_cast<double>(views);
        }
    }
    for (const std::array<StageTimes, 3>& view : shortest)
        for (std::size_t i = 0; i < 3; ++i)
            for (const auto& [stage, ms] : view[i])
                directions[i].first->stage_ms[stage] += ms / static_cast<double>(views);
    sides.figures->info = sides.train.info();
}

struct Skip {
    const char* name;
    std::uint32_t bit;
    bool backward;  ///< the backward kernels have this skip, too
};
constexpr Skip kSkips[] = {{"opacity_extent", SPLAT_SKIP_OPACITY_EXTENT, false},
                           {"exact_tiles", SPLAT_SKIP_EXACT_TILES, false},
                           {"cull", SPLAT_SKIP_CULL, false},
                           {"blocks", SPLAT_SKIP_BLOCKS, true},
                           {"early_out", SPLAT_SKIP_EARLY_OUT, true},
                           {"all of them",
                            SPLAT_SKIP_OPACITY_EXTENT | SPLAT_SKIP_EXACT_TILES | SPLAT_SKIP_CULL |
                                SPLAT_SKIP_BLOCKS | SPLAT_SKIP_EARLY_OUT,
                            true},
                           {"unchanged", SPLAT_SKIP_UNCHANGED, false}};

double largest_of(const std::vector<float>& values) {
    double largest = 0;
    for (const float value : values)
        largest = std::max(largest, std::abs(static_cast<double>(value)));
    return largest;
}

double largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        largest =
            std::max(largest, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
    return largest;
}

/// Difference of images, or of gradients relative to the largest of their tensor.
double difference_of(const Side& a, const Side& b, bool backward) {
    if (!backward) return largest_difference(a.rgb(), b.rgb());
    double largest = 0;
    const auto others = b.gradients();
    for (const auto& [name, values] : a.gradients())
        if (const double most = largest_of(values); most > 0)
            largest = std::max(largest, largest_difference(values, others.at(name)) / most);
    return largest;
}

/// What skips are measured on.
struct SkipBench {
    splat_device device;
    const RasterCase& from;
    const RasterReference& reference;
    double seconds;
};

/// Draws the first view. Returns the time of the measured direction; a backward pass needs its forward pass.
double pass(Side& side, bool backward) {
    const double forward_ms = timed_ms([&] { side.forward(0); });
    return backward ? timed_ms([&] { side.backward(); }) : forward_ms;
}

double error_of(const SkipBench& bench, const Side& side, bool backward) {
    const RasterError error = bench.reference.compare(side.rgb(), side.gradients());
    return backward ? error.max_gradient : error.max_rgb;
}

/// most_degree  the degree of spherical harmonics of the side with all skips; less gives another image
SkipFigures measure_skip(const SkipBench& bench, const Skip& skip, bool backward,
                         std::uint32_t most_degree = 3) {
    const std::uint32_t base = skip.bit == SPLAT_SKIP_UNCHANGED ? 0 : kDrawAlways;
    Side with(bench.device, bench.from, base, backward, most_degree);
    Side without(bench.device, bench.from, base | skip.bit, backward);
    SkipFigures figures;
    figures.name = skip.name;
    figures.backward = backward;
    for (Side* side : {&with, &without}) {
        if (backward) side->set_loss(bench.reference.grad_rgb());
        pass(*side, backward);
    }
    figures.max_difference = difference_of(with, without, backward);
    figures.with_error = error_of(bench, with, backward);
    figures.error = error_of(bench, without, backward);
    figures.pairs = without.info().pairs;
    figures.with_pairs = with.info().pairs;
    figures.visible = without.info().visible;
    figures.ms = figures.with_ms = 1e30;
    double spent = 0;
    for (int round = 0; round < 3 || spent < bench.seconds * 1e3; ++round) {
        const double with_ms = pass(with, backward);
        const double ms = pass(without, backward);
        figures.with_ms = std::min(figures.with_ms, with_ms);
        figures.ms = std::min(figures.ms, ms);
        spent += with_ms + ms;
    }
    return figures;
}

std::vector<SkipFigures> measure_skips(const SkipBench& bench, std::uint32_t sh_degree) {
    std::vector<SkipFigures> skips;
    for (const bool backward : {false, true})
        for (const Skip& skip : kSkips)
            if (!backward || skip.backward) skips.push_back(measure_skip(bench, skip, backward));
    for (std::uint32_t degree = sh_degree; degree-- > 0;) {
        const std::string name = "bands above " + std::to_string(degree);
        skips.push_back(measure_skip(bench, {name.c_str(), 0, false}, false, degree));
    }
    return skips;
}

}  // namespace

double RasterTimes::min_ms() const {
    return wall_ms.empty() ? 0 : *std::min_element(wall_ms.begin(), wall_ms.end());
}

double RasterTimes::median_ms() const {
    return median_of(wall_ms);
}

std::uint64_t RasterMeasurement::all_pairs() const {
    return static_cast<std::uint64_t>(std::llround(fast.mean_pairs * static_cast<double>(views)));
}

RasterMeasurement measure_raster(const RasterDevices& devices, const RasterCase& from,
                                 const RasterEffort& effort) {
    RasterMeasurement result;
    auto scene = sized<splat_scene_info>();
    check(splat_scene_get_info(from.scene.get(), &scene));
    result.title = from.title;
    result.gaussians = scene.count;
    result.width = from.cameras[0].width;
    result.height = from.cameras[0].height;
    result.views = from.cameras.size();
    const RasterReference reference(from, effort.samples);
    std::vector<std::unique_ptr<Sides>> contenders;
    if (effort.plain)
        contenders.push_back(std::make_unique<Sides>(devices.plain.get(), from, result.plain));
    contenders.push_back(std::make_unique<Sides>(devices.fast.get(), from, result.fast));
    for (const auto& sides : contenders) {
        sides->figures->kernels = kernels_name(info_of(sides->train.device()).kernels);
        warm_up(*sides, reference);
    }
    const Stopwatch watch;
    for (int round = 0; round < 1 || more_rounds(round, 4, watch.seconds(), effort.seconds);
         ++round) {
        for (const auto& sides : contenders) {
            if (round == 1) sides->figures->forget_times();
            round_of(*sides, result.views);
        }
    }
    contenders.clear();
    for (const bool plain : {true, false}) {
        if (plain && !effort.plain) continue;
        Sides sides((plain ? devices.plain_profiled : devices.fast_profiled).get(), from,
                    plain ? result.plain : result.fast);
        warm_up(sides, reference);
        profile_stages(sides, result.views, effort.seconds / 4);
    }
    if (effort.skips)
        result.skips = measure_skips({devices.fast.get(), from, reference, effort.seconds / 8},
                                     scene.sh_degree);
    if (effort.exact_pairs) result.fewest_pairs = fewest_pairs(from);
    return result;
}

}  // namespace vkrun::bench
