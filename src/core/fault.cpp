#include "core/fault.h"

#if SPLAT_FAULT_POINTS
#include <cstring>
#include <mutex>

namespace splat::fault {
namespace {

std::mutex g_mutex;
const char* g_name = nullptr;
bool g_armed = false;
std::uint64_t g_first = 0;
std::uint64_t g_count = 0;
std::uint64_t g_hits = 0;

}  // namespace

void arm(const char* name, std::uint64_t first, std::uint64_t count) {
    const std::lock_guard lock(g_mutex);
    g_name = name;
    g_armed = true;
    g_first = first;
    g_count = count;
    g_hits = 0;
}

std::uint64_t disarm() {
    const std::lock_guard lock(g_mutex);
    g_armed = false;
    return g_hits;
}

bool hit(const char* name) {
    const std::lock_guard lock(g_mutex);
    if (!g_armed || (g_name != nullptr && std::strcmp(g_name, name) != 0)) return false;
    ++g_hits;
    return g_hits >= g_first && g_hits - g_first < g_count;
}

}  // namespace splat::fault
#endif
