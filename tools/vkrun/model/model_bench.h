#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vkrun/device_text.h"
#include "vkrun/objects.h"

namespace vkrun {

struct ModelBenchOptions {
    std::string config;   ///< text; empty: the cars model
    std::string weights;  ///< a file; empty: random
    std::int32_t precision = SPLAT_PRECISION_BALANCED;
    std::uint32_t objects = 1;
    std::uint32_t lora = 0;  ///< rank; 0: as the configuration says
    bool backward = false;
    bool low_memory = false;
    bool recompute = false;
    int rounds = 5;
};

/// Wall times of one kind of pass.
struct PassTimes {
    double first_ms = 0;
    double second_ms = 0;          ///< prepares weights, if they are kept from then on
    std::vector<double> times_ms;  ///< of the calls after those two, one per round

    void add(double ms, int call);  ///< call  from 0
    [[nodiscard]] double min_ms() const;
    [[nodiscard]] double median_ms() const;
};

/// A network on a device with inputs and gradients for its passes.
class ModelRun {
  public:
    ModelRun(splat_device device, const ModelBenchOptions& options);

    /// Each returns its wall time in ms.
    double forward();
    double step();  ///< forward, then backward with all gradients of outputs 1

    /// The numbers of a result of the latest pass, by the names of splat_model_read.
    [[nodiscard]] std::vector<double> output(const char* name) const;

    void save_weights(const std::string& path) const;
    [[nodiscard]] const std::vector<float>& images() const { return images_; }

    [[nodiscard]] Json report() const;  ///< of the model as it is now
    [[nodiscard]] double create_ms() const { return create_ms_; }
    [[nodiscard]] double read_ms() const { return read_ms_; }  ///< the file of weights
    [[nodiscard]] double init_ms() const { return init_ms_; }  ///< or loading what was read

    /// 1e9 operations of a forward pass, two per multiplication: convolutions and the products of
    /// attention over pixels. Counts them anew.
    [[nodiscard]] double gflop() const;

  private:
    void load(const std::string& weights);
    void make_inputs();

    Model model_;
    std::uint32_t objects_;
    std::size_t pixels_ = 0;  ///< of all images together
    Json report_;             ///< of the new model
    double create_ms_ = 0;
    double read_ms_ = 0;
    double init_ms_ = 0;
    std::vector<float> images_, focals_, embedding_, tokens_;
    std::vector<float> ones_;  ///< as long as the longest output
};

/// A process that says "ready", with JSON about itself, and then runs passes when told: of
/// tools/bench/torch_model.py, the same network in turns with ours.
class ModelPeer {
  public:
    /// command  the program and its arguments. Throws, with the remedy, if it does not get ready.
    ModelPeer(const std::vector<std::string>& command, const std::string& remedy);
    ~ModelPeer();
    ModelPeer(const ModelPeer&) = delete;
    ModelPeer& operator=(const ModelPeer&) = delete;

    [[nodiscard]] const Json& about() const { return about_; }

    /// pass  "forward", "step", or "outputs" with a folder for the exchange; Returns  its time in ms
    double run(const std::string& pass);

  private:
    std::string read_line();

    int socket_ = -1;
    int process_ = -1;
    std::string received_;
    Json about_;
};

/// The arguments of torch_model.py for a configuration as reports hold it. Throws where the peer has no
/// such network.
std::vector<std::string> peer_arguments(const Json& config, std::uint32_t objects);

/// What to do where torch_model.py does not get ready.
extern const char* const kPeerRemedy;

/// tools/bench/torch_model.py in a folder above this program or above the current folder.
std::string find_peer_script();

struct PassMeasurement {
    PassTimes ours;
    PassTimes peer;  ///< empty without one
};

/// One kind of pass, twice and then `rounds` times, ours and the peer's (may be null) in turns.
///
/// step  forward and backward, of a model made with gradients; else forward
PassMeasurement measure_pass(ModelRun& run, ModelPeer* peer, bool step, int rounds);

}  // namespace vkrun
