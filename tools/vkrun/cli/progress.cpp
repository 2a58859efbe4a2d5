#include "vkrun/cli/progress.h"

#include <algorithm>
#include <cstdio>

#include "core/os/console.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

constexpr std::size_t kBarWidth = 30;

}  // namespace

Progress::Progress(std::string what, std::size_t total)
    : what_(std::move(what)),
      total_(std::max<std::size_t>(total, 1)),
      terminal_(splat::os::errors_on_terminal()) {}

Progress::~Progress() {
    if (shown_) std::fputs("\r\033[K", stderr);
}

void Progress::show(std::size_t done) {
    if (!terminal_) return;
    shown_ = true;
    const double left = done == 0 ? 0
                                  : watch_.seconds() / static_cast<double>(done) *
                                        static_cast<double>(total_ - done);
    const std::size_t filled = kBarWidth * done / total_;
    const std::string bar = std::string(filled, '#') + std::string(kBarWidth - filled, '.');
    std::fprintf(stderr, "\r%s [%s] %zu/%zu, %s left\033[K", what_.c_str(), bar.c_str(), done,
                 total_, duration_text(left).c_str());
    std::fflush(stderr);
}

}  // namespace vkrun
