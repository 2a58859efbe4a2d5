// Files of vkrun, linked in.
#include "vkrun/cli/files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "support/system.h"
#include "vkrun/cli/failure.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;

class ReplaceFile : public testing::Test {
  protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("splat-replace-" + splat::test::process_text());
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }
    [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
    fs::path folder_;
};

TEST_F(ReplaceFile, KeepsLinksPermissionsAndLongNames) {
    const fs::path target = folder_ / std::string(255, 'n');
    replace_file(target, "old");
    fs::permissions(target, fs::perms{0640});
    SPLAT_NEED_LINKS(folder_.string());
    fs::create_symlink(target.filename(), folder_ / "link");
    replace_file(folder_ / "link", "new");
    EXPECT_EQ(read_text(target.string()), "new");
    EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
    EXPECT_EQ(fs::status(target).permissions(), fs::perms{0640});
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 2);
}

TEST_F(ReplaceFile, AppendsToOne) {
    append_text(path("log"), "one\n");
    append_text(path("log"), "two\n");
    EXPECT_EQ(read_text(path("log")), "one\ntwo\n");
    EXPECT_THROW(append_text(folder_.string(), "x"), Failure);
}

/// A plot replaces an earlier one as a whole, and goes to devices, too.
TEST_F(ReplaceFile, WritesPlotsAndToDevices) {
    write_text(path("plot.svg"), "old");
    fs::create_hard_link(folder_ / "plot.svg", folder_ / "kept.svg");
    write_text(path("plot.svg"), "new");
    EXPECT_EQ(read_text(path("plot.svg")), "new");
    EXPECT_EQ(read_text(path("kept.svg")), "old") << "another file";
    EXPECT_THROW(write_text(folder_.string(), "x"), Failure);
    if (!fs::exists("/dev/full")) GTEST_SKIP() << "no device is always full here";
    EXPECT_NO_THROW(write_text("/dev/null", "x"));
    EXPECT_THROW(write_text("/dev/full", "x"), Failure);
}

TEST_F(ReplaceFile, DoesNotWaitForAFifo) {
    const std::string fifo = path("fifo");
    SPLAT_NEED_FIFO(fifo);
    EXPECT_THROW(append_text(fifo, "x"), Failure);
    EXPECT_THROW(read_text(fifo), Failure);
    EXPECT_THROW(replace_file(fifo, "x"), Failure);
    EXPECT_FALSE(open_to_read(fifo).is_open());
}

}  // namespace
}  // namespace vkrun
