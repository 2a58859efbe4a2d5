#include "core/log.h"

#include <mutex>
#include <string>

namespace splat {
namespace {

struct Sink {
    std::mutex mutex;
    LogSink function = nullptr;
    void* user = nullptr;
    LogLevel min_level = LogLevel::kWarning;
};

Sink& sink() {
    static Sink instance;
    return instance;
}

}  // namespace

void set_log_sink(LogSink function, void* user, LogLevel min_level) {
    const std::lock_guard lock(sink().mutex);
    sink().function = function;
    sink().user = user;
    sink().min_level = min_level;
}

void log(LogLevel level, std::string_view message) noexcept {
    try {
        const std::lock_guard lock(sink().mutex);
        if (sink().function == nullptr || level < sink().min_level) return;
        sink().function(sink().user, static_cast<int>(level), std::string(message).c_str());
    } catch (...) {
    }
}

}  // namespace splat
