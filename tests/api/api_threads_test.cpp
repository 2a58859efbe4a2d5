// Many threads, with one device for all and with one device each. Results have the same bits as
// those of a single thread.
#include <array>
#include <barrier>
#include <filesystem>
#include <thread>

#include "api/scenario/scenario.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kThreads = 8;
constexpr int kRounds = 20;  // rounds of about 25 calls each

/// What one thread owns on the shared device.
struct Work {
    Work(splat_device device, std::uint64_t seed)
        : device_(device),
          input(normal_fill(2 * 8 * 6, seed)),
          x(upload(device, {2, 8, 3, 2}, input, "x")),
          gamma(upload(device, {8}, normal_fill(8, seed + 1))),
          beta(upload(device, {8}, normal_fill(8, seed + 2))),
          y(make_tensor(device, {2, 8, 3, 2})),
          grad_x(make_tensor(device, {2, 8, 3, 2})),
          grad_gamma(make_tensor(device, {8})),
          grad_beta(make_tensor(device, {8})),
          rows(upload(device, {12, 8}, input)),
          weight(upload(device, {5, 8}, normal_fill(40, seed + 3))),
          out(make_tensor(device, {12, 5})) {
        OpRequest request("group_norm", {x, gamma, beta}, {y});
        request.attributes = R"({"groups": 2, "silu": true})";
        request.grad_outputs = {x};
        request.grad_inputs = {grad_x, grad_gamma, grad_beta};
        norm = make_op(device, request);
        linear = make_op(device, OpRequest("linear", {rows, weight, nullptr}, {out}));
    }

    /// One round of mixed calls; the results in one vector.
    Floats round(const std::string& name) {
        write(x, input);
        EXPECT_DONE(splat_op_forward(norm));
        EXPECT_DONE(splat_op_backward(norm));
        EXPECT_DONE(splat_op_forward(linear));
        Floats results;
        for (const Tensor* tensor : {&y, &grad_x, &grad_gamma, &grad_beta, &out})
            for (const float value : download(*tensor)) results.push_back(value);
        const auto stats = got(splat_tensor_check, y);
        results.push_back(static_cast<float>(stats.mean));
        results.push_back(*mapped(out, SPLAT_ACCESS_READ));
        EXPECT_DONE(splat_tensor_unmap(out));
        const auto memory = got(splat_device_get_memory, device_);
        EXPECT_LE(memory.live_bytes, memory.used_bytes);
        got(splat_device_get_info, device_);
        const Tensor passing = upload(device_, {2, 3}, {1, 2, 3, 4, 5, 6}, name.c_str());
        float one = 0;
        EXPECT_REFUSED(splat_tensor_read(passing, &one, 4, nullptr), kArgument, "takes 24");
        const splat_tensor_desc none = tensor_desc({0}, name.c_str());
        splat_tensor tensor = nullptr;
        EXPECT_REFUSED(splat_tensor_create(device_, &none, &tensor), kArgument, name);
        return results;
    }

    splat_device device_;
    Floats input;
    Tensor x, gamma, beta, y, grad_x, grad_gamma, grad_beta, rows, weight, out;
    Op norm, linear;
};

TEST(ApiThreads, ShareOneDevice) {
    std::array<Floats, kThreads> expected;
    for (std::size_t i = 0; i < kThreads; ++i)
        expected[i] = Work(shared_device(), i * 10).round("alone");
    std::array<std::unique_ptr<Work>, kThreads> works;
    std::barrier ready(kThreads);
    const auto body = [&](std::size_t i) {
        works[i] = std::make_unique<Work>(shared_device(), i * 10);
        ready.arrive_and_wait();
        for (int round = 0; round < kRounds; ++round)
            EXPECT_TRUE(same_bits(works[i]->round("thread " + std::to_string(i)), expected[i]));
        ready.arrive_and_wait();
        works[(i + 1) % kThreads].reset();  // the neighbour's: destroyed on another thread
    };
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < kThreads; ++i) threads.emplace_back(body, i);
    threads.clear();
    const auto memory = got(splat_device_get_memory, shared_device());
    EXPECT_EQ(memory.live_bytes, 0U);
    EXPECT_EQ(memory.used_bytes, 0U);
}

TEST(ApiThreads, CreateAndDestroyWhileOthersWork) {
    std::atomic<bool> done = false;
    std::jthread worker([&] {
        Work work(shared_device(), 1);
        const Floats first = work.round("worker");
        for (int round = 0; round < 10; ++round)
            EXPECT_TRUE(same_bits(work.round("worker"), first));
        done = true;
    });
    std::vector<std::jthread> others;
    for (std::uint64_t seed = 2; seed < 5; ++seed)
        others.emplace_back([seed, &done] {
            while (!done) Work(shared_device(), seed).round("other");
        });
}

TEST(ApiThreads, OneHandleUsedByAllAndDestroyedByOne) {
    Work work(shared_device(), 7);
    const splat_op op = work.linear.get();
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < kThreads; ++i)
        threads.emplace_back([&, i] {
            for (int round = 0; round < 20; ++round) {
                if (i == 0 && round == 10) work.linear.destroy();
                const splat_result result = splat_op_forward(op);
                EXPECT_TRUE(result == SPLAT_OK || result == kHandle) << splat_result_name(result);
            }
        });
    threads.clear();
    EXPECT_REFUSED(splat_op_forward(op), kHandle, "destroyed");
}

TEST(ApiThreads, HaveADeviceEach) {
    const Temporary folder;
    splat_device_desc desc = device_desc();
    desc.kernels = SPLAT_KERNELS_PLAIN;
    desc.cache_folder = folder.c_str();
    Observer observer;
    const auto expected = run_scenario(observer, desc);
    ASSERT_TRUE(expected.has_value());
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back([&] {
            for (int life = 0; life < 4; ++life) {
                Observer own;
                const auto results = run_scenario(own, desc);
                EXPECT_TRUE(results.has_value() && *results == *expected);
            }
        });
    threads.clear();
    // All of them wrote the same cache file.
    for (const auto& file : fs::directory_iterator(folder.path()))
        EXPECT_EQ(file.path().extension(), ".bin") << file;
}

TEST(ApiThreads, HearTheLogWhileItChanges) {
    std::atomic<bool> done = false;
    std::jthread changing([&] {
        while (!done) {
            EXPECT_DONE(splat_log_set_callback(nullptr, nullptr, 0));
            listen_to_log(SPLAT_LOG_DEBUG);
        }
    });
    std::vector<std::jthread> failing;
    for (int i = 0; i < 4; ++i)
        failing.emplace_back([] {
            for (int call = 0; call < 200; ++call) EXPECT_EQ(splat_tensor_unmap(nullptr), kHandle);
        });
    failing.clear();
    done = true;
    changing.join();
    listen_to_log();
}

}  // namespace
}  // namespace splat::test
