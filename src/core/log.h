#pragma once

#include <string_view>

namespace splat {

enum class LogLevel : int { kDebug = 1, kInfo = 2, kWarning = 3, kError = 4 };

using LogSink = void (*)(void* user, int level, const char* message);

/// Replace the process-wide sink; nullptr silences. Thread-safe. Returns when no other thread runs
/// the old sink any more; called from inside a sink it does not wait.
void set_log_sink(LogSink sink, void* user, LogLevel min_level);

/// Hand a message to the sink, with no lock held. Thread-safe, never throws; drops the message if
/// there is no memory, and one that the sink itself causes on its thread.
void log(LogLevel level, std::string_view message) noexcept;

/// Until the release_log() that pairs with it, messages of this thread wait: the caller is about to
/// take locks that the sink must not meet.
void hold_log() noexcept;

/// Returns true if it was the outermost one and messages wait for deliver_log().
bool release_log() noexcept;

/// Hand the messages that wait on this thread to the sink.
void deliver_log() noexcept;

}  // namespace splat
