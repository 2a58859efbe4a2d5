#include "core/os/console.h"

#include <fcntl.h>
#include <io.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include "core/os/path.h"
#include "core/os/windows.h"

// Takes the types of windows.h.
#include <shellapi.h>

namespace splat::os {
namespace {

UINT g_code_page = 0;  ///< the console's, before

void give_code_page_back() {
    ::SetConsoleOutputCP(g_code_page);
}

std::atomic<bool (*)()> g_asked = nullptr;
std::mutex g_mutex;
std::string g_folder;  ///< removed by an interrupt; empty: none

/// Windows calls it in a thread of its own. FALSE ends the process.
BOOL WINAPI on_event(DWORD event) {
    if (const auto asked = g_asked.load(); asked != nullptr) {
        if (!asked()) return FALSE;
        // The process ends when this returns. It has five seconds to end by itself.
        if (event != CTRL_C_EVENT && event != CTRL_BREAK_EVENT) ::Sleep(INFINITE);
        return TRUE;
    }
    const std::lock_guard guard(g_mutex);
    std::error_code ignored;
    if (!g_folder.empty()) std::filesystem::remove_all(path_of(g_folder), ignored);
    return FALSE;
}

void listen() {
    static const bool once = ::SetConsoleCtrlHandler(on_event, TRUE) != 0;
    static_cast<void>(once);
}

}  // namespace

char** arguments(int& count, char** words) {
    static std::vector<std::string> texts;
    static std::vector<char*> pointers;
    int found = 0;
    wchar_t** const all = ::CommandLineToArgvW(::GetCommandLineW(), &found);
    if (all == nullptr) return words;
    for (int i = 0; i < found; ++i) texts.push_back(utf8(all[i]));
    ::LocalFree(all);
    for (std::string& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    count = found;
    return pointers.data();
}

void prepare_program() {
    for (std::FILE* const stream : {stdin, stdout, stderr})
        if (::_fileno(stream) >= 0) ::_setmode(::_fileno(stream), _O_BINARY);
    // The console keeps its code page when the program has ended.
    g_code_page = ::GetConsoleOutputCP();
    if (g_code_page != 0 && g_code_page != CP_UTF8 && ::SetConsoleOutputCP(CP_UTF8) != 0)
        std::atexit(give_code_page_back);
    const HANDLE errors = ::GetStdHandle(STD_ERROR_HANDLE);
    DWORD mode = 0;
    if (::GetConsoleMode(errors, &mode) != 0)
        ::SetConsoleMode(errors, mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING);
}

bool errors_on_terminal() {
    DWORD mode = 0;
    return ::GetConsoleMode(::GetStdHandle(STD_ERROR_HANDLE), &mode) != 0 &&
           (mode & ENABLE_VIRTUAL_TERMINAL_PROCESSING) != 0;
}

void write_error(const char* text) {
    DWORD written = 0;
    ::WriteFile(::GetStdHandle(STD_ERROR_HANDLE), text, static_cast<DWORD>(std::strlen(text)),
                &written, nullptr);
}

void catch_interrupts(bool (*asked)(), void (*)()) {
    g_asked = asked;
    listen();
}

void release_interrupts() {
    g_asked = nullptr;
}

bool remove_when_interrupted(const std::string& folder) {
    const std::lock_guard guard(g_mutex);
    if (!g_folder.empty()) return false;
    g_folder = folder;
    listen();
    return true;
}

void keep_when_interrupted() {
    const std::lock_guard guard(g_mutex);
    g_folder.clear();
}

}  // namespace splat::os
