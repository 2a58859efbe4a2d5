#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>

#include "core/os/file.h"
#include "core/os/memory.h"
#include "core/os/path.h"
#include "core/os/process.h"

namespace splat::os {
namespace {

/// A folder of this test alone, with a name beyond ASCII; removed in the end.
class OsFile : public testing::Test {
  protected:
    OsFile()
        : folder_(std::filesystem::temp_directory_path() /
                  ("splat-os-" + std::to_string(process_id()))) {
        std::filesystem::create_directories(folder_ / u8"größe");
    }
    ~OsFile() override { std::filesystem::remove_all(folder_); }

    [[nodiscard]] std::string path(const char8_t* name) const {
        const std::u8string text = (folder_ / u8"größe" / name).u8string();
        return {text.begin(), text.end()};
    }
    static void make(const std::string& path, const std::string& text) {
        const Handle file = open(path, Open::kCreate);
        ASSERT_NE(file, kNoHandle);
        EXPECT_EQ(write(file, text.data(), text.size(), {}), std::ssize(text));
        EXPECT_EQ(flush(file), 0);
        EXPECT_EQ(close(file), 0);
    }
    static std::string text_of(const std::string& path) {
        const Handle file = open(path, Open::kRead);
        std::string text(100, '\0');
        text.resize(static_cast<std::size_t>(
            std::max<std::int64_t>(read(file, text.data(), text.size(), 0), 0)));
        close(file);
        return text;
    }

  private:
    std::filesystem::path folder_;
};

TEST_F(OsFile, IsWrittenReadAndReplaced) {
    const std::string old = path(u8"日本.bin"), other = path(u8"new.bin");
    make(old, "a\r\nb\n\x1a");  // written as bytes: no translation of lines, no end at Control-Z
    EXPECT_EQ(text_of(old), "a\r\nb\n\x1a");
    EXPECT_EQ(open(old, Open::kCreate), kNoHandle);
    EXPECT_EQ(errno, EEXIST);
    make(other, "other");
    EXPECT_EQ(rename(other, old), 0);
    EXPECT_EQ(text_of(old), "other");
    EXPECT_EQ(open(other, Open::kRead), kNoHandle);
    EXPECT_EQ(errno, ENOENT);
    EXPECT_EQ(remove(old), 0);
    FileInfo info;
    EXPECT_EQ(examine(old, info), -1);
    EXPECT_EQ(errno, ENOENT);
}

TEST_F(OsFile, IsAppendedToResizedAndWrittenAtAnOffset) {
    const std::string name = path(u8"log");
    for (const char* const text : {"one", "two"}) {
        const Handle file = open(name, Open::kAppend);
        EXPECT_EQ(write(file, text, 3, {}), 3);
        close(file);
    }
    EXPECT_EQ(text_of(name), "onetwo");
    const Handle file = open(name, Open::kUpdate);
    EXPECT_EQ(write(file, "X", 1, 2), 1);
    EXPECT_EQ(resize(file, 4), 0);
    EXPECT_EQ(reserve(file, 4), 0);
    FileInfo info, by_path;
    EXPECT_EQ(examine(file, info), 0);
    EXPECT_EQ(examine(name, by_path), 0);
    EXPECT_EQ(info.kind, FileKind::kFile);
    EXPECT_EQ(info.bytes, 4U);
    EXPECT_EQ(info.changed_ns, by_path.changed_ns);
    EXPECT_GT(info.changed_ns, 1'700'000'000'000'000'000);
    EXPECT_EQ(info.links, 1U);
    void* const at = map(file, 4);
    ASSERT_NE(at, nullptr);
    EXPECT_EQ(populate_mapped(at, 4), 0);
    EXPECT_EQ(std::string(static_cast<const char*>(at), 4), "onXt");
    unmap(at, 4);
    close(file);
}

TEST_F(OsFile, IsLockedAgainstOtherHandles) {
    const std::string name = path(u8"lock");
    const Handle first = open(name, Open::kUpdate), second = open(name, Open::kUpdate);
    EXPECT_EQ(lock(first, Lock::kExclusive, false), 0);
    EXPECT_EQ(lock(second, Lock::kShared, false), -1);
    EXPECT_EQ(errno, EWOULDBLOCK);
    EXPECT_EQ(write(first, "12", 2, {}), 2);  // what another one reads tells who has it
    EXPECT_EQ(text_of(name), "12");
    unlock(first);
    EXPECT_EQ(lock(second, Lock::kShared, false), 0);
    EXPECT_EQ(lock(first, Lock::kShared, false), 0);
    close(second);
    unlock(first);
    EXPECT_EQ(lock(first, Lock::kExclusive, true), 0);
    close(first);
}

TEST_F(OsFile, IsListedWithItsKind) {
    make(path(u8"ä"), "");
    std::vector<Listed> all;
    ASSERT_EQ(list(folder_of(path(u8"ä")), all), 0);
    std::erase_if(all, [](const Listed& entry) { return entry.name[0] == '.'; });
    ASSERT_EQ(all.size(), 1U);
    EXPECT_EQ(all[0].name, "\xC3\xA4");
    EXPECT_EQ(all[0].kind.value_or(FileKind::kFile), FileKind::kFile);
    EXPECT_EQ(list(path(u8"missing"), all), -1);
    EXPECT_EQ(errno, ENOENT);
    FileInfo info;
    ASSERT_EQ(examine(folder_of(path(u8"ä")), info), 0);
    EXPECT_EQ(info.kind, FileKind::kFolder);
}

TEST(OsPath, NamesAndFolders) {
    EXPECT_EQ(name_start("a/b.ply"), 2U);
    EXPECT_EQ(name_start("b.ply"), 0U);
    EXPECT_EQ(folder_of("a/b/c"), "a/b");
    EXPECT_EQ(folder_of("/c"), "/");
    EXPECT_EQ(folder_of("c"), ".");
    EXPECT_FALSE(is_absolute("a/b"));
#if defined(_WIN32)
    EXPECT_EQ(folder_of(R"(C:\a)"), R"(C:\)");
    EXPECT_EQ(name_start("C:a"), 2U);
    EXPECT_TRUE(is_absolute(R"(C:\a)"));
    EXPECT_FALSE(is_absolute("C:a"));
#else
    EXPECT_TRUE(is_absolute("/a"));
#endif
}

TEST(OsPath, TemporaryNamesDifferAndFit) {
    const std::string first = temporary_name("a/b"), second = temporary_name("a/b");
    EXPECT_NE(first, second);
    EXPECT_TRUE(first.starts_with("a/b." + std::to_string(process_id()) + "-")) << first;
    EXPECT_TRUE(first.ends_with(".tmp")) << first;
    EXPECT_EQ(temporary_name("a/" + std::string(kLongestName, 'b')).size(), 2 + kLongestName);
}

TEST(OsProcess, ThisOneRuns) {
    EXPECT_TRUE(may_run(process_id()));
    EXPECT_FALSE(may_run(0x7FFFFFF0));
    EXPECT_GT(machine_bytes(), std::uint64_t{1} << 28);
}

}  // namespace
}  // namespace splat::os
