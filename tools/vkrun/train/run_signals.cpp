#include "vkrun/train/run_signals.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstring>

namespace vkrun {
namespace {

volatile std::sig_atomic_t g_interrupted = 0;

/// What the first signal prints at once, as a step may take minutes.
std::atomic<const char*> g_farewell = "ending before the first step, saving\n";
static_assert(std::atomic<const char*>::is_always_lock_free);

void on_signal(int signal) {
    const char* const text = g_farewell;
    if (g_interrupted == 0 && write(STDERR_FILENO, text, std::strlen(text)) < 0) {
        // nobody reads it
    }
    if (g_interrupted >= 2) {  // the third ends at once
        std::signal(signal, SIG_DFL);
        std::raise(signal);
    }
    g_interrupted = g_interrupted + 1;
}

/// Nobody reads what the training prints any more: it saves and ends, like 'head' had asked for no more.
void on_closed_pipe(int) {
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
    g_farewell = isatty(STDERR_FILENO) != 0 ? text : text + 1;  // behind a bar
}

void catch_run_signals() {
    std::signal(SIGINT, on_signal);
    std::signal(SIGTERM, on_signal);
    std::signal(SIGPIPE, on_closed_pipe);
    if (std::signal(SIGHUP, on_signal) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);  // under nohup
}

bool run_interrupted() {
    return g_interrupted != 0;
}

}  // namespace vkrun
