#pragma once

#include <string>

#include "core/log.h"

namespace splat::test {

/// The messages of the library while it lives, a line each.
class LogCapture {
  public:
    explicit LogCapture(LogLevel level = LogLevel::kWarning) {
        const auto keep = [](void* user, int, const char* message) {
            static_cast<LogCapture*>(user)->text_ += std::string(message) + "\n";
        };
        set_log_sink(keep, this, level);
    }
    ~LogCapture() { set_log_sink(nullptr, nullptr, LogLevel::kWarning); }
    LogCapture(const LogCapture&) = delete;
    LogCapture& operator=(const LogCapture&) = delete;
    [[nodiscard]] const std::string& text() const { return text_; }

  private:
    std::string text_;
};

}  // namespace splat::test
