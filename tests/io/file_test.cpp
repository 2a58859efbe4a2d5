#include "io/file.h"

#include <gtest/gtest.h>

#include <cerrno>
#include <filesystem>
#include <fstream>

#include "core/fault.h"
#include "core/os/path.h"
#include "io/folder.h"
#include "io/reader.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "support/expect_status.h"
#include "support/system.h"

namespace splat::io {
namespace {

namespace fs = std::filesystem;
using test::bytes_of;

class FileTest : public test::FolderTest {
  protected:
    [[nodiscard]] std::size_t files() const {
        return static_cast<std::size_t>(
            std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
    }
};

using File = FileTest;

TEST_F(File, WritesReplacesAndReads) {
    for (const char* text : {"first", "", "the third, longer"}) {
        ASSERT_OK(write_file(path("a"), bytes_of(text)));
        EXPECT_EQ(as_text(need(read_file(path("a")))), text);
    }
    EXPECT_EQ(files(), 1U);
}

TEST_F(File, NewFilesReplaceNone) {
    ASSERT_OK(write_new_file(path("new"), bytes_of("one")));
    EXPECT_ERROR(write_new_file(path("new"), bytes_of("two")), Code::kIo, "exists");
    EXPECT_EQ(as_text(need(read_file(path("new")))), "one");
    EXPECT_ERROR(write_new_file(path("none/a"), bytes_of("x")), Code::kNotFound, "No such file");
}

#if defined(_WIN32)
TEST_F(File, NamesOfDevicesAreRefused) {
    for (const char* name : {"NUL", "con.png", "a.", "a?.ply"}) {
        EXPECT_ERROR(write_file(path(name), bytes_of("x")), Code::kIo,
                     std::string(name) + "': Windows takes no such name");
        EXPECT_ERROR(make_folders(path(name)), Code::kIo, "Windows takes no such name");
    }
    EXPECT_EQ(files(), 0U);
}

TEST_F(File, WhatAnotherProgramHasOpenStays) {
    ASSERT_OK(write_file(path("a"), bytes_of("old")));
    {
        const std::ifstream other(
            path("a"));  // which the C library opens so that none may replace it
        EXPECT_ERROR(write_file(path("a"), bytes_of("new")), Code::kIo,
                     "this program or another has it open; close it there");
        EXPECT_EQ(files(), 1U) << "the temporary file is gone";
    }
    EXPECT_EQ(as_text(need(read_file(path("a")))), "old");
    EXPECT_OK(write_file(path("a"), bytes_of("new")));
}
#endif

TEST_F(File, FoldersAreMade) {
    EXPECT_OK(make_folders(path("a/b/c")));
    EXPECT_OK(make_folders(path("a/b/c/")));
    EXPECT_OK(make_folders(path("a")));
#if !defined(_WIN32)  // which takes a letter and a colon for a drive
    EXPECT_OK(make_folders(path("a/x/c:/")));
#endif
    ASSERT_OK(write_file(path("file"), bytes_of("x")));
    EXPECT_ERROR(make_folders(path("file")), Code::kNotFound, "Not a directory");
    EXPECT_ERROR(make_folders(path("file/a")), Code::kNotFound, "Not a directory");
    EXPECT_ERROR(make_folders(""), Code::kIo, "cannot create the folder ''");
    const auto write = [this](const fs::path& to) -> Status {
        SPLAT_TRY(make_folders(to / "below"));
        SPLAT_TRY(write_new_file((to / "below/a").string(), bytes_of("x")));
        return fs::exists(path("fails")) ? damaged("no") : Status();
    };
    EXPECT_OK(write_folder(path("new"), path(".new.tmp"), write));
    EXPECT_TRUE(fs::exists(path("new/below/a")));
    ASSERT_OK(write_file(path("fails"), bytes_of("x")));
    EXPECT_ERROR(write_folder(path("other"), path(".other.tmp"), write), Code::kFormat, "no");
    EXPECT_EQ(files(), 4U) << "the temporary folder is gone";
}

TEST_F(File, RefusesWhatItCannotRead) {
    EXPECT_ERROR(read_file(path("none")), Code::kNotFound, "No such file");
    EXPECT_ERROR(read_file(folder_.string()), Code::kIo, "not a regular file");
    ASSERT_OK(write_file(path("a"), bytes_of("12345")));
    EXPECT_OK(read_file(path("a"), 5));
    EXPECT_ERROR(read_file(path("a"), 4), Code::kUnsupported, "5 bytes, the limit is 4");
}

TEST_F(File, RefusesWhereItCannotWrite) {
    EXPECT_ERROR(write_file(path("none/a"), bytes_of("x")), Code::kNotFound, "No such file");
    fs::create_directories(folder_ / "folder");
    EXPECT_ERROR(write_file(path("folder"), bytes_of("x")), Code::kIo, "Is a directory");
    EXPECT_EQ(files(), 1U) << "the temporary file is gone";
}

TEST_F(File, DoesNotWaitForAFifo) {
    SPLAT_NEED_FIFO(path("fifo"));
    EXPECT_ERROR(read_file(path("fifo")), Code::kIo, "not a regular file");
    EXPECT_ERROR(open_source(path("fifo")), Code::kIo, "not a regular file");
    EXPECT_ERROR(write_file(path("fifo"), bytes_of("x")), Code::kIo, "not a regular file");
    EXPECT_TRUE(fs::is_fifo(path("fifo")));
    EXPECT_EQ(files(), 1U);
}

TEST_F(File, KeepsLinksAndPermissions) {
    SPLAT_NEED_LINKS(folder_.string());
    fs::create_directories(folder_ / "deep");
    ASSERT_OK(write_file(path("deep/target"), bytes_of("old")));
    fs::permissions(path("deep/target"), fs::perms{0640});
    fs::create_symlink("deep/target", path("relative"));
    fs::create_symlink(path("relative"), path("absolute"));
    fs::create_symlink("deep/later", path("dangling"));
    for (const char* name : {"absolute", "relative", "deep/target"}) {
        ASSERT_OK(write_file(path(name), bytes_of(name)));
        EXPECT_EQ(as_text(read_file(path("deep/target")).value()), name);
        EXPECT_EQ(fs::status(path("deep/target")).permissions(), fs::perms{0640}) << name;
    }
    ASSERT_OK(write_file(path("dangling"), bytes_of("new")));
    EXPECT_EQ(as_text(read_file(path("deep/later")).value()), "new");
    for (const char* name : {"absolute", "relative", "dangling"})
        EXPECT_TRUE(fs::is_symlink(path(name))) << name;
    fs::create_symlink("loop", path("loop"));
    EXPECT_FALSE(write_file(path("loop"), bytes_of("x")).ok());
}

TEST_F(File, TakesTheLongestNames) {
    const std::string name(255, 'n');
    for (const char* text : {"new", "replaced"}) {
        ASSERT_OK(write_file(path(name), bytes_of(text)));
        EXPECT_EQ(as_text(read_file(path(name)).value()), text);
    }
    EXPECT_EQ(files(), 1U);
    EXPECT_ERROR(write_file(path(name + "n"), bytes_of("x")), Code::kIo, "name too long");
}

TEST_F(File, PassesTemporariesOfAKilledProcessOfTheSameNumber) {
    constexpr int kLeft = 1000;
    const auto left = [this](int k) {
        return path("x." + test::process_text() + "-" + std::to_string(k) + ".tmp");
    };
    for (int k = 0; k < kLeft; ++k) std::ofstream(left(k)) << "part";
    ASSERT_OK(write_file(path("x"), bytes_of("whole")));
    EXPECT_EQ(as_text(read_file(path("x")).value()), "whole");
    EXPECT_EQ(files(), kLeft + 1U);
    for (const int k : {0, kLeft - 1}) EXPECT_EQ(as_text(read_file(left(k)).value()), "part");
}

TEST_F(File, IsReadPieceByPiece) {
    FilePieces pieces;
    pieces.add(bytes_of("own "));
    const std::string other = "other's";
    pieces.add_view(as_bytes(other));
    EXPECT_EQ(pieces.size(), 11U);
    EXPECT_EQ(as_text(pieces.joined()), "own other's");
    const FilePieces moved = std::move(pieces);
    ASSERT_OK(write_file(path("a"), moved.pieces()));
    const auto file = need(open_source(path("a")));
    const Buffer whole = bytes_of("own other's");
    const MemorySource memory(whole);
    for (const Source* source :
         {static_cast<const Source*>(file.get()), static_cast<const Source*>(&memory)}) {
        EXPECT_EQ(source->size(), 11U);
        Buffer part(5);
        ASSERT_OK(source->read(4, part));
        EXPECT_EQ(as_text(part), "other");
        EXPECT_OK(source->read(11, std::span<std::byte>()));
        EXPECT_ERROR(source->read(7, part), Code::kFormat, "5 bytes requested at byte 7 of 11");
        EXPECT_FALSE(source->read(~0ULL, part).ok());
    }
    std::filesystem::resize_file(path("a"), 3);
    Buffer part(5);
    EXPECT_ERROR(file->read(0, part), Code::kIo, "became shorter");
    EXPECT_FALSE(open_source(path("none")).ok());
    EXPECT_FALSE(open_source(folder_.string()).ok());
    EXPECT_ERROR(open_source(path("a"), 2), Code::kUnsupported, "the limit is 2");
}

TEST_F(File, IsMappedAsItWas) {
    EXPECT_EQ(MemorySource(bytes_of("x")).map(), nullptr);
    ASSERT_OK(write_file(path("empty"), bytes_of("")));
    EXPECT_EQ(open_source(path("empty"), 9, true).value()->map(), nullptr);

    ASSERT_OK(write_file(path("a"), bytes_of("first")));
    EXPECT_EQ(open_source(path("a")).value()->map(), nullptr);
    std::shared_ptr<const Source> source = need(open_source(path("a"), 9, true));
#if SPLAT_FAULT_POINTS
    fault::arm("io.map", 1);
    EXPECT_EQ(source->map(), nullptr);
    fault::disarm();
#endif
    const std::shared_ptr<const MappedFile> mapped = source->map();
    source.reset();
    ASSERT_NE(mapped, nullptr);
    EXPECT_EQ(as_text(mapped->bytes()), "first");
    const Status replaced = write_file(path("a"), bytes_of("other"));  // another file of that name
#if defined(_WIN32)
    if (replaced.message().find("this program or another has it open") != std::string::npos)
        GTEST_SKIP() << "this Windows replaces no mapped file: " << replaced.message();
#endif
    ASSERT_OK(replaced);
    EXPECT_OK(mapped->unchanged());
    EXPECT_EQ(as_text(mapped->bytes()), "first");

    const auto again = open_source(path("a"), 9, true).value()->map();
    std::ofstream(path("a"), std::ios::app) << "!";
    EXPECT_ERROR(again->unchanged(), Code::kIo,
                 "a' was written since it was opened; open it again");
    const auto later = open_source(path("a"), 9, true).value()->map();
    fs::last_write_time(path("a"), fs::last_write_time(path("a")) + std::chrono::seconds(1));
    EXPECT_ERROR(later->unchanged(), Code::kIo, "was written since");
    EXPECT_OK(mapped->unchanged());
    fs::remove(path("a"));
    EXPECT_EQ(as_text(mapped->bytes()), "first");
}

TEST_F(File, ErrorsOfTheSystemHaveCodes) {
    EXPECT_ERROR(system_error(ENOENT, "open", "a"), Code::kNotFound, "cannot open 'a': No such");
    const Status longer = read_file(std::string(1'000'000, 'a')).status();
    EXPECT_ERROR(longer, Code::kIo, "aaa...': File");
    EXPECT_ERROR(longer, Code::kIo, "name too long");
    EXPECT_LT(longer.message().size(), os::kLongestPath + 1000);
    EXPECT_ERROR(system_error(ENOTDIR, "open", "a/b"), Code::kNotFound, "Not a directory");
    EXPECT_ERROR(system_error(ENOSPC, "write", "a"), Code::kIo, "No space left");
    EXPECT_ERROR(system_error(EACCES, "open", "a"), Code::kIo, "denied");
}

TEST_F(File, AppendsWholePieces) {
    ASSERT_OK(append_file(path("log"), bytes_of("")));
    EXPECT_TRUE(fs::is_regular_file(path("log")));
    ASSERT_OK(append_file(path("log"), bytes_of("one\n")));
    ASSERT_OK(append_file(path("log"), bytes_of("two\n")));
    EXPECT_EQ(as_text(read_file(path("log")).value()), "one\ntwo\n");
    EXPECT_ERROR(append_file(path("none/a"), bytes_of("x")), Code::kNotFound, "No such file");
    EXPECT_ERROR(append_file(folder_.string(), bytes_of("x")), Code::kIo, "Is a directory");
    SPLAT_NEED_FIFO(path("fifo"));
    EXPECT_ERROR(append_file(path("fifo"), bytes_of("x")), Code::kIo, "not a regular file");
}

#if defined(_WIN32)
#define SPLAT_NEED_DISK_FAULTS() GTEST_SKIP() << "programs do not replace calls of this system"
#else
#define SPLAT_NEED_DISK_FAULTS() static_cast<void>(0)
#endif

/// Writes below a folder fail, see support/disk_faults.cpp.
class BadDisk {
  public:
    explicit BadDisk(const std::string& fault, const fs::path& folder) {
        test::set_variable("DISK_FAULTS", (fault + ":" + folder.string()));
    }
    BadDisk(const BadDisk&) = delete;
    BadDisk& operator=(const BadDisk&) = delete;
    ~BadDisk() { test::unset_variable("DISK_FAULTS"); }
};

TEST_F(File, GoesOnAfterPartsAndSignals) {
    SPLAT_NEED_DISK_FAULTS();
    std::string text;
    for (int i = 0; i < 1000; ++i) text += std::to_string(i) + " ";
    {
        const BadDisk disk("rough:0", folder_);
        ASSERT_OK(write_file(path("replaced"), bytes_of(text)));
        ASSERT_OK(write_new_file(path("new"), bytes_of(text)));
        ASSERT_OK(append_file(path("log"), bytes_of(text)));
    }
    for (const char* name : {"replaced", "new", "log"})
        EXPECT_EQ(as_text(read_file(path(name)).value()), text) << name;
}

TEST_F(File, AFullDiskTakesNoPart) {
    SPLAT_NEED_DISK_FAULTS();
    for (const char* name : {"a", "log"}) ASSERT_OK(write_file(path(name), bytes_of("old")));
    for (const char* fault : {"full:1", "error:1", "error:2"}) {
        const char* const reason = *fault == 'f' ? "No space left" : "Input/output error";
        const BadDisk disk(fault, folder_);
        EXPECT_ERROR(write_file(path("a"), bytes_of("the new one")), Code::kIo, reason) << fault;
    }
    {
        const BadDisk disk("full:1", folder_);
        EXPECT_ERROR(append_file(path("log"), bytes_of("a line")), Code::kIo, "No space left");
    }
    for (const char* name : {"a", "log"})
        EXPECT_EQ(as_text(read_file(path(name)).value()), "old") << name;
    EXPECT_EQ(files(), 2U);
}

TEST_F(File, IsWrittenPieceByPieceOrNotAtAll) {
    const auto put = [](const char* last, const Status& status) {
        return [=](ByteSink& to) -> Status {
            SPLAT_TRY(to.put(bytes_of("one ")));
            SPLAT_TRY(to.put(bytes_of(last)));
            return status;
        };
    };
    ASSERT_OK(write_file(path("a"), put("two", {})));
    EXPECT_ERROR(write_file(path("a"), put("three", invalid("no more"))), Code::kInvalidArgument,
                 "no more");
    EXPECT_EQ(as_text(need(read_file(path("a")))), "one two");
    EXPECT_EQ(files(), 1U);
}

#if SPLAT_FAULT_POINTS
TEST_F(File, AFailedWriteLeavesTheOldFileAlone) {
    ASSERT_OK(write_file(path("a"), bytes_of("old")));
    for (const char* point : {"io.create", "io.write", "io.fsync", "io.rename"}) {
        fault::arm(point, 1);
        const Status status = write_file(path("a"), bytes_of("new"));
        EXPECT_GT(fault::disarm(), 0U) << point;
        EXPECT_EQ(status.code(), Code::kIo) << point;
        EXPECT_HAS(status.message(), path("a"));
        EXPECT_EQ(as_text(need(read_file(path("a")))), "old") << point;
        EXPECT_EQ(files(), 1U) << point;
    }
}

TEST_F(File, AFailedReadIsAnError) {
    ASSERT_OK(write_file(path("a"), bytes_of("old")));
    fault::arm("io.open", 1);
    EXPECT_ERROR(read_file(path("a")), Code::kNotFound, path("a").c_str());
    fault::arm("io.read", 1);
    EXPECT_ERROR(read_file(path("a")), Code::kIo, path("a").c_str());
    fault::disarm();
}
#endif

TEST(Reader, ChecksEveryStep) {
    const Buffer bytes = bytes_of(std::string("\x01\x02\x03\x04name\0x", 10));
    Reader little(bytes, "test");
    std::uint32_t value = 0;
    ASSERT_OK(little.read(value, "value"));
    EXPECT_EQ(value, 0x04030201U);
    EXPECT_EQ(need(little.take_string("name")), "name");
    EXPECT_ERROR(little.take_string("other"), Code::kFormat, "'other' at byte 9");
    EXPECT_ERROR(little.read(value, "value"), Code::kFormat,
                 "'value' at byte 9 needs 4 x 1 bytes, but 1 are left");
    EXPECT_FALSE(little.need(~0ULL, ~0ULL, "much").ok());
    EXPECT_FALSE(little.take(~0ULL, "much").ok());
    EXPECT_OK(little.take(1, "last"));
    EXPECT_EQ(little.left(), 0U);
    Reader big(bytes, "test", std::endian::big);
    ASSERT_OK(big.read(value, "value"));
    EXPECT_EQ(value, 0x01020304U);
}

}  // namespace
}  // namespace splat::io
