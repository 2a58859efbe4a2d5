// Trainings with Adam against the same steps in float64: 20 steps at rates from 1e-6 to 1e3, and the drift of 2,000.

#include <algorithm>
#include <cmath>

#include "ref/adam_ref.h"
#include "stress/net_bound.h"
#include "stress/network.h"
#include "stress/network_run.h"
#include "stress/stress.h"
#include "stress/whole.h"
#include "vkrun/cli/text.h"

namespace vkrun::stress {
namespace {

namespace ref = splat::ref;
using Optimizer = Owner<splat_optimizer, splat_optimizer_destroy>;

struct TrainStress {
    std::string name;
    std::string input;
    double rate;
    int steps;
};

std::vector<TrainStress> train_families(bool quick) {
    std::vector<TrainStress> families;
    for (int exponent = -6; exponent <= 3; exponent += quick ? 3 : 1)
        families.push_back({format("rate/1e%d", exponent),
                            format("20 steps of Adam at a rate of 1e%d", exponent),
                            std::pow(10, exponent), 20});
    if (!quick)
        families.push_back({"drift/2000", "2,000 steps of Adam at a rate of 1e-3", 1e-3, 2000});
    return families;
}

/// Losses of all steps and the parameters after the last one; a noisy run also moves each parameter by half a unit
/// in the last place after each step, always the same way, as rounding does where steps are alike.
std::vector<Numbers> train_in_double(const Network& net, const TrainStress& stress,
                                     NetNoise* noise) {
    NetworkInDouble twin(net);
    const std::size_t loss = tensor_named(net, "loss");
    const std::vector<std::size_t> parameters = net.parameters();
    std::vector<ref::AdamState> states;
    for (const std::size_t p : parameters)
        states.push_back(
            {twin.values[p], Numbers(twin.values[p].size()), Numbers(twin.values[p].size())});
    std::vector<Numbers> bias(parameters.size());
    for (std::size_t i = 0; noise != nullptr && i < parameters.size(); ++i)
        for (std::size_t k = 0; k < states[i].value.size(); ++k)
            bias[i].push_back(noise->unit() < 0 ? -1 : 1);
    ref::AdamRules rules;
    rules.learning_rate = stress.rate;
    Numbers losses;
    for (int step = 1; step <= stress.steps; ++step) {
        twin.gradients[loss] = {1};
        twin.forward(noise);
        twin.backward(noise);
        losses.push_back(twin.values[loss][0]);
        for (std::size_t i = 0; i < parameters.size(); ++i) {
            ref::adam_step(rules, static_cast<std::size_t>(step), twin.gradients[parameters[i]],
                           states[i]);
            for (std::size_t k = 0; noise != nullptr && k < states[i].value.size(); ++k)
                states[i].value[k] *= 1 + 2 * kRounding * bias[i][k];
            twin.values[parameters[i]] = states[i].value;
        }
    }
    std::vector<Numbers> results = {losses};
    for (const ref::AdamState& state : states) results.push_back(state.value);
    return results;
}

/// The same on a device.
std::vector<std::vector<float>> train_on_device(splat_device device, const Network& net,
                                                const TrainStress& stress) {
    NetworkOnDevice run(device, net);
    const std::size_t loss = tensor_named(net, "loss");
    std::vector<splat_optimizer_item> items;
    for (const std::size_t p : net.parameters()) {
        splat_optimizer_item item{};
        item.name = net.tensors[p].name.c_str();
        item.parameter = run.value_tensor(p);
        item.gradient = run.gradient_tensor(p);
        items.push_back(item);
    }
    auto desc = sized<splat_optimizer_desc>();
    desc.items = items.data();
    desc.item_count = items.size();
    desc.rate = stress.rate;
    Optimizer optimizer;
    check(splat_optimizer_create(device, &desc, optimizer.out()));
    std::vector<float> losses;
    for (int step = 0; step < stress.steps; ++step) {
        run.forward();
        run.backward();
        losses.push_back(run.value(loss)[0]);
        check(splat_optimizer_step(optimizer.get(), nullptr));
    }
    std::vector<std::vector<float>> parameters;
    for (const std::size_t p : net.parameters()) parameters.push_back(run.value(p));
    return {losses, joined(parameters)};
}

void run_training(Run& run, const TrainStress& stress) {
    ResidualShape shape;
    shape.depth = 1;
    const Network net = residual_network(shape);
    std::vector<Expected> expected = expected_by_noise(
        [&](NetNoise* noise) { return train_in_double(net, stress, noise); }, run.quick() ? 3 : 4);
    expected = {expected[0], joined(std::vector<Expected>(expected.begin() + 1, expected.end()))};
    for (const KernelDevice& with : run.devices()) {
        auto first = train_on_device(with.device.get(), net, stress);
        const auto again = train_on_device(with.device.get(), net, stress);
        const char* const names[] = {"losses", "parameters"};
        for (std::size_t i = 0; i < first.size(); ++i)
            run.add({"train", stress.name, stress.input, names[i], with.kernels,
                     std::string(kNetReason) + ", and each parameter after each step by half a "
                                               "unit in the last place, always the same way"},
                    std::move(first[i]), again[i], expected[i]);
    }
}

}  // namespace

void stress_train(Run& run) {
    for (const TrainStress& stress : train_families(run.quick()))
        if (run.wants(stress.name)) run_training(run, stress);
    stress_whole(run);
    stress_threads(run);
}

}  // namespace vkrun::stress
