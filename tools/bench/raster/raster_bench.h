#pragma once

#include <map>
#include <string>
#include <vector>

#include "bench/raster/raster_case.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"

namespace vkrun::bench {

/// Differences to float64 at sampled pixels of the first view.
struct RasterError {
    double max_rgb = 0;       ///< over all samples
    double typical_rgb = 0;   ///< 95 % are below
    double max_gradient = 0;  ///< any attribute, relative to its largest element, or to the
                              ///< largest of all attributes if its own are only rounding
};

/// Times of one set of kernels in one direction, over all views and rounds.
struct RasterTimes {
    std::vector<double> wall_ms;             ///< one per call
    std::map<std::string, double> stage_ms;  ///< device time by stage, shortest, mean over views

    [[nodiscard]] double min_ms() const;
    [[nodiscard]] double median_ms() const;
};

struct RasterFigures {
    std::string kernels;
    RasterTimes render;   ///< forward, by a rasterizer without a backward pass
    RasterTimes forward;  ///< forward, by one that keeps what its backward pass needs
    RasterTimes backward;
    RasterError error;
    double mean_pairs = 0;         ///< over the views
    splat_rasterizer_info info{};  ///< describes the last view

    void forget_times() {
        for (RasterTimes* times : {&render, &forward, &backward}) times->wall_ms.clear();
    }
};

/// What one kind of skip gains in one direction: the first view with and without it.
struct SkipFigures {
    std::string name;
    bool backward = false;
    double ms = 0;       ///< shortest call without it
    double with_ms = 0;  ///< the same with it, in the same rounds
    /// Largest difference of the images, or of the gradients, relative to the largest of their tensor.
    double max_difference = 0;
    double error = 0;       ///< against float64, as RasterError's largest, without it
    double with_error = 0;  ///< the same with it
    std::uint64_t pairs = 0;
    std::uint64_t with_pairs = 0;
    std::uint64_t visible = 0;
};

struct RasterMeasurement {
    std::string title;
    std::uint64_t gaussians = 0;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::size_t views = 0;
    RasterFigures plain;  ///< kernels "" if not requested
    RasterFigures fast;
    std::vector<SkipFigures> skips;
    std::uint64_t fewest_pairs = 0;  ///< pairs of all views; 0 if not requested

    /// Pairs that the fast kernels made, of all views.
    [[nodiscard]] std::uint64_t all_pairs() const;
};

struct RasterEffort {
    double seconds;    ///< for each comparison
    bool plain;        ///< measure the plain kernels, too
    int samples;       ///< pixels compared with float64
    bool exact_pairs;  ///< count the pairs that are needed
    bool skips;        ///< measure each of them
};

/// The same device with each set of kernels; `profiled` ones time their stages, which costs a little.
struct RasterDevices {
    Device plain, fast, plain_profiled, fast_profiled;
};

RasterMeasurement measure_raster(const RasterDevices& devices, const RasterCase& from,
                                 const RasterEffort& effort);

Json raster_json(const RasterMeasurement& measurement);
std::string raster_table(const RasterMeasurement& measurement);
/// A row for each set of kernels and direction, and one for each skip, in the same columns.
std::string raster_csv(const RasterMeasurement& measurement);
/// Bars of the stages' times, plain and fast, in each direction, and of each skip's gain.
std::string raster_svg(const RasterMeasurement& measurement);

}  // namespace vkrun::bench
