#include "core/os/windows.h"

#include <psapi.h>

#include <filesystem>

#include "core/os/path.h"
#include "support/system.h"

namespace splat::test {

void set_variable(const std::string& name, const std::string& value) {
    ::SetEnvironmentVariableW(os::wide(name).c_str(), os::wide(value).c_str());
}

void unset_variable(const std::string& name) {
    ::SetEnvironmentVariableW(os::wide(name).c_str(), nullptr);
}

bool make_fifo(const std::string&) {
    return false;
}

bool makes_links_in(const std::string& folder) {
    std::error_code failed;
    const std::filesystem::path link = os::path_of(folder) / "splat-link";
    std::filesystem::create_symlink("nothing", link, failed);
    std::error_code none;
    std::filesystem::remove(link, none);
    return !failed;
}

bool is_root() {
    return false;
}

FileLimit::FileLimit(std::uint64_t) {}

FileLimit::~FileLimit() = default;

AnotherUser::AnotherUser() = default;

AnotherUser::~AnotherUser() = default;

NoMoreThreads::NoMoreThreads() = default;

NoMoreThreads::~NoMoreThreads() = default;

bool NoMoreThreads::works() const {
    return false;
}

Child::Child(const std::function<int()>&) {}

int Child::wait() const {
    return -1;
}

void end_after(unsigned) {}

std::uint64_t peak_bytes() {
    PROCESS_MEMORY_COUNTERS counters{};
    return ::GetProcessMemoryInfo(::GetCurrentProcess(), &counters, sizeof counters) != 0
               ? counters.PeakWorkingSetSize
               : 0;
}

double processor_seconds() {
    FILETIME times[4];
    if (::GetProcessTimes(::GetCurrentProcess(), times, times + 1, times + 2, times + 3) == 0)
        return 0;
    const auto seconds = [](const FILETIME& time) {
        return 1e-7 * (4294967296.0 * time.dwHighDateTime + time.dwLowDateTime);
    };
    return seconds(times[2]) + seconds(times[3]);
}

}  // namespace splat::test
