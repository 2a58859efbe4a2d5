#include <map>

#include "api/scenario/scenario_calls.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

class Scenario : ScenarioCalls {
  public:
    explicit Scenario(Observer& observer) : ScenarioCalls(observer) {}
    Scenario(const Scenario&) = delete;
    Scenario& operator=(const Scenario&) = delete;

    ~Scenario() {
        for (const splat_op op : ops_) SPLAT_DESTROY(splat_op_destroy, op);
        // Some tensors outlive their device, others do not.
        bool first = true;
        for (const auto& [name, tensor] : tensors_) {
            SPLAT_DESTROY(splat_tensor_destroy, tensor);
            if (first) SPLAT_DESTROY(splat_device_destroy, device_);
            first = false;
        }
        if (first) SPLAT_DESTROY(splat_device_destroy, device_);
    }

    bool run(const splat_device_desc& desc) {
        profiled_ = (desc.flags & SPLAT_DEVICE_PROFILE) != 0;
        return SPLAT_MAKE(device_, splat_device_create, &desc) && create_tensors() &&
               create_ops() && compute() && read_back() && describe() && tell();
    }

    ScenarioResults results;

  private:
    bool make(const char* name, const Dims& dims) {
        const splat_tensor_desc desc = tensor_desc(dims, name);
        return SPLAT_MAKE(tensors_[name], splat_tensor_create, device_, &desc);
    }

    bool fill(const char* name, const Dims& dims, std::size_t count, std::uint64_t seed,
              const std::int64_t* strides = nullptr) {
        const splat_tensor_desc desc = tensor_desc(dims, name);
        const Floats values = normal_fill(count, seed);
        return SPLAT_MAKE(tensors_[name], splat_tensor_from_host, device_, &desc, values.data(),
                          count * 4, strides);
    }

    bool create_tensors() {
        const std::int64_t channels_last[] = {128, 1, 32, 8};
        return fill("x", {2, 8, 4, 4}, 256, 1, channels_last) && fill("gamma", {8}, 8, 2) &&
               fill("beta", {8}, 8, 3) && fill("grad_y", {2, 8, 4, 4}, 256, 4) &&
               make("y", {2, 8, 4, 4}) && make("grad_x", {2, 8, 4, 4}) && make("grad_gamma", {8}) &&
               make("grad_beta", {8}) && fill("rows", {3, 8}, 24, 5) &&
               fill("weight", {5, 8}, 40, 6) && fill("bias", {5}, 5, 7) && make("out", {3, 5});
    }

    bool create_op(const OpRequest& request) {
        const splat_op_desc desc = request.desc();
        splat_op op = nullptr;
        const bool made = SPLAT_MAKE(op, splat_op_create, device_, &desc);
        if (made) ops_.push_back(op);
        return made;
    }

    bool create_ops() {
        OpRequest norm("group_norm", {tensors_["x"], tensors_["gamma"], tensors_["beta"]},
                       {tensors_["y"]});
        norm.attributes = R"({"groups": 2, "silu": true})";
        norm.grad_outputs = {tensors_["grad_y"]};
        norm.grad_inputs = {tensors_["grad_x"], tensors_["grad_gamma"], tensors_["grad_beta"]};
        const OpRequest linear("linear", {tensors_["rows"], tensors_["weight"], tensors_["bias"]},
                               {tensors_["out"]});
        return create_op(norm) && create_op(linear);
    }

    bool compute() {
        return SPLAT_STEP(splat_op_forward, ops_[0]) && SPLAT_STEP(splat_op_backward, ops_[0]) &&
               SPLAT_STEP(splat_op_forward, ops_[1]);
    }

    bool read(const char* name, std::size_t count, const std::int64_t* strides = nullptr) {
        const Floats pattern(count, -77.0F);
        Floats values = pattern;
        const bool done = SPLAT_STEP_WITH(same_bits(values, pattern), splat_tensor_read,
                                          tensors_[name], values.data(), count * 4, strides);
        results.tensors.push_back(std::move(values));
        return done;
    }

    bool read_back() {
        const std::int64_t channels_last[] = {128, 1, 32, 8};
        return read("y", 256, channels_last) && read("grad_x", 256) && read("grad_gamma", 8) &&
               read("grad_beta", 8) && map("out", 15);
    }

    bool map(const char* name, std::size_t count) {
        Output<void*> pointer;
        Output<std::size_t> bytes;
        if (!SPLAT_STEP_WITH(pointer.untouched() && bytes.untouched(), splat_tensor_map,
                             tensors_[name], SPLAT_ACCESS_READ_WRITE, pointer.out(), bytes.out()))
            return false;
        EXPECT_EQ(bytes.value(), count * 4);
        const auto* const values = static_cast<const float*>(pointer.value());
        results.tensors.emplace_back(values, values + count);
        return SPLAT_STEP(splat_tensor_unmap, tensors_[name]);
    }

    bool describe() {
        Output<splat_tensor_stats> stats;
        stats.set_struct_size(sizeof(splat_tensor_stats));
        Output<splat_memory_info> memory;
        memory.set_struct_size(sizeof(splat_memory_info));
        Output<splat_tensor_info> info;
        info.set_struct_size(sizeof(splat_tensor_info));
        const bool done =
            SPLAT_STEP_WITH(stats.untouched(), splat_tensor_check, tensors_["y"], stats.out()) &&
            SPLAT_STEP_WITH(memory.untouched(), splat_device_get_memory, device_, memory.out()) &&
            SPLAT_STEP_WITH(info.untouched(), splat_tensor_get_info, tensors_["y"], info.out());
        if (done) results.stats = stats.value();
        return done;
    }

    /// Texts that the library builds on each call. The buffer is short, so they return
    /// SPLAT_INCOMPLETE.
    bool tell() {
        Output<char> letter;
        Output<std::size_t> needed;
        Output<std::uint32_t> count;
        const auto told = [&](bool done) {
            if (!done) return false;
            EXPECT_EQ(letter.value(), '\0');
            EXPECT_GT(needed.value(), 100U);
            letter = Output<char>();
            needed = Output<std::size_t>();
            return true;
        };
        return told(SPLAT_STEP_WITH(letter.untouched() && needed.untouched(), splat_op_list,
                                    letter.out(), 1, needed.out())) &&
               told(SPLAT_STEP_WITH(letter.untouched() && needed.untouched(), splat_scene_formats,
                                    letter.out(), 1, needed.out())) &&
               (!profiled_ || told(SPLAT_STEP_WITH(letter.untouched() && needed.untouched(),
                                                   splat_device_profile_json, device_, letter.out(),
                                                   1, needed.out()))) &&
               SPLAT_STEP_WITH(count.untouched(), splat_device_count, count.out());
    }

    bool profiled_ = false;
    splat_device device_ = nullptr;
    std::map<std::string, splat_tensor> tensors_;
    std::vector<splat_op> ops_;
};

}  // namespace

bool ScenarioResults::operator==(const ScenarioResults& other) const {
    if (tensors.size() != other.tensors.size()) return false;
    for (std::size_t i = 0; i < tensors.size(); ++i)
        if (!same_bits(tensors[i], other.tensors[i])) return false;
    return std::memcmp(&stats, &other.stats, sizeof stats) == 0;
}

std::optional<ScenarioResults> run_scenario(Observer& observer, const splat_device_desc& device) {
    return live<Scenario>(observer, device);
}

}  // namespace splat::test
