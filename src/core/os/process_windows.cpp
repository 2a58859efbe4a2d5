#include "core/os/process.h"

#include "core/os/path.h"
#include "core/os/windows.h"

namespace splat::os {

std::int64_t process_id() {
    return ::GetCurrentProcessId();
}

std::string program_file() {
    return file_of(nullptr);
}

std::string program_beside(const std::string& name) {
    const std::string program = program_file();
    return program.substr(0, name_start(program)) + name + ".exe";
}

bool may_run(std::int64_t process) {
    const HANDLE handle = ::OpenProcess(SYNCHRONIZE, FALSE, static_cast<DWORD>(process));
    if (handle == nullptr) return ::GetLastError() != ERROR_INVALID_PARAMETER;
    const bool runs = ::WaitForSingleObject(handle, 0) == WAIT_TIMEOUT;
    ::CloseHandle(handle);
    return runs;
}

void on_fork(void (*)(), void (*)(), void (*)()) {}

}  // namespace splat::os
