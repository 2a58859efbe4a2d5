#include "vkrun/cli/process.h"

#include "vkrun/cli/handles.h"

namespace vkrun {

void scale_decode_limits(std::uint32_t factor) {
    if (factor == 1) return;
    auto limits = sized<splat_decode_limits>();  // the defaults, multiplied
    limits.bytes_times_file = std::uint64_t{64} * factor;
    limits.bytes_besides = (std::uint64_t{64} << 20U) * factor;
    limits.items = std::uint64_t{1'000'000} * factor;
    limits.jpeg_scans = 100 * factor;
    check(splat_decode_set_limits(&limits));
}

}  // namespace vkrun
