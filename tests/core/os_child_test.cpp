// Children. They are this program, which a variable tells what to do.

#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <thread>

#include "core/os/child.h"
#include "core/os/console.h"
#include "core/os/file.h"
#include "core/os/path.h"
#include "core/os/process.h"
#if defined(_WIN32)
#include "core/os/windows.h"
#endif

namespace splat::os {
namespace {

constexpr const char* kRole = "SPLAT_OS_TEST_ROLE";
constexpr int kStatus = 7;
/// What quoting and code pages spoil.
const std::vector<std::string> kWords = {"a b", "", R"(c:\d\)", R"("e" \"f\\")", "größe 日本"};

/// Whether end() asks a child without a console, as those of tests are.
#if defined(_WIN32)
constexpr bool kAsks = false;
#else
constexpr bool kAsks = true;
#endif

std::atomic<bool> g_asked = false;

std::string line_of(const std::string& word) {
    std::string line = "word ";
    char digits[3];
    for (const char c : word) {
        std::snprintf(digits, sizeof digits, "%02x", static_cast<unsigned>(c) & 0xFFU);
        line += digits;
    }
    return line + "\n";
}

/// The arguments behind those of the test framework.
std::string own_words() {
    std::vector<std::string> known = testing::internal::GetArgvs();
    std::vector<char*> pointers;
    for (std::string& word : known) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    int count = static_cast<int>(known.size());
    char** const words = arguments(count, pointers.data());
    std::string lines;
    for (int i = count - static_cast<int>(kWords.size()); i < count; ++i)
        lines += line_of(words[i]);
    return lines;
}

/// Where end() cannot ask it, a child has Ctrl-C in a console of its own.
void ask_itself() {
#if defined(_WIN32)
    const HANDLE errors = ::GetStdHandle(STD_ERROR_HANDLE);
    ::FreeConsole();
    if (::AllocConsole() == 0) write_error("no console\n");
    ::SetStdHandle(STD_ERROR_HANDLE, errors);
    ::SetConsoleCtrlHandler(nullptr, FALSE);  // groups of their own begin without Ctrl-C
    if (::GenerateConsoleCtrlEvent(CTRL_C_EVENT, 0) == 0) write_error("no Ctrl-C\n");
#endif
}

void wait_until_asked() {
    for (int i = 0; i < 3000 && !g_asked; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
}

void play(const std::string& role) {
    if (role == "words") write_error(own_words().c_str());
    if (role == "echo") {
        std::string line;
        std::getline(std::cin, line);
        write_error((line + "\n").c_str());
    }
    if (role == "saves") {
        catch_interrupts([] { return !g_asked.exchange(true); }, [] {});
        write_error("ready\n");
        ask_itself();
        wait_until_asked();
        write_error("saved\n");
    }
    if (role == "removes") {
        std::string folder = temporary_place() + "/splat-os-child-XXXXXX";
        if (make_temporary_folder(folder) != 0 || !remove_when_interrupted(folder)) return;
        write_error((folder + "\n").c_str());
        if (!kAsks) std::getline(std::cin, folder);  // until the folder was seen
        ask_itself();
        wait_until_asked();
    }
    std::_Exit(kStatus);
}

/// False under an emulator that the system does not know.
bool system_starts_this_program() {
    Child child;
    return child.start({program_file(), "--gtest_list_tests"},
                       {.in = Stream::kNone, .out = Stream::kNone, .error = Stream::kNone}) != 0 ||
           child.wait() != 127;
}

class OsChild : public testing::Test {
  protected:
    void SetUp() override {
        if (!variable(kRole) && !system_starts_this_program())
            GTEST_SKIP() << "an emulator runs this program, the system does not start it";
    }
    /// Starts this program with a role. Its errors are piped.
    void start(const std::string& role, Stream in = Stream::kNone) {
        std::vector<std::string> words = {program_file(), "--gtest_filter=OsChild.PlaysItsRole"};
        words.insert(words.end(), kWords.begin(), kWords.end());
        ASSERT_EQ(child_.start(words, {.in = in,
                                       .out = Stream::kNone,
                                       .error = Stream::kPiped,
                                       .own_group = true,
                                       .variables = {{kRole, role}}}),
                  0);
    }
    /// What it writes, up to so many bytes.
    std::string read(std::size_t most = 10'000) {
        std::string text;
        char buffer[100];
        while (text.size() < most) {
            const auto got = child_.read(buffer, sizeof buffer, 60'000);
            if (!got) break;
            EXPECT_TRUE(got->error || got->bytes == 0);
            text.append(buffer, got->bytes);
        }
        return text;
    }

    Child child_;
};

TEST_F(OsChild, PlaysItsRole) {
    if (const auto role = variable(kRole)) play(*role);
}

TEST_F(OsChild, GetsItsWordsAsTheyAre) {
    start("words");
    std::string expected;
    for (const std::string& word : kWords) expected += line_of(word);
    EXPECT_EQ(read(), expected);
    EXPECT_EQ(child_.wait(), kStatus);
}

TEST_F(OsChild, AnswersWhatIsWritten) {
    start("echo", Stream::kPiped);
    EXPECT_TRUE(child_.write("größe\n"));
    EXPECT_EQ(read(), "größe\n");
    EXPECT_EQ(child_.wait(), kStatus);
    EXPECT_FALSE(child_.write("nobody reads it\n"));
}

TEST_F(OsChild, NothingComesWithinTheTime) {
    start("echo", Stream::kPiped);
    char byte = 0;
    const auto got = child_.read(&byte, 1, 10);
    ASSERT_TRUE(got);
    EXPECT_EQ(got->bytes, 0U);
}

TEST_F(OsChild, SavesBeforeItEnds) {
    start("saves");
    EXPECT_EQ(read(6), "ready\n");
    if (kAsks) child_.end();
    EXPECT_EQ(read(), "saved\n");
}

TEST_F(OsChild, RemovesItsFolder) {
    start("removes", kAsks ? Stream::kNone : Stream::kPiped);
    std::string folder = read(1);
    for (std::string more = folder; !more.empty() && !folder.ends_with("\n"); folder += more)
        more = read(1);
    ASSERT_TRUE(folder.ends_with("\n")) << folder;
    folder.pop_back();
    FileInfo info;
    EXPECT_EQ(examine(folder, info), 0);
    EXPECT_TRUE(is_own_folder(folder));
    if (kAsks) {
        child_.end();
    } else {
        EXPECT_TRUE(child_.write("go on\n"));
        EXPECT_EQ(read(), "");
        const int status = child_.wait();
        EXPECT_TRUE(status == 128 + 2 || status == 0) << status;  // 0: of Wine
    }
    EXPECT_EQ(examine(folder, info), -1);
}

TEST_F(OsChild, ThatIsMissingIsNotStarted) {
    EXPECT_EQ(child_.start({"splat-there-is-no-such-program"}, {}), ENOENT);
    EXPECT_EQ(child_.start({temporary_place() + "/splat-no-such-program"}, {}), ENOENT);
}

}  // namespace
}  // namespace splat::os
