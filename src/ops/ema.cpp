#include "ops/ema.h"

#include <algorithm>
#include <cmath>

#include "vk/launch.h"

namespace splat::ops {

std::optional<double> ema_decay(std::uint64_t call, const EmaSchedule& schedule) {
    if (call % schedule.update_every != 0) return std::nullopt;
    if (call <= schedule.update_after || call - schedule.update_every <= schedule.update_after)
        return 0;
    const auto epoch = static_cast<double>(call - schedule.update_after);
    return std::clamp(1 - std::pow(1 + epoch, -schedule.power), 0.0, schedule.most);
}

params::EmaParams ema_params(const vk::DeviceInfo& device, double decay, std::uint64_t bytes) {
    const std::uint64_t quads = bytes / 16;
    return {static_cast<std::uint32_t>(quads),
            vk::groups_for(device, quads, vk::workgroup_size(device, 64))[0],
            static_cast<float>(1 - decay)};
}

Status ema(vk::Recorder& recorder, double decay, const vk::BufferView& value,
           const vk::BufferView& shadow) {
    if (!(decay >= 0 && decay <= 1)) return invalid("ema: decay is %g, expected 0 to 1", decay);
    if (value.bytes != shadow.bytes)
        return error(Code::kShape, "ema: value has %llu bytes and shadow %llu, expected the same",
                     llu(value.bytes), llu(shadow.bytes));
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const double bytes = static_cast<double>(value.bytes);
    return recorder.dispatch({
        .op = "ema",
        .shader = "ema",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = ema_params(recorder.device(), decay, value.bytes),
        .accesses = {vk::read(value), vk::read(shadow), vk::write(shadow)},
        .groups = vk::groups_for(recorder.device(), value.bytes / 16, size),
        .work = {.flops = 0.75 * bytes, .bytes = 3 * bytes},
        .may_alias = true,  // an element is written by the invocation that read it
    });
}

}  // namespace splat::ops
