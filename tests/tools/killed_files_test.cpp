// Files of vkrun whose process a signal ends, linked in.
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <regex>

#include "support/system.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/temporary_folder.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;

/// What a killed writer leaves has a name that 'vkrun train --resume' sweeps: report.html.*-*.tmp
TEST(KilledFiles, LeaveANameThatIsSwept) {
    const fs::path folder =
        fs::temp_directory_path() / ("splat-killed-" + splat::test::process_text());
    fs::create_directories(folder);
    EXPECT_LT(splat::test::in_child([&] {
                  const splat::test::FileLimit none(0);
                  std::signal(SIGXFSZ, SIG_DFL);  // at the first byte
                  replace_file(folder / "report.html", "text");
                  return 0;
              }),
              0);
    ASSERT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
    const std::string name = fs::directory_iterator(folder)->path().filename().string();
    EXPECT_TRUE(std::regex_match(name, std::regex("report\\.html\\..*-.*\\.tmp"))) << name;
    fs::remove_all(folder);
}

std::size_t temporary_folders(const fs::path& place) {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(place), fs::directory_iterator()));
}

/// A signal removes the folder; what SIGKILL leaves, the next process removes.
TEST(TemporaryFolders, DoNotStay) {
    const fs::path place =
        fs::temp_directory_path() / ("splat-place-" + splat::test::process_text());
    fs::create_directories(place);
    fs::create_directories(place / "vkrun-20260101-mine");  // somebody's
    splat::test::set_variable("TMPDIR", place.string());
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGKILL}) {
        EXPECT_EQ(splat::test::in_child([&] {
                      const TemporaryFolder folder;
                      std::ofstream(folder.file("file")) << "x";
                      return std::raise(signal);
                  }),
                  -signal);
        EXPECT_EQ(temporary_folders(place), signal == SIGKILL ? 2U : 1U);
    }
    {
        const TemporaryFolder folder;
        EXPECT_EQ(temporary_folders(place), 2U) << "the killed one's is gone";
    }
    EXPECT_EQ(temporary_folders(place), 1U) << "what is not ours stays";
    fs::remove_all(place);
    splat::test::set_variable("TMPDIR", "");
    EXPECT_EQ(fs::path(TemporaryFolder().path()).parent_path(), "/tmp");
    splat::test::unset_variable("TMPDIR");
}

}  // namespace
}  // namespace vkrun
