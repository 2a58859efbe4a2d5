#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>

#include "core/os/drivers.h"
#include "core/os/file.h"
#include "core/os/memory.h"
#include "core/os/path.h"
#include "core/os/process.h"
#if defined(_WIN32)
#include "core/os/windows.h"
#endif

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
    const Handle first = open(name, Open::kAppend), second = open(name, Open::kAppend);
    EXPECT_EQ(write(first, "1", 1, {}), 1);
    EXPECT_EQ(write(second, "2", 1, {}), 1);
    EXPECT_EQ(write(first, "3", 1, {}), 1);
    FileInfo appended;
    EXPECT_EQ(examine(first, appended), 0);
    EXPECT_EQ(appended.bytes, 9U);
    EXPECT_EQ(flush(first), 0);
    EXPECT_EQ(text_of(name), "onetwo123") << "behind what another handle wrote";
    EXPECT_EQ(resize(second, 7), 0);
    EXPECT_EQ(write(first, "4", 1, {}), 1);
    EXPECT_EQ(text_of(name), "onetwo14");
    EXPECT_EQ(resize(first, 6), 0);
    close(first);
    close(second);
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
    EXPECT_EQ(info.number, by_path.number);
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

TEST_F(OsFile, FoldersAreMadeAndRemoved) {
    const std::string folder = path(u8"new");
    EXPECT_EQ(make_folder(folder + "/below"), -1);
    EXPECT_EQ(errno, ENOENT);
    EXPECT_EQ(make_folder(folder), 0);
    EXPECT_EQ(make_folder(folder), -1);
    EXPECT_EQ(errno, EEXIST);
    EXPECT_EQ(make_folders(folder), 0);
    make(folder + "/file", "");
    EXPECT_EQ(make_folders(folder + "/file"), -1);
    EXPECT_EQ(errno, ENOTDIR);
    EXPECT_EQ(make_folders(folder + "/file/a"), -1);
    EXPECT_EQ(errno, ENOTDIR);
    EXPECT_EQ(make_folders(""), -1);
    EXPECT_EQ(errno, EINVAL);
    EXPECT_EQ(remove(folder), -1);
    EXPECT_EQ(errno, ENOTEMPTY);
    EXPECT_EQ(remove(folder + "/file"), 0);
    EXPECT_EQ(remove(folder), 0);
    EXPECT_EQ(remove(folder), -1);
    EXPECT_EQ(errno, ENOENT);
}

/// Paths of more than 260 letters, which older calls of Windows refuse.
TEST_F(OsFile, LongPathsAreTaken) {
    std::string folder = folder_of(path(u8"a"));
    for (int i = 0; i < 6; ++i) folder += "/" + std::string(60, static_cast<char>('a' + i));
    ASSERT_EQ(make_folders(folder), 0);
    EXPECT_EQ(make_folders(folder + "/"), 0);
    EXPECT_TRUE(is_own_folder(folder));
    EXPECT_FALSE(is_link(folder));
    make(folder + "/first", "text");
    make(folder + "/second", "old");
    EXPECT_EQ(rename(folder + "/first", folder + "/second"), 0);
    EXPECT_EQ(text_of(folder + "/second"), "text");
    std::vector<Listed> all;
    ASSERT_EQ(list(folder, all), 0);
    EXPECT_EQ(std::ranges::count(all, "second", &Listed::name), 1);
    EXPECT_EQ(remove(folder + "/second"), 0);
    for (int i = 0; i < 6; ++i, folder = folder_of(folder)) EXPECT_EQ(remove(folder), 0);
}

#if defined(_WIN32)
TEST_F(OsFile, PipesEnd) {
    HANDLE from = nullptr, to = nullptr;
    ASSERT_NE(::CreatePipe(&from, &to, nullptr, 0), 0);
    const auto reader = reinterpret_cast<Handle>(from), writer = reinterpret_cast<Handle>(to);
    EXPECT_EQ(write(writer, "1", 1, {}), 1);
    close(writer);
    char byte = 0;
    EXPECT_EQ(read(reader, &byte, 1, {}), 1);
    EXPECT_EQ(read(reader, &byte, 1, {}), 0);
    close(reader);
    ASSERT_NE(::CreatePipe(&from, &to, nullptr, 0), 0);
    close(reinterpret_cast<Handle>(from));
    EXPECT_EQ(write(reinterpret_cast<Handle>(to), "1", 1, {}), -1);
    EXPECT_EQ(errno, EPIPE);
    close(reinterpret_cast<Handle>(to));
}

TEST_F(OsFile, NamesOfDevicesAreRefused) {
    for (const char8_t* name :
         {u8"NUL", u8"con.png", u8"a.", u8"a ", u8"a?", u8"ab:c", u8"com1.x"}) {
        EXPECT_EQ(open(path(name), Open::kCreate), kNoHandle);
        EXPECT_EQ(errno, EINVAL);
        EXPECT_EQ(make_folder(path(name)), -1);
    }
    EXPECT_NE(reason(EINVAL).find("Windows takes no such name"), std::string::npos);
    make(path(u8"a"), "");
    EXPECT_EQ(rename(path(u8"a"), path(u8"aux")), -1);
    EXPECT_EQ(errno, EINVAL);
}

TEST_F(OsFile, WhatOthersHaveOpenStays) {
    make(path(u8"old"), "old");
    make(path(u8"new"), "new");
    const HANDLE other = ::CreateFileW(path_of(path(u8"old")).c_str(), GENERIC_READ,
                                       FILE_SHARE_READ, nullptr, OPEN_EXISTING, 0, nullptr);
    ASSERT_NE(other, INVALID_HANDLE_VALUE);
    EXPECT_EQ(rename(path(u8"new"), path(u8"old")), -1);
    EXPECT_EQ(errno, EBUSY);
    EXPECT_EQ(open(path(u8"old"), Open::kUpdate), kNoHandle);
    EXPECT_EQ(errno, EBUSY);
    EXPECT_EQ(text_of(path(u8"old")), "old");
    ::CloseHandle(other);
    EXPECT_EQ(rename(path(u8"new"), path(u8"old")), 0);
    EXPECT_EQ(text_of(path(u8"old")), "new");
}
#endif

TEST_F(OsFile, IsListedWithItsKind) {
    make(path(u8"ä"), "");
    std::vector<Listed> all;
    ASSERT_EQ(list(folder_of(path(u8"ä")), all), 0);
    std::erase_if(all, [](const Listed& entry) { return entry.name[0] == '.'; });
    ASSERT_EQ(all.size(), 1U);
    EXPECT_EQ(all[0].name, "\xC3\xA4");
    EXPECT_EQ(all[0].kind.value_or(FileKind::kFile), FileKind::kFile);
    for (const std::string& none : {path(u8"missing"), std::string()}) {
        EXPECT_EQ(list(none, all), -1);
        EXPECT_EQ(errno, ENOENT);
    }
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
    EXPECT_EQ(text_of(path_of("a//b/")), "a//b/");
#endif
}

TEST(OsPath, NamesThatWindowsReserves) {
    for (const char* name : {"CON", "nul", "PRN.txt", "aux.tar.gz", "Com1", "LPT9.x", "con .png",
                             "com\xC2\xB9", "NUL:x", "conin$"})
        EXPECT_TRUE(is_device_name(name) && is_reserved_name(name)) << name;
    for (const char* name : {"", "c", "com", "com0", "COM10", "console", "xnul", ".nul", "a.b"})
        EXPECT_FALSE(is_device_name(name) || is_reserved_name(name)) << name;
    for (const char* name :
         {"a<", "a>", "a:b", "\"", "a/b", "a\\b", "a|b", "a?", "*", "a.", "a ", "a\x01"})
        EXPECT_TRUE(is_reserved_name(name) && !is_device_name(name)) << name;
#if defined(_WIN32)
    EXPECT_TRUE(may_create(R"(C:\a\..\b.png)") && may_create("./a") && may_create(R"(\\?\C:\a)"));
    EXPECT_FALSE(may_create("con/a") || may_create("a:b:c") || may_create("a /b"));
#else
    EXPECT_TRUE(may_create("con.png"));
    EXPECT_EQ(one_name("A"), "A");
#endif
}

TEST(OsDrivers, EachSystemIsToldItsOwn) {
    const std::string windows = no_loader(System::kWindows), mac = no_loader(System::kMac);
    for (const char* part : {"vulkan-1.dll", "NVIDIA, AMD, Intel", "lavapipe", "VK_DRIVER_FILES",
                             R"(SOFTWARE\Khronos\Vulkan\Drivers)"})
        EXPECT_NE(windows.find(part), std::string::npos) << part;
    for (const char* part : {"libvulkan.1.dylib", "Vulkan SDK", "brew install molten-vk"})
        EXPECT_NE(mac.find(part), std::string::npos) << part;
    for (const std::string& other : {windows, mac})
        EXPECT_EQ(other.find("apt-get"), std::string::npos);
    EXPECT_NE(name_cache(System::kWindows), name_cache(System::kLinux));
    EXPECT_NE(no_loader(System::kLinux).find("libvulkan.so.1"), std::string::npos);
    EXPECT_NE(install_driver(System::kLinux).find("mesa-vulkan-drivers"), std::string::npos);
}

TEST(OsPath, TemporaryNamesDifferAndFit) {
    const std::string first = temporary_name("a/b"), second = temporary_name("a/b");
    EXPECT_NE(first, second);
    EXPECT_TRUE(first.starts_with("a/b." + std::to_string(process_id()) + "-")) << first;
    EXPECT_TRUE(first.ends_with(".tmp")) << first;
    EXPECT_EQ(temporary_name("a/" + std::string(kLongestName, 'b')).size(), 2 + kLongestName);
}

TEST(OsPath, ListsAreCutAtTheirSeparator) {
    const std::string separator(1, kListSeparator);
    EXPECT_EQ(listed_paths("a" + separator + separator + "b c" + separator),
              (std::vector<std::string>{"a", "b c"}));
    EXPECT_EQ(listed_paths(""), std::vector<std::string>());
}

TEST(OsPath, TextsOfPathsAreWhatWasGiven) {
    for (const char* const text : {"größe/日本", "./a", "a/"})
        EXPECT_EQ(text_of(path_of(text)), text);
}

TEST(OsProcess, ThisOneRuns) {
    EXPECT_TRUE(may_run(process_id()));
    EXPECT_FALSE(may_run(0x7FFFFFF0));
    EXPECT_GT(machine_bytes(), std::uint64_t{1} << 28);
    EXPECT_GT(machine_bytes_left(), std::uint64_t{1} << 20);
    EXPECT_LT(machine_bytes_left(), machine_bytes());
    FileInfo own;
    EXPECT_EQ(examine(program_file(), own), 0);
    EXPECT_GT(own.bytes, 0U);
}

}  // namespace
}  // namespace splat::os
