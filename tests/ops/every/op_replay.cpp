// op_replay [seconds]: times operators as `vkrun bench ops --list` describes them on standard input. Each case is
// recorded several times into one list, every time with buffers of its own, so that no cache holds what the next
// needs; the times are those of the device's kernels. Prints a line of JSON a case and direction:
// {op, case, direction, kernels, replays, ms: {min, median}, bytes, flops}; ms, bytes and flops of one replay.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <iterator>
#include <map>

#include "nn/executor.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/parsed_json.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

constexpr std::size_t kMostReplays = 32;
constexpr std::size_t kMostBytes = std::size_t{256} << 20;  ///< more than any cache
constexpr std::size_t kMostBytesOfCpu = std::size_t{64} << 20;
constexpr int kFewestRuns = 3;

Shape shape_of(const Json& dims) {
    return Shape::create(dims.get<std::vector<std::int64_t>>(), "case").value();
}

/// The replays of a case: one graph, whose nodes share nothing.
class Replays {
  public:
    Replays(vk::Context& context, const Json& op_case)
        : context_(context), graph_(context), case_(op_case) {}

    Status create() {
        SPLAT_ASSIGN(row_, ops::find_op(case_.at("op").get<std::string>()));
        SPLAT_ASSIGN(const std::vector<JsonScalar> attributes,
                     parse_flat_json(case_.at("attributes").dump(), "attributes"));
        nn::ExecutorDesc desc;
        desc.separate = desc.overwrite = desc.backward = true;
        desc.label = row_->name;
        count_ = replays();
        for (std::size_t i = 0; i < count_; ++i) add_node(attributes, desc);
        SPLAT_TRY(graph_.status());
        desc.backward = !desc.grad_inputs.empty();
        if (desc.backward) desc.grad_outputs = desc.outputs;
        backward_ = desc.backward;
        SPLAT_ASSIGN(parameters_, nn::Parameters::create(context_, graph_));
        SPLAT_ASSIGN(executor_, nn::Executor::create(context_, graph_, *parameters_, desc));
        return executor_->forward();
    }

    [[nodiscard]] bool has_backward() const { return backward_; }
    [[nodiscard]] std::size_t count() const { return count_; }
    Status run(bool backward) { return backward ? executor_->backward() : executor_->forward(); }

  private:
    [[nodiscard]] std::size_t replays() const {
        std::size_t bytes = 0;
        for (const char* side : {"inputs", "outputs"})
            for (const Json& tensor : case_.at(side))
                if (!tensor.at("dims").empty()) bytes += 8 * shape_of(tensor.at("dims")).elements();
        const bool cpu = context_.device().info().kind == vk::DeviceKind::kCpu;
        return std::clamp((cpu ? kMostBytesOfCpu : kMostBytes) / std::max<std::size_t>(bytes, 1),
                          std::size_t{2}, kMostReplays);
    }

    vk::BufferView tensor(const Shape& shape) {
        std::vector<float>& values = values_[shape.elements()];
        if (values.empty()) values = normal_fill(shape.elements(), 1);
        buffers_.push_back(upload(context_, values));
        return buffers_.back().view(shape);
    }

    void add_node(const std::vector<JsonScalar>& attributes, nn::ExecutorDesc& desc) {
        std::vector<nn::ValueId> inputs(row_->inputs.size(), nn::kNoValue);
        for (std::size_t i = 0; i < inputs.size(); ++i) {
            const Json& given = case_.at("inputs").at(i);
            if (given.at("dims").empty()) continue;
            const Shape shape = shape_of(given.at("dims"));
            inputs[i] = graph_.input(row_->inputs[i].name, shape, row_->inputs[i].layout);
            desc.tensors[inputs[i]] = tensor(shape);
            if (given.at("constant") || row_->inputs[i].constant) continue;
            desc.grad_inputs.push_back(inputs[i]);
            desc.gradients[inputs[i]] = tensor(shape);
        }
        const auto outputs = graph_.node(row_->name, inputs, attributes);
        for (std::size_t i = 0; i < outputs.size(); ++i) {
            const Shape shape = shape_of(case_.at("outputs").at(i).at("dims"));
            desc.tensors[outputs[i]] = tensor(shape);
            desc.gradients[outputs[i]] = tensor(shape);
            desc.outputs.push_back(outputs[i]);
        }
    }

    vk::Context& context_;
    nn::Graph graph_;
    const Json& case_;
    const ops::OpRow* row_ = nullptr;
    std::map<std::size_t, std::vector<float>> values_;  ///< by their number
    std::vector<vk::Buffer> buffers_;
    std::optional<nn::Parameters> parameters_;
    std::unique_ptr<nn::Executor> executor_;
    std::size_t count_ = 0;
    bool backward_ = false;
};

/// Conversions between layouts at the graph's edges, which a network has once.
bool is_layout(const std::string& label) {
    return label.starts_with("quads_") || label.find("_pack") != std::string::npos;
}

/// Time, bytes and operations of the operator's own dispatches in the latest run.
struct Sample {
    double ms = 0, bytes = 0, flops = 0;
};

Sample sample_of(vk::Context& context) {
    Sample sample;
    const Json profile = parse_json(context.profile()->json(""), "profile").value();
    for (const Json& row : profile.at("ops")) {
        if (is_layout(row.at("op"))) continue;
        const double count = row.at("count");
        sample.ms += row.at("total_ms").get<double>();
        sample.bytes += count * row.at("bytes").get<double>();
        sample.flops += count * row.at("flops").get<double>();
    }
    return sample;
}

Status measure(vk::Context& context, const Json& op_case, double seconds) {
    Replays replays(context, op_case);
    SPLAT_TRY(replays.create());
    for (const bool backward : {false, true}) {
        if (backward && !replays.has_backward()) break;
        SPLAT_TRY(replays.run(backward));
        std::vector<double> times;
        Sample sample;
        const auto start = std::chrono::steady_clock::now();
        const auto passed = [&] {
            return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        };
        for (int run = 0; run < kFewestRuns || passed() < seconds; ++run) {
            context.profile()->reset();
            SPLAT_TRY(replays.run(backward));
            sample = sample_of(context);
            times.push_back(sample.ms / static_cast<double>(replays.count()));
        }
        std::sort(times.begin(), times.end());
        const auto each = static_cast<double>(replays.count());
        const Json line = {{"op", op_case.at("op")},
                           {"case", op_case.at("case")},
                           {"direction", backward ? "backward" : "forward"},
                           {"kernels", vk::kernels_name(context.device().kernels())},
                           {"replays", replays.count()},
                           {"ms", {{"min", times.front()}, {"median", times[times.size() / 2]}}},
                           {"bytes", sample.bytes / each},
                           {"flops", sample.flops / each}};
        std::printf("%s\n", line.dump().c_str());
        std::fflush(stdout);
    }
    return {};
}

int replay_all(double seconds) {
    vk::ContextDesc desc;
    desc.profile = true;
    const auto context = vk::Context::create(desc);
    if (!context.ok()) {
        std::fprintf(stderr, "op_replay: %s\n", context.status().message().c_str());
        return 3;
    }
    const std::string text{std::istreambuf_iterator<char>(std::cin), {}};
    const auto cases = parse_json(text, "standard input");
    if (!cases.ok()) {
        std::fprintf(stderr, "op_replay: %s\n", cases.status().message().c_str());
        return 2;
    }
    int failed = 0;
    for (const Json& op_case : cases.value()) {
        const Status status = measure(*context.value(), op_case, seconds);
        if (status.ok()) continue;
        std::fprintf(stderr, "op_replay: %s: %s\n", op_case.at("case").get<std::string>().c_str(),
                     status.message().c_str());
        failed = 1;
    }
    return failed;
}

}  // namespace
}  // namespace splat::test

int main(int argc, char** argv) {
    return splat::test::replay_all(argc > 1 ? std::atof(argv[1]) : 0.05);
}
