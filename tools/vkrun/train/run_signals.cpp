#include "vkrun/train/run_signals.h"

#include <algorithm>
#include <atomic>
#include <cstdio>

#include "core/os/console.h"

namespace vkrun {
namespace {

std::atomic<int> g_interrupted = 0;

/// What the first signal prints at once, as a step may take minutes.
std::atomic<const char*> g_farewell = "ending before the first step, saving\n";
static_assert(std::atomic<int>::is_always_lock_free &&
              std::atomic<const char*>::is_always_lock_free);

/// The third one ends at once.
bool on_interrupt() {
    const int before = g_interrupted.fetch_add(1);
    if (before == 0) splat::os::write_error(g_farewell);
    return before < 2;
}

/// Nobody reads what the training prints any more: it saves and ends, like 'head' had asked for no more.
void on_closed_pipe() {
    g_interrupted = 1;
}

}  // namespace

void prepare_farewell(const splat_run_event& done) {
    static char texts[2][96];
    static int turn = 0;
    char(&text)[96] = texts[turn ^= 1];
    if (done.kind == SPLAT_EVENT_VALIDATED_PIECE)
        std::snprintf(text, sizeof text, "\nfinishing a piece of the validation, saving\n");
    else
        std::snprintf(text, sizeof text, "\nfinishing step %llu, saving\n",
                      static_cast<unsigned long long>(std::min(done.step + 1, done.iterations)));
    g_farewell = splat::os::errors_on_terminal() ? text : text + 1;  // behind a bar
}

void catch_run_signals(bool tells) {
    if (!tells) g_farewell = "";
    splat::os::catch_interrupts(on_interrupt, on_closed_pipe);
}

bool run_interrupted() {
    return g_interrupted != 0;
}

}  // namespace vkrun
