#include "core/decode_budget.h"

#include <mutex>

#include "core/checked_math.h"
#include "core/fork.h"

namespace splat {
namespace {

struct SharedLimits {
    ForkMutex mutex;
    DecodeLimits limits;
};

}  // namespace

std::uint64_t DecodeLimits::allowed(std::uint64_t file_bytes) const {
    const auto product = checked_mul(file_bytes, times_file);
    const auto sum = product ? checked_add(*product, besides) : std::nullopt;
    return sum.value_or(UINT64_MAX);
}

DecodeLimits decode_limits() {
    auto& shared = for_ever<SharedLimits>();
    const std::lock_guard lock(shared.mutex);
    return shared.limits;
}

void set_decode_limits(const DecodeLimits& limits) {
    auto& shared = for_ever<SharedLimits>();
    const std::lock_guard lock(shared.mutex);
    shared.limits = limits;
}

Status DecodeBudget::take(std::uint64_t count, std::uint64_t each, std::string_view what) {
    const auto bytes = checked_mul(count, each);
    if (!bytes || *bytes > left_)
        return damaged(
            "%.*s: %llu x %llu bytes are too many for a file of %llu bytes, which may take "
            "%llu; it is damaged or made to harm, or the limits must be raised "
            "(splat_decode_set_limits, --decode-scale)",
            static_cast<int>(what.size()), what.data(), llu(count), llu(each), llu(file_bytes_),
            llu(limits_.allowed(file_bytes_)));
    left_ -= *bytes;
    return {};
}

}  // namespace splat
