#include <filesystem>

#include "api/scenario/scenario_calls.h"
#include "support/rng_fill.h"
#include "support/system.h"

namespace splat::test {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kObjects = 2;
constexpr std::size_t kImage = 16 * 16;
constexpr std::size_t kBias = 24;  ///< numbers of the last layer's bias

class TrainScenario : ScenarioCalls {
  public:
    explicit TrainScenario(Observer& observer) : ScenarioCalls(observer) {}
    TrainScenario(const TrainScenario&) = delete;
    TrainScenario& operator=(const TrainScenario&) = delete;

    ~TrainScenario() {
        for (const splat_weights weights : {stored_, loaded_})
            if (weights != nullptr) SPLAT_DESTROY(splat_weights_destroy, weights);
        SPLAT_DESTROY(splat_optimizer_destroy, optimizer_);
        for (const splat_tensor tensor : {rows_, grad_rows_})
            SPLAT_DESTROY(splat_tensor_destroy, tensor);
        // Objects of the device outlive it, and the trainer's model outlives the trainer.
        SPLAT_DESTROY(splat_device_destroy, device_);
        SPLAT_DESTROY(splat_trainer_destroy, trainer_);
        for (const splat_model model : {trained_, fresh_})
            SPLAT_DESTROY(splat_model_destroy, model);
        for (const std::string& path : {state_, weights_}) fs::remove(path);
    }

    bool run(const splat_device_desc& desc) {
        return SPLAT_MAKE(device_, splat_device_create, &desc) && make_trainer() && step() &&
               save() && step() && go_on() && predict() && gather();
    }

    ScenarioResults results;

  private:
    static std::string file(const char* name) {
        return (fs::temp_directory_path() / (name + test::process_text() + ".safetensors"))
            .string();
    }

    bool read(splat_model model, const char* name, std::size_t count) {
        const Floats pattern(count, -77.0F);
        Floats values = pattern;
        const bool done = SPLAT_STEP_WITH(same_bits(values, pattern), splat_model_read, model, name,
                                          values.data(), count * sizeof(float));
        results.tensors.push_back(std::move(values));
        return done;
    }

    bool make_trainer() {
        const splat_trainer_desc desc = trainer_desc();
        return SPLAT_MAKE(trainer_, splat_trainer_create, device_, &desc) &&
               SPLAT_MAKE(trained_, splat_trainer_model, trainer_) &&
               SPLAT_STEP(splat_model_init, trained_, 3);
    }

    /// A failed step updates nothing, so that repeating it gives the same weights.
    bool step() {
        const splat_trainer_batch batch = batch_.desc();
        auto info = sized<splat_trainer_info>();
        const auto before = info;
        return SPLAT_STEP_WITH(std::memcmp(&info, &before, sizeof info) == 0, splat_trainer_step,
                               trainer_, &batch, &info) &&
               read(trained_, "network_with_offset.out.bias", kBias);
    }

    bool save() {
        return SPLAT_STEP(splat_trainer_save, trainer_, state_.c_str()) &&
               SPLAT_MAKE(stored_, splat_trainer_store, trainer_) &&
               SPLAT_STEP(splat_weights_save, stored_, weights_.c_str(), 0);
    }

    bool go_on() { return SPLAT_STEP(splat_trainer_resume, trainer_, state_.c_str()) && step(); }

    bool predict() {
        splat_model_desc desc = model_desc();
        desc.objects = kObjects;
        auto input = sized<splat_model_input>();
        input.images = batch_.images.data();
        return SPLAT_MAKE(loaded_, splat_weights_load, weights_.c_str(), 0) &&
               SPLAT_MAKE(fresh_, splat_model_create, device_, &desc) &&
               SPLAT_STEP(splat_model_load, fresh_, loaded_, 0) &&
               SPLAT_STEP(splat_model_forward, fresh_, &input) &&
               read(fresh_, "means", kObjects * kImage * 3);
    }

    bool upload(splat_tensor& tensor, std::uint64_t seed) {
        const Floats values = normal_fill(24, seed);
        const splat_tensor_desc desc = tensor_desc({3, 8}, "rows");
        return SPLAT_MAKE(tensor, splat_tensor_from_host, device_, &desc, values.data(), 96,
                          nullptr);
    }

    bool update() { return SPLAT_STEP(splat_optimizer_step, optimizer_, nullptr); }

    /// Repeated after some rows were dropped, the call would refuse the third.
    bool gather() {
        if (!upload(rows_, 1) || !upload(grad_rows_, 2)) return false;
        const splat_optimizer_item item = {"rows", nullptr, nullptr, rows_, grad_rows_};
        splat_optimizer_desc desc = optimizer_desc(&item);
        desc.ema_decay = 0.9;
        const std::int64_t rows[] = {2, 0};
        Floats values(24);
        const bool done =
            SPLAT_MAKE(optimizer_, splat_optimizer_create, device_, &desc) && update() &&
            SPLAT_STEP(splat_optimizer_gather_rows, optimizer_, "rows", rows, 2) && update() &&
            SPLAT_STEP(splat_tensor_read, rows_, values.data(), 96, nullptr);
        results.tensors.push_back(std::move(values));
        return done;
    }

    const TrainerBatch batch_;
    const std::string state_ = file("splat_life_state_");
    const std::string weights_ = file("splat_life_weights_");
    splat_device device_ = nullptr;
    splat_tensor rows_ = nullptr, grad_rows_ = nullptr;
    splat_optimizer optimizer_ = nullptr;
    splat_trainer trainer_ = nullptr;
    splat_model trained_ = nullptr;
    splat_model fresh_ = nullptr;
    splat_weights stored_ = nullptr;
    splat_weights loaded_ = nullptr;
};

}  // namespace

std::optional<ScenarioResults> run_train_scenario(Observer& observer,
                                                  const splat_device_desc& device) {
    return live<TrainScenario>(observer, device);
}

}  // namespace splat::test
