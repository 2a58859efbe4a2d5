// Forked children of a process with an open device.
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "api/concurrent/long_call.h"
#include "api/raster_calls.h"

namespace splat::test {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kHung = -1;

/// In a child, the thread sanitizer lets nobody join the parent's threads, as drivers do at exit, nor
/// start new ones.
#if defined(__SANITIZE_THREAD__)
constexpr bool kForkHasLimits = true;
#else
constexpr bool kForkHasLimits = false;
#endif

/// What a child finds: the first thing that is wrong, for its exit status.
class Findings {
  public:
    void expect(bool good, const char* what) {
        ++count_;
        if (good || first_ != 0) return;
        first_ = count_;
        std::fprintf(stderr, "child: %s: %s\n", what, splat_last_error_message());
    }
    void expect_done(splat_result result, const char* what) { expect(result == SPLAT_OK, what); }
    void expect_forked(splat_result result, const char* what) {
        expect(result == kState && std::strstr(splat_last_error_message(), "forked") != nullptr &&
                   std::strstr(splat_last_error_message(), "spawn") != nullptr,
               what);
    }
    [[nodiscard]] int first() const { return first_; }

  private:
    int count_ = 0;
    int first_ = 0;
};

/// The exit status of a child that runs `body` and then ends by _exit() or exit(); kHung if it does
/// not end.
template <class Body>
int in_child(void (*end)(int), Body&& body) {
    std::fflush(nullptr);
    const pid_t child = fork();
    if (child == 0) {
        Findings findings;
        body(findings);
        end(findings.first());
    }
    const auto begin = Clock::now();
    int status = 0;
    while (waitpid(child, &status, WNOHANG) == 0) {
        if (milliseconds_since(begin) > 20e3 * timeout_scale()) {
            kill(child, SIGKILL);
            waitpid(child, &status, 0);
            return kHung;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : kHung;
}

/// Objects of every kind in the parent.
struct Parent {
    Parent()
        : device(open_device()),
          tensor(make_tensor(device, {64, 64})),
          op(make_op(device, OpRequest("silu", {tensor}, {make_tensor(device, {64, 64})}))),
          scene(SampleScene(50).create()),
          rasterizer(make_rasterizer(device, rasterizer_desc(50, 32, 32))),
          model(make_model(device)),
          trainer(make_trainer(device)),
          dataset(make_dataset()),
          weights(make_weights()) {
        const splat_camera camera = sample_camera(32, 32);  // leaves a copy of the scene
        EXPECT_DONE(draw(rasterizer, scene, camera));
        EXPECT_DONE(splat_op_forward(op));
    }

    Device device;
    Tensor tensor;
    Op op;
    Scene scene;
    Rasterizer rasterizer;
    Model model;
    Trainer trainer;
    Dataset dataset;
    Weights weights;
};

void expect_refusals(Findings& child, Parent& parent) {
    float values[64 * 64] = {};
    auto memory = sized<splat_memory_info>();
    auto tensor_info = sized<splat_tensor_info>();
    Tensor made;
    const splat_tensor_desc desc = tensor_desc({2});
    const splat_camera camera = sample_camera(32, 32);
    child.expect_forked(splat_device_get_memory(parent.device, &memory), "get_memory");
    child.expect_forked(splat_device_cancel(parent.device), "cancel");
    child.expect_forked(splat_tensor_create(parent.device, &desc, made.out()), "tensor_create");
    child.expect_forked(splat_tensor_read(parent.tensor, values, sizeof values, nullptr), "read");
    child.expect_forked(splat_tensor_get_info(parent.tensor, &tensor_info), "get_info");
    child.expect_forked(splat_op_forward(parent.op), "op_forward");
    child.expect_forked(splat_rasterizer_forward_scene(parent.rasterizer, nullptr, parent.scene,
                                                       &camera, 1, nullptr),
                        "rasterizer_forward_scene");
    child.expect_forked(splat_model_init(parent.model, 1), "model_init");
    child.expect_forked(splat_trainer_report(parent.trainer, nullptr, 0, nullptr), "report");
}

void expect_host_objects(Findings& child, Parent& parent) {
    auto info = sized<splat_scene_info>();
    child.expect_done(splat_scene_get_info(parent.scene, &info), "scene_get_info");
    child.expect(info.count == 50, "its Gaussians");
    child.expect_done(splat_scene_filter(parent.scene, SPLAT_FILTER_SORT, 0), "scene_filter");
    std::uint32_t count = 0;
    child.expect_done(splat_weights_count(parent.weights, &count), "weights_count");
    const std::uint32_t view = 0;
    Floats images(3 * 8 * 8);
    auto views = sized<splat_dataset_views>();
    views.images = images.data();
    child.expect_done(splat_dataset_read(parent.dataset, 0, &view, 1, &views), "dataset_read");
}

void destroy_all(Findings& child, Parent& parent) {
    child.expect_done(splat_op_destroy(parent.op), "op_destroy");
    child.expect_done(splat_tensor_destroy(parent.tensor), "tensor_destroy");
    child.expect_done(splat_rasterizer_destroy(parent.rasterizer), "rasterizer_destroy");
    child.expect_done(splat_scene_destroy(parent.scene), "scene_destroy");
    child.expect_done(splat_model_destroy(parent.model), "model_destroy");
    child.expect_done(splat_trainer_destroy(parent.trainer), "trainer_destroy");
    child.expect_done(splat_dataset_destroy(parent.dataset), "dataset_destroy");
    child.expect_done(splat_device_destroy(parent.device), "device_destroy");
}

TEST(ApiFork, ChildrenAreRefusedAtOnceAndMayDestroy) {
    Parent parent;
    EXPECT_EQ(in_child(_exit,
                       [&](Findings& child) {
                           const auto begin = Clock::now();
                           expect_refusals(child, parent);
                           expect_host_objects(child, parent);
                           destroy_all(child, parent);
                           const double ms = milliseconds_since(begin);
                           child.expect(ms < 1000 * timeout_scale(), "at once");
                       }),
              0);
    got(splat_tensor_get_info, parent.tensor);
    EXPECT_DONE(splat_op_forward(parent.op)) << "the parent goes on";
}

TEST(ApiFork, ChildrenOfABusyProcessAreRefusedToo) {
    Parent parent;
    LongCall call(parent.device, 1000);
    std::atomic<bool> done = false;
    std::vector<std::jthread> threads;
    for (int i = 0; i < 2; ++i)
        threads.emplace_back([&] {  // locks of handles, the log, data sets and scenes
            const std::uint32_t view = 0;
            Floats images(3 * 8 * 8);
            while (!done) {
                auto views = sized<splat_dataset_views>();
                views.images = images.data();
                EXPECT_DONE(splat_dataset_read(parent.dataset, 0, &view, 1, &views));
                EXPECT_EQ(splat_tensor_unmap(nullptr), kHandle);
                got(splat_scene_get_info, parent.scene);
            }
        });
    call.begin();
    for (int round = 0; round < 5; ++round)
        EXPECT_EQ(in_child(round % 2 == 1 && !kForkHasLimits ? std::exit : _exit,
                           [&](Findings& child) {
                               expect_refusals(child, parent);
                               expect_host_objects(child, parent);
                               destroy_all(child, parent);
                           }),
                  0);
    done = true;
    for (std::jthread& thread : threads) thread.join();
    EXPECT_EQ(call.finish(), SPLAT_OK);
}

TEST(ApiFork, ChildrenExit) {
    if (kForkHasLimits) GTEST_SKIP() << "the thread sanitizer's pthread_join waits for ever";
    Parent parent;
    EXPECT_EQ(in_child(std::exit, [&](Findings& child) { expect_refusals(child, parent); }), 0);
}

/// Drivers join threads at exit that the child does not have; tests of bindings have children of processes without a
/// device, which may open one.
TEST(ApiFork, ChildrenOfAProcessWithADeviceOpenNone) {
    if (kForkHasLimits) GTEST_SKIP() << "the thread sanitizer's pthread_join waits for ever";
    Parent parent;
    using End = void (*)(int);
    for (const End end : {End{_exit}, End{std::exit}})
        EXPECT_EQ(in_child(end,
                           [&](Findings& child) {
                               const splat_device_desc desc = device_desc();
                               splat_device device = nullptr;
                               child.expect_forked(splat_device_create(&desc, &device), "create");
                               auto info = sized<splat_device_info>();
                               child.expect_forked(splat_device_describe(0, &info), "describe");
                               child.expect(device == nullptr, "no device");
                               expect_host_objects(child, parent);
                           }),
                  0);
}

}  // namespace
}  // namespace splat::test
