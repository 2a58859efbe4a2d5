#include "api/concurrent/long_call.h"

#include <cstdlib>

namespace splat::test {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

double timeout_scale() {
    const char* const text = std::getenv("SPLAT_TIMEOUT_SCALE");
    return text == nullptr ? 1 : std::max(1.0, std::strtod(text, nullptr));
}

LongCall::LongCall(splat_device device, double least_ms) {
    constexpr std::int64_t kMostRows = 32768;  // the tensors then have 128 MiB
    for (std::int64_t rows = 256; measured_ms_ < least_ms && rows <= kMostRows; rows *= 2) {
        resize(device, rows);
        EXPECT_DONE(splat_op_forward(op_));  // compiles its shaders
        const auto begin = Clock::now();
        EXPECT_DONE(splat_op_forward(op_));
        measured_ms_ = milliseconds_since(begin);
    }
}

void LongCall::resize(splat_device device, std::int64_t rows) {
    constexpr std::int64_t kChannels = 1024;
    op_ = Op();
    x_ = make_tensor(device, {rows, kChannels});
    y_ = make_tensor(device, {rows, kChannels});
    weight_ = make_tensor(device, {kChannels, kChannels});
    op_ = make_op(device, OpRequest("linear", {x_, weight_, nullptr}, {y_}));
}

void LongCall::begin() {
    running_ = true;
    thread_ = std::thread([this] {
        result_ = splat_op_forward(op_);
        running_ = false;
    });
    std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(measured_ms_ / 20));
}

splat_result LongCall::finish() {
    if (thread_.joinable()) thread_.join();
    return result_;
}

}  // namespace splat::test
