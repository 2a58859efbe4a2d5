#pragma once

#include <string_view>

namespace splat {

enum class LogLevel : int { kDebug = 1, kInfo = 2, kWarning = 3, kError = 4 };

using LogSink = void (*)(void* user, int level, const char* message);

/// Replace the process-wide sink; nullptr silences. Thread-safe; a message under way on another
/// thread is finished first.
void set_log_sink(LogSink sink, void* user, LogLevel min_level);

/// Hand a message to the sink. Thread-safe, never throws; a message that finds no memory is
/// dropped.
void log(LogLevel level, std::string_view message) noexcept;

}  // namespace splat
