#include "ops/ema.h"

#include <algorithm>
#include <cmath>

#include "ops/quads.h"

namespace splat::ops {

std::optional<double> ema_decay(std::uint64_t call, const EmaSchedule& schedule) {
    if (call % schedule.update_every != 0) return std::nullopt;
    if (call <= schedule.update_after || call - schedule.update_every <= schedule.update_after)
        return 0;
    const auto epoch = static_cast<double>(call - schedule.update_after);
    return std::clamp(1 - std::pow(1 + epoch, -schedule.power), 0.0, schedule.most);
}

Result<std::array<float, 4>> ema_scalars(std::optional<double> decay) {
    if (!decay) return std::array<float, 4>{0, 0, 0, 1};
    if (!(*decay >= 0 && *decay <= 1)) return invalid("ema: decay is %g, expected 0 to 1", *decay);
    return std::array<float, 4>{static_cast<float>(1 - *decay)};
}

Status ema(vk::Recorder& recorder, const vk::BufferView& scalars, const vk::BufferView& value,
           const vk::BufferView& shadow) {
    if (value.bytes != shadow.bytes)
        return error(Code::kShape, "ema: value has %llu bytes and shadow %llu, expected the same",
                     llu(value.bytes), llu(shadow.bytes));
    const double bytes = static_cast<double>(value.bytes);
    return record_each(
        recorder,
        {.kernel = "ema",
         .items = value.bytes / 16,
         .accesses = {vk::read(value), vk::read(shadow), vk::write(shadow), vk::read(scalars)},
         .work = {.flops = 0.75 * bytes, .bytes = 3 * bytes},
         .may_alias = true},  // an element is written by the invocation that read it
        [&](std::uint32_t groups_x) {
            return params::EmaParams{static_cast<std::uint32_t>(value.bytes / 16), groups_x};
        });
}

}  // namespace splat::ops
