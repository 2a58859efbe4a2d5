// The driver fails at each place where it can, once or permanently; devices are lost; waits time
// out.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>

#include "api/host_memory.h"
#include "api/raster_calls.h"
#include "api/scenario/scenario.h"
#include "core/fault.h"
#include "vk/instance.h"

namespace splat::test {
namespace {

namespace fs = std::filesystem;

/// Results that the API may return for a fault point.
bool documented(splat_result result) {
    static const std::set<splat_result> codes = {
        SPLAT_ERROR_NO_DEVICE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY,
        SPLAT_ERROR_TIMEOUT,   SPLAT_ERROR_DEVICE_LOST,
    };
    return codes.count(result) == 1;
}

/// Repairs the driver after the first failing call, unless `stays`.
class Driver : public Observer {
  public:
    explicit Driver(bool stays) : stays_(stays) {}
    void before() override { host_memory::watch(); }
    void after() override { host_memory::unwatch(); }

    bool retry(const char* call, splat_result result) override {
        EXPECT_TRUE(documented(result))
            << call << ": " << splat_result_name(result) << ": " << splat_last_error_message();
        told.insert(result);
        if (stays_) return false;
        fault::disarm();
        return result != SPLAT_ERROR_DEVICE_LOST;
    }

    std::set<splat_result> told;

  private:
    bool stays_;
};

class ApiFault : public testing::Test {
  protected:
    void SetUp() override {
        host_memory::fail_none();
        listen_to_log(SPLAT_LOG_DEBUG);
        fail_with_long_text();
        undisturbed(true);
        undisturbed();
        fault::arm(nullptr, fault::kForever);
        good_ = undisturbed();
        hits_ = fault::disarm();
        baseline_ = host_memory::live();
    }

    void TearDown() override { fault::disarm(); }

    /// A text longer than any later one, so that the buffer of the last error never grows again.
    static void fail_with_long_text() {
        const std::string name(4000, 'n');
        splat_device_desc desc = device_desc();
        const Device device = open_device(desc);
        const splat_tensor_desc none = tensor_desc({0}, name.c_str());
        splat_tensor tensor = nullptr;
        host_memory::watch();
        const splat_result result = splat_tensor_create(device, &none, &tensor);
        host_memory::unwatch();
        EXPECT_EQ(result, kArgument);
    }

    [[nodiscard]] splat_device_desc desc(bool validated = false) const {
        splat_device_desc desc = device_desc(SPLAT_DEVICE_PROFILE);
        if (validated) desc.flags |= SPLAT_DEVICE_VALIDATION;
        desc.kernels = SPLAT_KERNELS_PLAIN;
        desc.cache_folder = folder_.c_str();
        return desc;
    }

    ScenarioResults undisturbed(bool validated = false) {
        Driver driver(true);
        auto results = run_scenario(driver, desc(validated));
        EXPECT_TRUE(results.has_value()) << splat_last_error_message();
        return results.value_or(ScenarioResults{});
    }

    /// A run in which the n-th hit fails, or all from the n-th on.
    void disturb(std::uint64_t n, bool stays, bool validated) {
        SCOPED_TRACE("fault point " + std::to_string(n) + (stays ? " and all after" : ""));
        Driver driver(stays);
        fault::arm(nullptr, n, stays ? fault::kForever : 1);
        const auto results = run_scenario(driver, desc(validated));
        fault::disarm();
        EXPECT_FALSE(driver.told.empty()) << "nothing failed";
        EXPECT_EQ(results.has_value(), !stays && driver.told.count(SPLAT_ERROR_DEVICE_LOST) == 0);
        EXPECT_TRUE(!results || *results == good_) << "the results differ";
        EXPECT_EQ(host_memory::live(), baseline_) << "the library kept host memory";
        EXPECT_EQ(vk::validation_messages(), 0U) << "Vulkan objects were left, see above";
        told_.insert(driver.told.begin(), driver.told.end());
    }

    const Temporary folder_;
    ScenarioResults good_;
    std::uint64_t hits_ = 0;
    std::size_t baseline_ = 0;
    std::set<splat_result> told_;
};

TEST_F(ApiFault, EveryPointOnceAndFromThereOn) {
    ASSERT_GT(hits_, 50U) << "the fault points are not compiled in";
    for (std::uint64_t n = 1; n <= hits_; ++n) {
        disturb(n, false, n % 8 == 0);
        disturb(n, true, n % 8 == 4);
        if (HasFailure()) FAIL() << "and so on";
    }
    EXPECT_TRUE(undisturbed() == good_);
    for (const splat_result code :
         {SPLAT_ERROR_NO_DEVICE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY,
          SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST})
        EXPECT_EQ(told_.count(code), 1U) << splat_result_name(code) << " was never produced";
    std::printf("%llu fault points, each failed once and from there on\n",
                static_cast<unsigned long long>(hits_));
}

/// Objects of one device, made before anything fails.
struct Objects {
    Objects() : device(open()) {}
    static Device open() {
        splat_device_desc desc = device_desc(SPLAT_DEVICE_PROFILE);
        desc.kernels = SPLAT_KERNELS_PLAIN;
        return open_device(desc);
    }
    [[nodiscard]] OpRequest request() const {
        OpRequest request("linear", {x, weight, nullptr}, {y});
        request.grad_outputs = {y};
        request.grad_inputs = {grad_x, nullptr, nullptr};
        return request;
    }

    Device device;
    Tensor x = upload(device, {2, 2}, {1, 2, 3, 4});
    Tensor weight = upload(device, {2, 2}, {1, 0, 0, 1});
    Tensor y = make_tensor(device, {2, 2});
    Tensor grad_x = make_tensor(device, {2, 2});
    Op op = make_op(device, request());
};

TEST_F(ApiFault, LossIsStickyAndANewDeviceWorks) {
    constexpr splat_result kLost = SPLAT_ERROR_DEVICE_LOST;
    for (int calls_before = 0; calls_before < 2; ++calls_before) {
        Objects all;
        for (int i = 0; i < calls_before; ++i) ASSERT_DONE(splat_op_forward(all.op));
        fault::arm("vk.queue_submit", 1, 1);
        EXPECT_REFUSED(splat_op_forward(all.op), kLost, "create it again");
        EXPECT_EQ(fault::disarm(), 1U);
        for (int i = 0; i < 2; ++i) {
            float values[4] = {9, 9, 9, 9};
            EXPECT_REFUSED(splat_op_forward(all.op), kLost, "create it again");
            EXPECT_REFUSED(splat_tensor_read(all.x, values, 16, nullptr), kLost, "lost");
            EXPECT_REFUSED(splat_tensor_write(all.x, values, 16, nullptr), kLost, "lost");
            EXPECT_EQ(values[0], 9.0F);
            Output<splat_tensor_stats> stats;
            stats.set_struct_size(sizeof(splat_tensor_stats));
            EXPECT_REFUSED(splat_tensor_check(all.x, stats.out()), kLost, "lost");
            Output<void*> pointer;
            EXPECT_REFUSED(splat_tensor_map(all.x, SPLAT_ACCESS_READ, pointer.out(), nullptr),
                           kLost, "lost");
            Output<splat_tensor> tensor;
            const splat_tensor_desc desc = tensor_desc({2});
            EXPECT_REFUSED(splat_tensor_create(all.device, &desc, tensor.out()), kLost, "lost");
            Output<splat_op> op;
            const OpRequest request = all.request();
            const splat_op_desc op_desc = request.desc();
            EXPECT_REFUSED(splat_op_create(all.device, &op_desc, op.out()), kLost, "lost");
            EXPECT_TRUE(stats.untouched() && pointer.untouched() && tensor.untouched() &&
                        op.untouched());
        }
        Objects again;
        ASSERT_DONE(splat_op_forward(again.op));
        EXPECT_EQ(download(again.y), (Floats{1, 2, 3, 4}));
    }
}

TEST_F(ApiFault, LossWhileMappedIsToldAtUnmap) {
    Objects all;
    mapped(all.x, SPLAT_ACCESS_READ_WRITE);
    const splat_tensor_desc desc = tensor_desc({2});
    splat_tensor tensor = nullptr;
    fault::arm("vk.queue_submit", 1, 1);
    EXPECT_REFUSED(splat_tensor_create(all.device, &desc, &tensor), SPLAT_ERROR_DEVICE_LOST, "");
    fault::disarm();
    EXPECT_REFUSED(splat_tensor_unmap(all.x), SPLAT_ERROR_DEVICE_LOST, "lost");
}

TEST_F(ApiFault, TimeoutsAreOverWhenRepeated) {
    Objects all;
    for (int i = 0; i < 3; ++i) {
        fault::arm("vk.wait_timeout", 1, 1);
        EXPECT_REFUSED(splat_op_forward(all.op), SPLAT_ERROR_TIMEOUT, "SPLAT_TIMEOUT_SCALE");
        fault::disarm();
        EXPECT_DONE(splat_op_forward(all.op));
        EXPECT_EQ(download(all.y), (Floats{1, 2, 3, 4}));
    }
    fault::arm("vk.wait_timeout", 1, 2);  // the second while the first is waited for
    EXPECT_REFUSED(splat_op_forward(all.op), SPLAT_ERROR_TIMEOUT, "");
    EXPECT_REFUSED(splat_op_backward(all.op), SPLAT_ERROR_TIMEOUT, "");
    fault::disarm();
    EXPECT_DONE(splat_op_backward(all.op));
    EXPECT_EQ(download(all.grad_x), (Floats{1, 2, 3, 4}));
}

/// A rasterizer that has drawn two scenes, one after the other, so that both are on the device.
struct Drawing {
    Drawing() {
        SampleScene sample(5);
        one = sample.create();
        for (float& value : sample.sh) value += 0.5F;
        other = sample.create();
        EXPECT_DONE(draw(other));
        EXPECT_DONE(draw(one));
    }
    splat_result draw(const Scene& scene) { return test::draw(rasterizer, scene, camera); }
    [[nodiscard]] Floats image() const {
        return output(rasterizer, SPLAT_OUTPUT_RGB, 3 * std::size_t{20} * 18);
    }
    Floats gradient() {
        auto desc = sized<splat_gradients_desc>();
        desc.grad_rgb = weights;
        desc.grad_means = grad_means;
        EXPECT_DONE(splat_rasterizer_backward(rasterizer, nullptr, &desc));
        return download(grad_means);
    }

    Device device = Objects::open();
    Rasterizer rasterizer =
        make_rasterizer(device, rasterizer_desc(5, 20, 18, SPLAT_RASTERIZER_BACKWARD));
    Tensor weights = upload(device, {1, 18, 20, 3}, Floats(3 * std::size_t{20} * 18, 1.0F));
    Tensor grad_means = make_tensor(device, {5, 3});
    splat_camera camera = sample_camera(20, 18);
    Scene one, other;
};

TEST_F(ApiFault, ImagesStayUntilTheDeviceWorks) {
    // Command buffers and fences may be those of earlier lists, so their points may not be reached.
    for (const char* point : {"vk.create_descriptor_pool"}) {
        SCOPED_TRACE(point);
        Drawing drawing;
        const Floats image = drawing.image();
        const Floats gradient = drawing.gradient();
        fault::arm(point, 1, 1);
        EXPECT_TRUE(documented(drawing.draw(drawing.other)));
        EXPECT_GE(fault::disarm(), 1U);
        EXPECT_EQ(drawing.image(), image);
        EXPECT_EQ(drawing.gradient(), gradient);
        ASSERT_DONE(drawing.draw(drawing.other));
        EXPECT_NE(drawing.image(), image);
    }
    Drawing drawing;
    fault::arm("vk.wait_timeout", 1, 1);
    EXPECT_REFUSED(drawing.draw(drawing.other), SPLAT_ERROR_TIMEOUT, "");
    fault::disarm();
    Floats alpha(std::size_t{20} * 18);
    EXPECT_REFUSED(splat_rasterizer_read(drawing.rasterizer, nullptr, SPLAT_OUTPUT_ALPHA,
                                         alpha.data(), alpha.size() * sizeof(float)),
                   kState, "has drawn nothing");
    EXPECT_DONE(drawing.draw(drawing.other));
}

/// After a failed draw, the device keeps only the scene that the recorded lists name.
TEST_F(ApiFault, FailedDrawsKeepOneScene) {
    for (const std::string point : {"vk.create_descriptor_pool", "vk.wait_timeout"}) {
        SCOPED_TRACE(point);
        Drawing drawing;
        const Floats gradient = drawing.gradient();
        drawing.one.destroy();  // now only the rasterizer keeps it
        const Rasterizer second = make_rasterizer(drawing.device, rasterizer_desc(5, 20, 18));
        const auto draw = [&](const Scene& scene) {
            return test::draw(second, scene, drawing.camera);
        };
        std::vector<std::uint64_t> live;
        for (int i = 0; i < 3; ++i) {
            Scene scene = SampleScene(5).create();
            ASSERT_DONE(draw(scene));  // uploads it, so that only drawing can fail
            fault::arm(point.c_str(), 1, 1);
            EXPECT_TRUE(documented(drawing.draw(scene)));
            EXPECT_GE(fault::disarm(), 1U);
            ASSERT_DONE(draw(drawing.other));
            scene.destroy();
            const auto memory = got(splat_device_get_memory, drawing.device);
            live.push_back(memory.live_bytes);
        }
        EXPECT_EQ(live, std::vector<std::uint64_t>(3, live[0]));
        if (point != "vk.wait_timeout") {
            EXPECT_EQ(drawing.gradient(), gradient) << "of the scene before";
        }
        EXPECT_DONE(drawing.draw(drawing.other));
    }
}

TEST_F(ApiFault, TimeoutsLoseNoDeviceMemory) {
    Objects all;
    for (int i = 0; i < 3; ++i) {
        const splat_tensor_desc desc = tensor_desc({1 << 20});
        splat_tensor tensor = nullptr;
        fault::arm("vk.wait_timeout", 1, 1);
        EXPECT_REFUSED(splat_tensor_create(all.device, &desc, &tensor), SPLAT_ERROR_TIMEOUT, "");
        fault::disarm();
        EXPECT_DONE(splat_op_forward(all.op));
    }
    all.op.destroy();
    for (Tensor* tensor : {&all.x, &all.weight, &all.y, &all.grad_x}) tensor->destroy();
    const auto memory = got(splat_device_get_memory, all.device);
    EXPECT_EQ(memory.live_bytes, 0U);
    EXPECT_EQ(memory.used_bytes, 0U) << "memory that was kept for the device was never returned";
}

/// Each in a process of its own: results are kept as long as it lives.
class ApiSelfTest : public testing::Test {
  protected:
    ApiSelfTest() { desc_.cache_folder = path_.c_str(); }

    static splat_kernels kernels_of(splat_device device) {
        return got(splat_device_get_info, device).kernels;
    }
    /// Which kernels are plain instead, and why.
    static std::string note_of(splat_device device) {
        return got(splat_device_get_info, device).kernels_note;
    }
    static splat_result draw_with(splat_device device, Rasterizer& rasterizer,
                                  std::uint32_t flags = 0) {
        const splat_rasterizer_desc wanted = rasterizer_desc(5, 32, 32, flags);
        return splat_rasterizer_create(device, &wanted, rasterizer.out());
    }

    const Temporary path_;
    splat_device_desc desc_ = device_desc();
    Rasterizer rasterizer_;
};

TEST_F(ApiSelfTest, WrongKernelsAreReplacedOrRefused) {
    fault::arm("self_test.wrong", 1);
    desc_.kernels = SPLAT_KERNELS_GPU;
    const Device chosen = open_device(desc_);
    EXPECT_DONE(draw_with(chosen, rasterizer_));
    EXPECT_EQ(kernels_of(chosen), SPLAT_KERNELS_GPU) << "the caller's choice";
    rasterizer_.destroy();

    desc_.kernels = SPLAT_KERNELS_AUTO;
    const Device device = open_device(desc_);
    EXPECT_EQ(kernels_of(device), SPLAT_KERNELS_CPU);
    fault::arm("self_test.wrong", 1);
    EXPECT_REFUSED(draw_with(device, rasterizer_), SPLAT_ERROR_NO_DEVICE,
                   "computes wrongly with plain kernels: a sort of 5,000 keys is off by 1");
    EXPECT_EQ(fault::disarm(), 2U) << "the fast kernels, then the plain ones";
    const std::string told = splat_last_error_message();
    const auto info = got(splat_device_get_info, device);
    EXPECT_TRUE(holds(told, info.driver)) << told << " names version and compiler";
    EXPECT_DONE(draw_with(device, rasterizer_));
    constexpr const char* kNote =
        "kernels: network cpu, sort plain, blend plain; plain kernels instead of cpu ones (sort): "
        "a sort of 5,000 keys is off by 1, at most 0 is right";
    EXPECT_EQ(note_of(device), kNote);
    EXPECT_EQ(kernels_of(device), SPLAT_KERNELS_CPU) << "those of networks";
    rasterizer_.destroy();

    const Device again = open_device(desc_);
    EXPECT_EQ(note_of(again), kNote) << "the fast ones are known to be wrong";
    fault::arm("self_test.wrong", 1);
    EXPECT_DONE(draw_with(again, rasterizer_));
    EXPECT_EQ(fault::disarm(), 0U) << "a result is kept";
    std::size_t files = 0;
    for (const auto& entry : fs::directory_iterator(path_.path()))
        files += entry.path().extension() == ".tested" ? 1 : 0;
    EXPECT_EQ(files, 1U) << "for the next process";
}

/// A rasterizer has memory for its kernels, so they cannot be replaced under it; those of others can.
TEST_F(ApiSelfTest, ObjectsKeepTheirKernels) {
    const Device device = open_device(desc_);
    const Tensor x = make_tensor(device, {1, 4}), y = make_tensor(device, {1, 4});
    const Op op = make_op(device, OpRequest("silu", {x}, {y}));
    EXPECT_DONE(draw_with(device, rasterizer_));
    Rasterizer second;
    fault::arm("self_test.wrong", 1, 1);
    EXPECT_REFUSED(draw_with(device, second, SPLAT_RASTERIZER_BACKWARD), SPLAT_ERROR_NO_DEVICE,
                   "open the device again");
    EXPECT_EQ(fault::disarm(), 1U);
    EXPECT_EQ(kernels_of(device), SPLAT_KERNELS_CPU);
    EXPECT_DONE(splat_op_forward(op));
    const Device again = open_device(desc_);
    EXPECT_TRUE(holds(note_of(again), "(blend): the gradient of a scene")) << note_of(again);
    EXPECT_EQ(kernels_of(again), SPLAT_KERNELS_CPU);
    EXPECT_DONE(draw_with(again, second, SPLAT_RASTERIZER_BACKWARD));
}

/// An operator does not keep the kernels of rasterizers from being replaced.
TEST_F(ApiSelfTest, ObjectsOfOtherKernelsStay) {
    const Device device = open_device(desc_);
    const Tensor x = make_tensor(device, {1, 4}), y = make_tensor(device, {1, 4});
    const Op op = make_op(device, OpRequest("silu", {x}, {y}));
    fault::arm("self_test.wrong", 1, 1);
    EXPECT_DONE(draw_with(device, rasterizer_));
    EXPECT_EQ(fault::disarm(), 4U) << "the sort for CPUs, then all parts with plain kernels";
    EXPECT_TRUE(holds(note_of(device), "(sort)")) << note_of(device);
    EXPECT_DONE(splat_op_forward(op));
}

/// Every family is asked for, and passes, with each set of kernels. A profile does not count the test.
TEST_F(ApiSelfTest, FamiliesPassWithEveryKernels) {
    desc_.flags = SPLAT_DEVICE_PROFILE;
    for (const splat_kernels kernels :
         {SPLAT_KERNELS_PLAIN, SPLAT_KERNELS_CPU, SPLAT_KERNELS_GPU}) {
        desc_.kernels = kernels;
        const Device device = open_device(desc_);
        const Tensor x = make_tensor(device, {1, 4}), y = make_tensor(device, {1, 4});
        const Tensor grad_x = make_tensor(device, {1, 4}), grad_y = make_tensor(device, {1, 4});
        OpRequest silu("silu", {x}, {y});
        silu.grad_outputs = {grad_y};
        silu.grad_inputs = {grad_x};
        const Op op = make_op(device, silu);
        EXPECT_DONE(draw_with(device, rasterizer_, SPLAT_RASTERIZER_BACKWARD));
        rasterizer_.destroy();
        char profile[4096];
        std::size_t needed = 0;
        EXPECT_DONE(splat_device_profile_table(device, profile, sizeof profile, &needed));
        EXPECT_EQ(std::string(profile).find("conv2d"), std::string::npos) << profile;
    }
    std::size_t notes = 0;
    for (const auto& entry : fs::directory_iterator(path_.path())) {
        if (entry.path().extension() != ".tested") continue;
        std::ifstream file(entry.path());
        for (std::string line; std::getline(file, line);) ++notes;
    }
    EXPECT_EQ(notes, 3U * 4U);
}

}  // namespace
}  // namespace splat::test
