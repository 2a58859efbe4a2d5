// Files of vkrun, linked in.
#include "vkrun/cli/files.h"

#include <fnmatch.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "vkrun/cli/failure.h"
#include "vkrun/cli/temporary_folder.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;

class ReplaceFile : public testing::Test {
  protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("splat-replace-" + std::to_string(getpid()));
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }
    fs::path folder_;
};

TEST_F(ReplaceFile, KeepsLinksPermissionsAndLongNames) {
    const fs::path target = folder_ / std::string(255, 'n');
    replace_file(target, "old");
    fs::permissions(target, fs::perms{0640});
    fs::create_symlink(target.filename(), folder_ / "link");
    replace_file(folder_ / "link", "new");
    EXPECT_EQ(read_text(target), "new");
    EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
    EXPECT_EQ(fs::status(target).permissions(), fs::perms{0640});
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 2);
}

TEST_F(ReplaceFile, AppendsToOne) {
    append_text(folder_ / "log", "one\n");
    append_text(folder_ / "log", "two\n");
    EXPECT_EQ(read_text(folder_ / "log"), "one\ntwo\n");
    EXPECT_THROW(append_text(folder_, "x"), Failure);
}

/// A plot replaces an earlier one as a whole, and goes to devices, too.
TEST_F(ReplaceFile, WritesPlotsAndToDevices) {
    write_text(folder_ / "plot.svg", "old");
    fs::create_hard_link(folder_ / "plot.svg", folder_ / "kept.svg");
    write_text(folder_ / "plot.svg", "new");
    EXPECT_EQ(read_text(folder_ / "plot.svg"), "new");
    EXPECT_EQ(read_text(folder_ / "kept.svg"), "old") << "another file";
    EXPECT_NO_THROW(write_text("/dev/null", "x"));
    EXPECT_THROW(write_text("/dev/full", "x"), Failure);
    EXPECT_THROW(write_text(folder_, "x"), Failure);
}

TEST_F(ReplaceFile, DoesNotWaitForAFifo) {
    const fs::path fifo = folder_ / "fifo";
    ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
    EXPECT_THROW(append_text(fifo, "x"), Failure);
    EXPECT_THROW(read_text(fifo), Failure);
    EXPECT_THROW(replace_file(fifo, "x"), Failure);
    EXPECT_FALSE(open_to_read(fifo).is_open());
}

/// What a killed writer leaves has a name that 'vkrun train --resume' sweeps: report.html.*-*.tmp
TEST_F(ReplaceFile, LeavesANameThatIsSwept) {
    const pid_t child = fork();
    if (child == 0) {
        const rlimit none{0, 0};  // SIGXFSZ at the first byte
        setrlimit(RLIMIT_FSIZE, &none);
        replace_file(folder_ / "report.html", "text");
        _exit(0);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFSIGNALED(status));
    ASSERT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
    const std::string name = fs::directory_iterator(folder_)->path().filename();
    EXPECT_EQ(fnmatch("report.html.*-*.tmp", name.c_str(), 0), 0) << name;
}

std::size_t temporary_folders(const fs::path& place) {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(place), fs::directory_iterator()));
}

/// A signal removes the folder; what SIGKILL leaves, the next process removes.
TEST(TemporaryFolders, DoNotStay) {
    const fs::path place = fs::temp_directory_path() / ("splat-place-" + std::to_string(getpid()));
    fs::create_directories(place);
    fs::create_directories(place / "vkrun-20260101-mine");  // somebody's
    ASSERT_EQ(setenv("TMPDIR", place.c_str(), 1), 0);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGKILL}) {
        const pid_t child = fork();
        if (child == 0) {
            const TemporaryFolder folder;
            std::ofstream(folder.file("file")) << "x";
            raise(signal);
            _exit(0);
        }
        int status = 0;
        ASSERT_EQ(waitpid(child, &status, 0), child);
        EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal);
        EXPECT_EQ(temporary_folders(place), signal == SIGKILL ? 2U : 1U);
    }
    {
        const TemporaryFolder folder;
        EXPECT_EQ(temporary_folders(place), 2U) << "the killed one's is gone";
    }
    EXPECT_EQ(temporary_folders(place), 1U) << "what is not ours stays";
    fs::remove_all(place);
    ASSERT_EQ(setenv("TMPDIR", "", 1), 0);
    EXPECT_EQ(fs::path(TemporaryFolder().path()).parent_path(), "/tmp");
    unsetenv("TMPDIR");
}

}  // namespace
}  // namespace vkrun
