// Networks over depth, scale of the input and the algorithm of convolutions, forward and backward.

#include <cmath>

#include "stress/net_bound.h"
#include "stress/network.h"
#include "stress/network_run.h"
#include "stress/stress.h"
#include "vkrun/cli/text.h"

namespace vkrun::stress {
namespace {

struct ModelStress {
    std::string name;
    std::string input;
    ResidualShape shape;
};

std::vector<ModelStress> model_families(bool quick) {
    std::vector<ModelStress> families;
    for (const std::size_t depth : quick ? std::vector<std::size_t>{1, 4, 16}
                                         : std::vector<std::size_t>{1, 2, 4, 8, 16, 32, 64}) {
        ResidualShape shape;
        shape.depth = depth;
        families.push_back(
            {format("depth/%zu", depth), format("%zu residual blocks", depth), shape});
    }
    for (const int exponent : quick ? std::vector<int>{-6, 6}
                                    : std::vector<int>{-30, -20, -10, -6, -3, 3, 6, 10, 15, 18}) {
        ResidualShape shape;
        shape.depth = 4;
        shape.scale = std::pow(10, exponent);
        families.push_back({format("scale/1e%d", exponent),
                            format("4 residual blocks, inputs of 1e%d", exponent), shape});
    }
    for (const int winograd : {2, 4}) {
        ResidualShape shape;
        shape.depth = 4;
        shape.width = 16;
        shape.side = 8;
        shape.winograd = winograd;
        families.push_back({format("winograd/%d", winograd),
                            format("4 residual blocks by F(%dx%d)", winograd, winograd), shape});
    }
    return families;
}

constexpr const char* kResults[] = {"loss", "y", "grad_x", "grad_parameters"};

/// The tensors of each result, in its order.
struct Places {
    std::size_t loss, y, x;
    std::vector<std::size_t> parameters;

    explicit Places(const Network& net)
        : loss(tensor_named(net, "loss")),
          y(tensor_named(net, "y")),
          x(tensor_named(net, "x")),
          parameters(net.parameters()) {}
};

std::vector<Expected> expected_model(const Network& net, const Places& at, int samples) {
    NetworkInDouble twin(net);
    return expected_by_noise(
        [&](NetNoise* noise) {
            twin.gradients[at.loss] = {1};
            twin.forward(noise);
            twin.backward(noise);
            std::vector<Numbers> results = {twin.values[at.loss], twin.values[at.y],
                                            twin.gradients[at.x]};
            for (const std::size_t p : at.parameters) results.push_back(twin.gradients[p]);
            return results;
        },
        samples);
}

std::vector<std::vector<float>> results_model(NetworkOnDevice& run, const Places& at) {
    run.forward();
    run.backward();
    std::vector<std::vector<float>> gradients;
    for (const std::size_t p : at.parameters) gradients.push_back(run.gradient(p));
    return {run.value(at.loss), run.value(at.y), run.gradient(at.x), joined(gradients)};
}

void run_model(Run& run, const ModelStress& stress) {
    const Network net = residual_network(stress.shape);
    const Places at(net);
    std::vector<Expected> expected = expected_model(net, at, run.quick() ? 3 : 8);
    expected = {expected[0], expected[1], expected[2],
                joined(std::vector<Expected>(expected.begin() + 3, expected.end()))};
    for (const KernelDevice& with : run.devices()) {
        NetworkOnDevice on_device(with.device.get(), net);
        std::vector<std::vector<float>> first = results_model(on_device, at);
        const std::vector<std::vector<float>> again = results_model(on_device, at);
        for (std::size_t i = 0; i < first.size(); ++i)
            run.add({"model", stress.name, stress.input, kResults[i], with.kernels, kNetReason},
                    std::move(first[i]), again[i], expected[i]);
    }
}

}  // namespace

void stress_model(Run& run) {
    for (const ModelStress& stress : model_families(run.quick()))
        if (run.wants(stress.name)) run_model(run, stress);
}

}  // namespace vkrun::stress
