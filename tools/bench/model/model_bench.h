#pragma once

#include <string>
#include <vector>

#include "bench/model/model_peer.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"

namespace vkrun::bench {

struct ModelBenchOptions {
    std::string config;   ///< text; empty: the cars model
    std::string weights;  ///< a file; empty: random
    splat_precision precision = SPLAT_PRECISION_BALANCED;
    std::uint32_t objects = 1;
    std::uint32_t lora = 0;  ///< rank; 0: as the configuration says
    bool backward = false;
    bool low_memory = false;
    bool recompute = false;
    bool profile = false;    ///< add the times of one more pass by operator
    bool with_peer = false;  ///< alternate with PyTorch
    PeerOptions peer;
    int rounds = 5;
};

/// Wall times of one kind of pass.
struct PassTimes {
    double first_ms = 0;
    double second_ms = 0;          ///< includes preparing weights, if they are kept afterwards
    std::vector<double> times_ms;  ///< calls after those two, one per round

    void add(double ms, int call);  ///< calls count from 0
    [[nodiscard]] double min_ms() const;
    [[nodiscard]] double median_ms() const;
};

/// A network on a device with inputs and gradients for its passes.
class ModelRun {
  public:
    ModelRun(splat_device device, const ModelBenchOptions& options);

    /// Each returns its wall time, ms.
    double forward();
    double step();  ///< forward, then backward with a gradient of 1 for every output

    /// The numbers of a result of the latest pass, by the names of splat_model_read.
    [[nodiscard]] std::vector<double> output(const char* name) const;

    void save_weights(const std::string& path) const;
    [[nodiscard]] const std::vector<float>& images() const { return images_; }

    [[nodiscard]] Json report() const;  ///< describes the model as it is now
    [[nodiscard]] double create_ms() const { return create_ms_; }
    /// Reading the file of weights, if there is one.
    [[nodiscard]] double read_ms() const { return read_ms_; }
    /// Starting at random, or loading what was read.
    [[nodiscard]] double init_ms() const { return init_ms_; }

    /// Operations of a forward pass, 1e9, two per multiplication: convolutions and the products of
    /// attention over pixels. Counted at each call.
    [[nodiscard]] double gflop() const;

  private:
    void load(const std::string& weights);
    void make_inputs();

    Model model_;
    std::uint32_t objects_;
    std::size_t pixels_ = 0;  ///< pixels of all images together
    Json report_;             ///< describes the new model
    double create_ms_ = 0;
    double read_ms_ = 0;
    double init_ms_ = 0;
    std::vector<float> images_, focals_, embedding_, tokens_;
    std::vector<float> ones_;  ///< one per number of the longest output
};

struct PassMeasurement {
    PassTimes ours;
    PassTimes peer;  ///< empty without one
};

/// Run one kind of pass twice and then `rounds` times, alternating with the peer (may be null).
///
/// step  forward and backward, of a model made with gradients; else forward
PassMeasurement measure_pass(ModelRun& run, ModelPeer* peer, bool step, int rounds);

}  // namespace vkrun::bench
