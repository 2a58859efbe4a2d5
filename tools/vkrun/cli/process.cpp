#include "vkrun/cli/process.h"

#include <fcntl.h>
#include <unistd.h>

#include <csignal>

#include "vkrun/cli/handles.h"

namespace vkrun {

void prepare_process() {
    int file = 0;
    do file = open("/dev/null", O_RDWR);  // the lowest number that is free
    while (file >= 0 && file <= STDERR_FILENO);
    if (file >= 0) close(file);
    std::signal(SIGPIPE, SIG_DFL);
    std::signal(SIGXFSZ, SIG_IGN);  // writing beyond a limit of sizes then fails, and says so
}

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
