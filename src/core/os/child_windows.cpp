#include <algorithm>
#include <cerrno>
#include <cstdlib>

#include "core/os/child.h"
#include "core/os/path.h"
#include "core/os/windows.h"

namespace splat::os {
namespace {

constexpr DWORD kGraceMs = 5000;  ///< for a program that is asked to end
constexpr DWORD kPipeBytes = 1 << 16;
constexpr DWORD kStepMs =
    5;  ///< between looks at pipes, for whose bytes nobody can wait with a limit

HANDLE handle_of(Handle file) {
    return reinterpret_cast<HANDLE>(file);
}

void close_handle(Handle& file) {
    if (file != kNoHandle) ::CloseHandle(handle_of(file));
    file = kNoHandle;
}

int failed_number() {
    fail();
    return errno;
}

/// Both ends of what connects a stream of a child with this process.
struct Ends {
    Handle child = kNoHandle, ours = kNoHandle;
    Ends() = default;
    ~Ends() { close_handle(child), close_handle(ours); }
    Ends(const Ends&) = delete;
    Ends& operator=(const Ends&) = delete;
    Handle take() { return std::exchange(ours, kNoHandle); }
};

/// Gives the child a handle that only it inherits. Returns an error number.
int open_stream(Stream kind, DWORD standard, Ends& ends) {
    const bool input = standard == STD_INPUT_HANDLE;
    HANDLE child = nullptr, ours = nullptr;
    const HANDLE shared = kind == Stream::kShared ? ::GetStdHandle(standard) : nullptr;
    if (kind == Stream::kPiped) {
        if (::CreatePipe(input ? &child : &ours, input ? &ours : &child, nullptr, kPipeBytes) == 0)
            return failed_number();
        ends.ours = reinterpret_cast<Handle>(ours);
    } else if (shared != nullptr && shared != INVALID_HANDLE_VALUE) {
        const HANDLE process = ::GetCurrentProcess();
        if (::DuplicateHandle(process, shared, process, &child, 0, TRUE, DUPLICATE_SAME_ACCESS) ==
            0)
            return failed_number();
    } else {  // there is none
        child =
            ::CreateFileW(L"NUL", input ? GENERIC_READ : GENERIC_WRITE,
                          FILE_SHARE_READ | FILE_SHARE_WRITE, nullptr, OPEN_EXISTING, 0, nullptr);
        if (child == INVALID_HANDLE_VALUE) return failed_number();
    }
    ends.child = reinterpret_cast<Handle>(child);
    return ::SetHandleInformation(child, HANDLE_FLAG_INHERIT, HANDLE_FLAG_INHERIT) != 0
               ? 0
               : failed_number();
}

/// A word as programs of the C runtime read it back. Source: the rules of CommandLineToArgvW, where backslashes mean
/// something only before a quote.
std::wstring quoted(const std::wstring& word) {
    if (!word.empty() && word.find_first_of(L" \t\n\v\"") == std::wstring::npos) return word;
    std::wstring text = L"\"";
    std::size_t backslashes = 0;
    for (const wchar_t c : word) {
        if (c == L'"') text.append(backslashes + 1, L'\\');
        backslashes = c == L'\\' ? backslashes + 1 : 0;
        text += c;
    }
    return text.append(backslashes, L'\\') + L'"';
}

bool is_file(const std::wstring& path) {
    const DWORD attributes = ::GetFileAttributesW(path.c_str());
    return attributes != INVALID_FILE_ATTRIBUTES && (attributes & FILE_ATTRIBUTE_DIRECTORY) == 0;
}

/// Empty if there is none. Neither the current folder nor scripts are searched: their words would be read by rules of
/// other kinds.
std::wstring find_program(const std::string& name) {
    const std::string file = one_name(name).ends_with(".exe") ? name : name + ".exe";
    if (name.find_first_of("/\\:") != std::string::npos) {
        const std::wstring path = wide_path(file);
        return is_file(path) ? path : L"";
    }
    const std::string folders = variable("PATH").value_or("") + ";";
    for (std::size_t start = 0, end = 0; (end = folders.find(';', start)) != std::string::npos;
         start = end + 1) {
        if (end == start) continue;
        const std::wstring path = wide_path(folders.substr(start, end - start) + "/" + file);
        if (is_file(path)) return path;
    }
    return {};
}

bool same_name(std::wstring_view a, std::wstring_view b) {
    return ::CompareStringOrdinal(a.data(), static_cast<int>(a.size()), b.data(),
                                  static_cast<int>(b.size()), TRUE) == CSTR_EQUAL;
}

/// The block of the environment: texts "NAME=VALUE", each with its null character, and another one.
std::wstring environment_with(const std::vector<std::pair<std::string, std::string>>& variables) {
    std::vector<std::wstring> all;
    for (const auto& [name, value] : variables) all.push_back(wide(name + "=" + value));
    wchar_t* const block = ::GetEnvironmentStringsW();
    for (const wchar_t* at = block; at != nullptr && *at != L'\0';) {
        const std::wstring_view text = at;
        at += text.size() + 1;
        const std::wstring_view name = text.substr(0, text.find(L'=', 1));  // "=C:" is one
        if (std::none_of(variables.begin(), variables.end(),
                         [&](const auto& one) { return same_name(wide(one.first), name); }))
            all.emplace_back(text);
    }
    if (block != nullptr) ::FreeEnvironmentStringsW(block);
    // Windows wants them sorted by their names, without regard to case.
    std::sort(all.begin(), all.end(), [](const std::wstring& a, const std::wstring& b) {
        return ::CompareStringOrdinal(a.data(), static_cast<int>(a.find(L'=', 1)), b.data(),
                                      static_cast<int>(b.find(L'=', 1)), TRUE) == CSTR_LESS_THAN;
    });
    std::wstring made;
    for (const std::wstring& text : all) (made += text) += L'\0';
    return made + L'\0';
}

/// The list of the handles that a child inherits.
class Inherited {
  public:
    explicit Inherited(std::vector<HANDLE> handles) : handles_(std::move(handles)) {
        SIZE_T bytes = 0;
        ::InitializeProcThreadAttributeList(nullptr, 1, 0, &bytes);
        memory_.resize(bytes);
        ok_ = ::InitializeProcThreadAttributeList(get(), 1, 0, &bytes) != 0;
        ok_ = ok_ && ::UpdateProcThreadAttribute(get(), 0, PROC_THREAD_ATTRIBUTE_HANDLE_LIST,
                                                 handles_.data(), handles_.size() * sizeof(HANDLE),
                                                 nullptr, nullptr) != 0;
    }
    ~Inherited() {
        if (ok_) ::DeleteProcThreadAttributeList(get());
    }
    Inherited(const Inherited&) = delete;
    Inherited& operator=(const Inherited&) = delete;

    [[nodiscard]] bool ok() const { return ok_; }
    LPPROC_THREAD_ATTRIBUTE_LIST get() {
        return reinterpret_cast<LPPROC_THREAD_ATTRIBUTE_LIST>(memory_.data());
    }

  private:
    std::vector<HANDLE> handles_;
    std::vector<char> memory_;
    bool ok_ = false;
};

void set_limits(HANDLE job, DWORD flags) {
    JOBOBJECT_EXTENDED_LIMIT_INFORMATION limits{};
    limits.BasicLimitInformation.LimitFlags = flags;
    ::SetInformationJobObject(job, JobObjectExtendedLimitInformation, &limits, sizeof limits);
}

/// What ends all processes of it, the children of a child too, when its last handle is closed.
Handle make_job() {
    const HANDLE job = ::CreateJobObjectW(nullptr, nullptr);
    if (job == nullptr) return kNoHandle;
    set_limits(job, JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE);
    return reinterpret_cast<Handle>(job);
}

/// Bytes that wait in a pipe; nothing if its other end is closed.
std::optional<DWORD> waiting_bytes(Handle pipe) {
    DWORD bytes = 0;
    if (::PeekNamedPipe(handle_of(pipe), nullptr, 0, nullptr, &bytes, nullptr) == 0) return {};
    return bytes;
}

}  // namespace

int Child::start(const std::vector<std::string>& words, const ChildOptions& options) {
    const std::wstring program = find_program(words[0]);
    if (program.empty()) return ENOENT;
    Ends in, out, error;
    int failed = open_stream(options.in, STD_INPUT_HANDLE, in);
    if (failed == 0) failed = open_stream(options.out, STD_OUTPUT_HANDLE, out);
    if (failed == 0 && !options.joined)
        failed = open_stream(options.error, STD_ERROR_HANDLE, error);
    if (failed != 0) return failed;
    std::vector<HANDLE> handles = {handle_of(in.child), handle_of(out.child)};
    if (!options.joined) handles.push_back(handle_of(error.child));
    STARTUPINFOEXW how{};
    how.StartupInfo.cb = sizeof how;
    how.StartupInfo.dwFlags = STARTF_USESTDHANDLES;
    how.StartupInfo.hStdInput = handles.front();
    how.StartupInfo.hStdOutput = handles[1];
    how.StartupInfo.hStdError = handles.back();
    Inherited inherited(std::move(handles));
    if (!inherited.ok()) return failed_number();
    how.lpAttributeList = inherited.get();
    std::wstring line;
    for (const std::string& word : words) line += (line.empty() ? L"" : L" ") + quoted(wide(word));
    std::wstring environment = environment_with(options.variables);
    // Suspended until it is in its job, which its own children then are in, too.
    const DWORD flags = EXTENDED_STARTUPINFO_PRESENT | CREATE_UNICODE_ENVIRONMENT |
                        CREATE_SUSPENDED | (options.own_group ? CREATE_NEW_PROCESS_GROUP : 0);
    PROCESS_INFORMATION started{};
    if (::CreateProcessW(program.c_str(), line.data(), nullptr, nullptr, TRUE, flags,
                         environment.data(), nullptr, &how.StartupInfo, &started) == 0)
        return failed_number();
    group_ = make_job();
    if (group_ != kNoHandle) ::AssignProcessToJobObject(handle_of(group_), started.hProcess);
    ::ResumeThread(started.hThread);
    ::CloseHandle(started.hThread);
    process_ = reinterpret_cast<Handle>(started.hProcess);
    asked_by_group_ = options.own_group;
    in_ = in.take();
    out_ = out.take();
    error_ = error.take();
    return 0;
}

bool Child::write(std::string_view bytes) {
    while (!bytes.empty()) {
        const std::int64_t put = os::write(in_, bytes.data(), bytes.size(), {});
        if (put <= 0) return false;
        bytes.remove_prefix(static_cast<std::size_t>(put));
    }
    return true;
}

void Child::close_input() {
    close_handle(in_);
}

void Child::close_output() {
    close_handle(out_);
    close_handle(error_);
    close_handle(group_);
}

std::optional<Output> Child::read(void* to, std::size_t bytes, int wait_ms) {
    const ULONGLONG begun = ::GetTickCount64();
    while (true) {
        if (out_ == kNoHandle && error_ == kNoHandle) return std::nullopt;
        for (int turn = 0; turn < 2; ++turn) {
            errors_first_ = !errors_first_;
            Handle& pipe = errors_first_ ? error_ : out_;
            if (pipe == kNoHandle) continue;
            const std::optional<DWORD> there = waiting_bytes(pipe);
            if (there == 0U) continue;
            const std::int64_t got =
                there ? os::read(pipe, to, std::min<std::size_t>(bytes, *there), {}) : 0;
            if (got > 0) return Output{errors_first_, static_cast<std::size_t>(got)};
            close_handle(pipe);
            return Output{};
        }
        // A sleep takes longer than asked for, often 15 ms.
        if (wait_ms >= 0 && ::GetTickCount64() - begun >= static_cast<ULONGLONG>(wait_ms))
            return Output{};
        ::Sleep(kStepMs);
    }
}

int Child::wait() {
    DWORD status = 0;
    if (::WaitForSingleObject(handle_of(process_), INFINITE) != WAIT_OBJECT_0 ||
        ::GetExitCodeProcess(handle_of(process_), &status) == 0)
        return -1;
    close_handle(process_);
    if (group_ != kNoHandle) set_limits(handle_of(group_), 0);  // what it left running goes on
    if (status == static_cast<DWORD>(STATUS_CONTROL_C_EXIT)) return 128 + 2;  // SIGINT
    constexpr DWORD kFirstFault = 0xC0000000;
    return status >= kFirstFault ? 128 + 11 : static_cast<int>(status);  // SIGSEGV
}

void Child::end() {
    if (process_ == kNoHandle) return;
    const HANDLE process = handle_of(process_);
    // Ctrl-Break is for a group, and what shares ours is not asked.
    if (asked_by_group_ &&
        ::GenerateConsoleCtrlEvent(CTRL_BREAK_EVENT, ::GetProcessId(process)) != 0)
        ::WaitForSingleObject(process, kGraceMs);
    if (group_ != kNoHandle) ::TerminateJobObject(handle_of(group_), 1);
    ::TerminateProcess(process, 1);
    ::WaitForSingleObject(process, INFINITE);
    close_handle(process_);
}

int run_instead(const std::string& program, char** words) {
    std::vector<std::string> all;
    for (; *words != nullptr; ++words) all.emplace_back(*words);
    all.at(0) = program;
    Child child;
    if (const int failed = child.start(all, {}); failed != 0) return failed;
    // Ctrl-C is for the other one, whose end this one waits for.
    ::SetConsoleCtrlHandler([](DWORD) -> BOOL { return TRUE; }, TRUE);
    std::exit(child.wait());
}

}  // namespace splat::os
