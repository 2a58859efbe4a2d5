#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>

#include "api/api_calls.h"

namespace splat::test {

double milliseconds_since(std::chrono::steady_clock::time_point begin);

/// SPLAT_TIMEOUT_SCALE, by which slow machines multiply times.
double timeout_scale();

/// A forward call of one dispatch that keeps a device busy on another thread, for at least `least_ms` when
/// it was measured.
class LongCall {
  public:
    LongCall(splat_device device, double least_ms);
    ~LongCall() { finish(); }

    /// Begin it and return when it has held the device for a while.
    void begin();
    [[nodiscard]] bool running() const { return running_; }
    /// Wait for its end. Returns its result.
    splat_result finish();

    [[nodiscard]] double measured_ms() const { return measured_ms_; }
    [[nodiscard]] splat_op op() const { return op_; }

  private:
    void resize(splat_device device, std::int64_t rows);

    Tensor x_, weight_, y_;
    Op op_;
    double measured_ms_ = 0;
    std::atomic<bool> running_ = false;
    std::atomic<splat_result> result_ = SPLAT_OK;
    std::thread thread_;
};

}  // namespace splat::test
