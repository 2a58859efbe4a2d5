#pragma once

#include <string_view>

namespace splat {

enum class LogLevel : int { kDebug = 1, kInfo = 2, kWarning = 3, kError = 4 };

using LogSink = void (*)(void* user, int level, const char* message);

/// Replace the process-wide sink; nullptr silences. Thread-safe; waits for a message of another
/// thread.
void set_log_sink(LogSink sink, void* user, LogLevel min_level);

/// Hand a message to the sink. Thread-safe, never throws; drops the message if there is no memory.
void log(LogLevel level, std::string_view message) noexcept;

}  // namespace splat
