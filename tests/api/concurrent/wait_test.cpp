// Destroying and describing objects beside a long call of another thread on their device.
#include <cstdio>
#include <ctime>
#include <fstream>
#include <regex>
#include <set>

#include "api/concurrent/long_call.h"
#include "api/evaluate/lpips_calls.h"
#include "api/public_headers.h"
#include "api/raster_calls.h"

namespace splat::test {
namespace {

constexpr double kMostMs = 10;  // times SPLAT_TIMEOUT_SCALE

/// Milliseconds in which this thread ran, or was ready to run and other threads had the processors.
double busy_ms() {
    timespec ran{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &ran);
    double queued_ns = 0, none = 0;
    std::ifstream("/proc/thread-self/schedstat") >> none >> queued_ns;
    return 1e3 * static_cast<double>(ran.tv_sec) + 1e-6 * static_cast<double>(ran.tv_nsec) +
           1e-6 * queued_ns;
}

/// Times for how long calls wait, and remembers their names and the slowest.
class Stopwatch {
  public:
    template <class Call>
    void time(const char* name, Call&& call) {
        const double busy = busy_ms();
        const auto begin = std::chrono::steady_clock::now();
        const splat_result result = call();
        const double ms = milliseconds_since(begin) - (busy_ms() - busy);
        EXPECT_TRUE(result == SPLAT_OK || result == SPLAT_INCOMPLETE) << splat_last_error_message();
        EXPECT_LE(ms, kMostMs * timeout_scale()) << name;
        std::printf("%-32s %8.3f ms\n", name, ms);
        names_.insert(name);
        if (ms > slowest_ms_) {
            slowest_ms_ = ms;
            slowest_ = name;
        }
    }
    template <class Function, class Handle>
    void text(const char* name, Function function, const Handle& owned) {
        time(name, [&] { return function(owned.get(), nullptr, 0, nullptr); });
    }
    template <class Info, class Handle>
    Info info(const char* name, splat_result (*function)(Handle, Info*), Handle handle) {
        auto filled = sized<Info>();
        time(name, [&] { return function(handle, &filled); });
        return filled;
    }
    template <class Handle>
    void end(const char* name, Handle& owned) {
        time(name, [&owned] { return owned.destroy(), SPLAT_OK; });
    }
    [[nodiscard]] const std::set<std::string>& names() const { return names_; }
    [[nodiscard]] std::string slowest() const {
        return slowest_ + ", " + std::to_string(slowest_ms_) + " ms";
    }

  private:
    std::set<std::string> names_;
    std::string slowest_;
    double slowest_ms_ = 0;
};

/// One object of every kind, each used once where that needs the device.
struct Objects {
    explicit Objects(const Device& device)
        : tensor(make_tensor(device, {64, 64})),
          request("silu", {tensor}, {result = make_tensor(device, {64, 64})}),
          op(make_op(device, request)),
          scene(SampleScene(100).create()),
          mesh(make_mesh()),
          rasterizer(make_rasterizer(device, rasterizer_desc(100, 32, 32))),
          weights(make_weights()),
          model(make_model(device)),
          module(make_module(device)),
          trainer(make_trainer(device)),
          predictor(make_predictor(device)),
          lpips(make_lpips(device)),
          dataset(make_training_dataset()),
          evaluator(make_evaluator(dataset)),
          comparison(make_comparison()),
          batches(make_batches()),
          training(make_training(device)) {
        const splat_camera camera = sample_camera(32, 32);
        EXPECT_DONE(draw(rasterizer, scene, camera));
        EXPECT_DONE(splat_raster_state_create(rasterizer, state.out()));
        EXPECT_DONE(splat_rasterizer_forward_scene(rasterizer, state, scene, &camera, 1, nullptr));
        EXPECT_DONE(splat_op_forward(op));
        const splat_optimizer_item item = {"tensor", nullptr, nullptr, tensor, result};
        splat_optimizer_desc desc = optimizer_desc(&item);
        EXPECT_DONE(splat_optimizer_create(device, &desc, optimizer.out()));
        EXPECT_DONE(splat_optimizer_step(optimizer, nullptr));
        auto event = sized<splat_run_event>();
        while (event.kind != SPLAT_EVENT_STEP) EXPECT_DONE(splat_run_next(training, &event));
    }

    Tensor tensor, result;
    OpRequest request;
    Op op;
    Scene scene;
    Mesh mesh;
    Rasterizer rasterizer;
    RasterState state;
    Weights weights;
    Model model;
    Module module;
    Trainer trainer;
    Predictor predictor;
    Lpips lpips;
    Dataset dataset;
    Evaluator evaluator;
    Comparison comparison;
    Batches batches;
    Training training;
    Optimizer optimizer;
};

void describe(Stopwatch& watch, splat_device device, const Objects& objects) {
    watch.info("splat_device_get_info", splat_device_get_info, device);
    watch.time("splat_device_profile_json",
               [&] { return splat_device_profile_json(device, nullptr, 0, nullptr); });
    watch.time("splat_device_profile_table",
               [&] { return splat_device_profile_table(device, nullptr, 0, nullptr); });
    watch.time("splat_device_profile_reset", [&] { return splat_device_profile_reset(device); });
    watch.info("splat_tensor_get_info", splat_tensor_get_info, objects.tensor.get());
    watch.info("splat_scene_get_info", splat_scene_get_info, objects.scene.get());
    watch.text("splat_scene_load_report", splat_scene_load_report, objects.scene);
    watch.info("splat_mesh_get_info", splat_mesh_get_info, objects.mesh.get());
    watch.text("splat_mesh_load_report", splat_mesh_load_report, objects.mesh);
    auto rasterizer = sized<splat_rasterizer_info>();
    watch.time("splat_rasterizer_get_info",
               [&] { return splat_rasterizer_get_info(objects.rasterizer, nullptr, &rasterizer); });
    EXPECT_GT(rasterizer.passes, 0U) << "of the call before";
    auto entry = sized<splat_weights_info>();
    watch.time("splat_weights_get_info",
               [&] { return splat_weights_get_info(objects.weights, 0, &entry); });
    watch.text("splat_weights_report", splat_weights_report, objects.weights);
    watch.info("splat_model_get_info", splat_model_get_info, objects.model.get());
    watch.text("splat_model_report", splat_model_report, objects.model);
    watch.text("splat_module_report", splat_module_report, objects.module);
    watch.text("splat_trainer_report", splat_trainer_report, objects.trainer);
    watch.info("splat_predictor_get_info", splat_predictor_get_info, objects.predictor.get());
    watch.text("splat_predictor_report", splat_predictor_report, objects.predictor);
    watch.text("splat_dataset_report", splat_dataset_report, objects.dataset);
    watch.info("splat_evaluator_get_info", splat_evaluator_get_info, objects.evaluator.get());
    watch.info("splat_evaluator_summary", splat_evaluator_summary, objects.evaluator.get());
    watch.text("splat_evaluator_report", splat_evaluator_report, objects.evaluator);
    watch.info("splat_comparison_get_info", splat_comparison_get_info, objects.comparison.get());
    watch.text("splat_comparison_report", splat_comparison_report, objects.comparison);
    watch.info("splat_optimizer_get_info", splat_optimizer_get_info, objects.optimizer.get());
    watch.text("splat_run_report", splat_run_report, objects.training);
}

void end_all(Stopwatch& watch, Objects& objects) {
    watch.end("splat_op_destroy", objects.op);
    watch.end("splat_tensor_destroy", objects.tensor);
    watch.end("splat_scene_destroy", objects.scene);
    watch.end("splat_mesh_destroy", objects.mesh);
    watch.end("splat_rasterizer_destroy", objects.rasterizer);
    watch.end("splat_raster_state_destroy", objects.state);
    watch.end("splat_weights_destroy", objects.weights);
    watch.end("splat_model_destroy", objects.model);
    watch.end("splat_module_destroy", objects.module);
    watch.end("splat_trainer_destroy", objects.trainer);
    watch.end("splat_predictor_destroy", objects.predictor);
    watch.end("splat_lpips_destroy", objects.lpips);
    watch.end("splat_dataset_destroy", objects.dataset);
    watch.end("splat_evaluator_destroy", objects.evaluator);
    watch.end("splat_comparison_destroy", objects.comparison);
    watch.end("splat_batches_destroy", objects.batches);
    watch.end("splat_run_destroy", objects.training);
    watch.end("splat_optimizer_destroy", objects.optimizer);
}

/// Functions of the headers that promise not to wait, except those that read files or a struct.
std::set<std::string> promised() {
    static const std::regex kDeclared(
        R"(\b(splat_[a-z_]+_(destroy|get_info|get_memory|report))\(splat_)");
    const std::string text = public_headers();
    std::set<std::string> names;
    for (auto at = std::sregex_iterator(text.begin(), text.end(), kDeclared);
         at != std::sregex_iterator(); ++at)
        names.insert((*at)[1]);
    names.erase("splat_device_destroy");  // the next test
    // Objects that ONNX Runtime makes (tests/interop), or weights of a file (priors/weights_model_test.cpp).
    names.erase("splat_prior_model_destroy");
    names.erase("splat_prior_model_get_info");
    return names;
}

TEST(ApiWait, DescribingAndDestroyingDoNotWaitForACall) {
    splat_device_desc desc = device_desc(SPLAT_DEVICE_PROFILE);
    desc.kernels = SPLAT_KERNELS_PLAIN;
    Device device = open_device(desc);
    Objects objects(device);
    LongCall call(device, 5000);
    call.begin();
    Stopwatch watch;
    const splat_memory_info memory =
        watch.info("splat_device_get_memory", splat_device_get_memory, device.get());
    describe(watch, device, objects);
    end_all(watch, objects);
    const auto beside = got(splat_device_get_memory, device);
    ASSERT_TRUE(call.running()) << "the call was too short to measure beside it";
    EXPECT_EQ(call.finish(), SPLAT_OK);
    const auto after = got(splat_device_get_memory, device);
    EXPECT_EQ(beside.live_bytes, memory.live_bytes) << "freed when the call ends";
    EXPECT_LT(after.live_bytes, beside.live_bytes);
    for (const std::string& name : promised())
        EXPECT_EQ(watch.names().count(name), 1U) << name << " is not timed here";
    std::printf("beside a call of %.0f ms; slowest: %s\n", call.measured_ms(),
                watch.slowest().c_str());
}

TEST(ApiWait, DestroyingTheDeviceDoesNotWaitForACall) {
    Device device = open_device();
    LongCall call(device, 500);
    call.begin();
    Stopwatch().end("splat_device_destroy", device);
    ASSERT_TRUE(call.running());
    EXPECT_EQ(call.finish(), SPLAT_OK);
}

/// A rasterizer that waits for the device holds no lock of the scene.
TEST(ApiWait, ScenesAreFreeWhileARasterizerWaits) {
    const Device device = open_device();
    const Scene scene = SampleScene(100).create();
    const Rasterizer rasterizer = make_rasterizer(device, rasterizer_desc(100, 32, 32));
    LongCall call(device, 1000);
    call.begin();
    std::jthread drawing([&] {
        const splat_camera camera = sample_camera(32, 32);
        EXPECT_DONE(draw(rasterizer, scene, camera));
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    Stopwatch watch;
    auto info = sized<splat_scene_info>();
    watch.time("splat_scene_get_info", [&] { return splat_scene_get_info(scene, &info); });
    ASSERT_TRUE(call.running());
    drawing.join();
}

}  // namespace
}  // namespace splat::test
