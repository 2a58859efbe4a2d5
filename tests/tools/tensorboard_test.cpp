// Event files for TensorBoard, read by their format: records, checksums, fields.
#include "vkrun/train/tensorboard.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <optional>

#include "support/system.h"
#include "vkrun/cli/files.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;

/// CRC-32C by division, bit by bit.
std::uint32_t crc_by_bits(const std::string& bytes) {
    std::uint32_t rest = ~0U;
    for (const char c : bytes) {
        rest ^= static_cast<std::uint8_t>(c);
        for (int bit = 0; bit < 8; ++bit) rest = (rest >> 1U) ^ ((rest & 1U) * 0x82F63B78U);
    }
    return ~rest;
}

template <class T>
T number_at(const std::string& bytes, std::size_t at) {
    T value;
    std::memcpy(&value, bytes.substr(at, sizeof value).data(), sizeof value);
    return value;
}

/// The checksum at a place is that of the bytes, rotated by 15 bits and with a constant added.
bool has_checksum(const std::string& file, std::size_t at, const std::string& bytes) {
    const std::uint32_t rotated = number_at<std::uint32_t>(file, at) - 0xA282EAD8U;
    return ((rotated << 15U) | (rotated >> 17U)) == crc_by_bits(bytes);
}

/// The payloads of a file; nothing if it is damaged.
std::optional<std::vector<std::string>> events_of(const std::string& file) {
    std::vector<std::string> events;
    for (std::size_t at = 0; at < file.size();) {
        if (file.size() - at < 16) return std::nullopt;
        const auto length = number_at<std::uint64_t>(file, at);
        if (!has_checksum(file, at + 8, file.substr(at, 8)) || file.size() - at - 16 < length)
            return std::nullopt;
        events.push_back(file.substr(at + 12, length));
        if (!has_checksum(file, at + 12 + length, events.back())) return std::nullopt;
        at += 16 + length;
    }
    return events;
}

class TensorBoardFile : public testing::Test {
  protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("splat-events-" + splat::test::process_text());
    }
    void TearDown() override { fs::remove_all(folder_); }
    [[nodiscard]] std::string file() const {
        return read_text(fs::directory_iterator(folder_)->path().string());
    }
    fs::path folder_;
};

TEST_F(TensorBoardFile, HoldsEventsWithChecksums) {
    EXPECT_EQ(crc_by_bits("123456789"), 0xE3069283U) << "the check value of CRC-32C";
    TensorBoard board(folder_.string());
    board.scalars(300, {{"loss", 0.5}, {"rate", 2}});
    auto events = events_of(file());
    ASSERT_TRUE(events.has_value());
    ASSERT_EQ(events->size(), 3U);
    EXPECT_NE((*events)[0].find("brain.Event:2"), std::string::npos);
    // Field 7, a SessionLog, with the status START = 1, at the same step.
    EXPECT_EQ((*events)[1].substr(9), "\x10\xAC\x02\x3A\x02\x08\x01");
    events->erase(events->begin() + 1);
    // Field 2, the step, as a varint: 300 = 0xAC 0x02. A value: its tag, field 1, and field 2, a float.
    EXPECT_EQ((*events)[1].substr(9, 3), "\x10\xAC\x02");
    const std::string half("\x0A\x04loss\x15\x00\x00\x00\x3F", 11);
    const std::string two("\x0A\x04rate\x15\x00\x00\x00\x40", 11);
    EXPECT_EQ((*events)[1].substr(12), "\x2A\x1A\x0A\x0B" + half + "\x0A\x0B" + two);
}

/// What does not fit on the disk is left out, and the file stays whole.
TEST_F(TensorBoardFile, LeavesOutWhatCannotBeWritten) {
    SPLAT_NEED_FILE_LIMIT();
    TensorBoard board(folder_.string());
    board.scalars(1, {{"loss", 1}});
    const std::string before = file();
    testing::internal::CaptureStderr();
    {
        const splat::test::FileLimit full(before.size() + 5);
        for (const std::uint64_t step : {2U, 3U}) board.scalars(step, {{"loss", 1}});
    }
    const std::string warnings = testing::internal::GetCapturedStderr();
    EXPECT_EQ(file(), before);
    EXPECT_EQ(warnings.find("warning: events for TensorBoard are missing"),
              warnings.rfind("warning:"))
        << warnings;
    board.scalars(4, {{"loss", 1}});
    EXPECT_EQ(events_of(file()).value().size(), 4U);
}

}  // namespace
}  // namespace vkrun
