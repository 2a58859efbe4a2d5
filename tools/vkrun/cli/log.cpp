#include "vkrun/cli/log.h"

#include <cstdio>
#include <mutex>
#include <set>
#include <string>

#include "vkrun/cli/handles.h"

namespace vkrun {
namespace {

splat_log_level g_level = SPLAT_LOG_WARNING;
std::string g_who;  ///< begins messages

const char* level_name(splat_log_level level) {
    if (level >= SPLAT_LOG_ERROR) return "error";
    if (level == SPLAT_LOG_WARNING) return "warning";
    return level == SPLAT_LOG_INFO ? "info" : "debug";
}

/// A warning is said once: a folder without splits, for example, may be opened for each of them.
bool is_repeated(splat_log_level level, const char* message) {
    static std::mutex mutex;
    static std::set<std::string> said;
    const std::lock_guard lock(mutex);
    return level == SPLAT_LOG_WARNING && !said.insert(message).second;
}

void print_message(void*, splat_log_level level, const char* message) {
    if (is_repeated(level, message)) return;
    std::fprintf(stderr, "vkrun: %s%s: %s\n", g_who.c_str(), level_name(level),
                 in_own_words(message).c_str());
}

}  // namespace

void log_to_stderr() {
    check(splat_log_set_callback(print_message, nullptr, g_level));
}

void set_verbose(bool verbose) {
    g_level = verbose ? SPLAT_LOG_DEBUG : SPLAT_LOG_WARNING;
    log_to_stderr();
}

ShowInfo::ShowInfo() {
    if (g_level > SPLAT_LOG_INFO)
        check(splat_log_set_callback(print_message, nullptr, SPLAT_LOG_INFO));
}

ShowInfo::~ShowInfo() {
    static_cast<void>(splat_log_set_callback(print_message, nullptr, g_level));
}

void speak_as(const std::string& who) {
    g_who = who;
    if (g_level == SPLAT_LOG_WARNING) g_level = SPLAT_LOG_ERROR;
    log_to_stderr();
}

void print_failure(const std::string& sentence) {
    std::fprintf(stderr, "vkrun: %s%s\n", g_who.c_str(), sentence.c_str());
}

}  // namespace vkrun
