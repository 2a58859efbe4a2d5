#pragma once

#include <optional>

#include "api/api_calls.h"

namespace splat::test {

/// Observes every call of a scenario.
class Observer {
  public:
    virtual ~Observer() = default;
    virtual void before() {}
    virtual void after() {}

    /// A call failed and left its outputs alone. Return true to repeat it, false to give up and
    /// destroy everything.
    virtual bool retry(const char* call, splat_result result) {
        ADD_FAILURE() << call << ": " << splat_result_name(result) << ": "
                      << splat_last_error_message();
        return false;
    }
};

struct ScenarioResults {
    std::vector<Floats> tensors;
    splat_tensor_stats stats{};

    /// Bit by bit.
    bool operator==(const ScenarioResults& other) const;
};

/// The life of a device: create it and tensors, run group_norm forward and backward and linear
/// forward, read back, map, check, describe, destroy.
///
/// Checks that a failed call leaves its outputs alone, and that every destroy succeeds. Returns the
/// results, or nothing if the observer gave up.
std::optional<ScenarioResults> run_scenario(Observer& observer, const splat_device_desc& device);

/// Another life: create a device and a scene, save it, load it and cameras of a file, draw it, read
/// image and gradients, change the scene, destroy. Its files are in a temporary folder.
std::optional<ScenarioResults> run_raster_scenario(Observer& observer,
                                                   const splat_device_desc& device);

/// A third life: create a device and a trainer, take steps, save its state and weights, continue
/// from the state, load the weights into a model, predict, gather rows of an optimizer, destroy.
std::optional<ScenarioResults> run_train_scenario(Observer& observer,
                                                  const splat_device_desc& device);

}  // namespace splat::test
