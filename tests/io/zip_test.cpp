#include "io/zip.h"

#include <gtest/gtest.h>

#include "io/sample_scene.h"
#include "io/sample_weights.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

using namespace test;

/// The contents of all files, joined.
Result<std::string> read_all(Bytes file, const DecodeLimits& limits = decode_limits()) {
    const MemorySource source(file);
    SPLAT_ASSIGN(const Zip zip, Zip::open(source, "zip", limits));
    std::string all;
    Buffer bytes;
    for (const ZipEntry& entry : zip.entries()) {
        SPLAT_TRY(zip.read(entry, bytes));
        all += entry.name + "=" + std::string(as_text(bytes)) + ";";
    }
    return all;
}

void expect_zip_refused(const Buffer& file, const char* part, Code code = Code::kFormat) {
    EXPECT_ERROR(read_all(file), code, part);
}

std::vector<ZipPart> two() {
    return {{"a", "some text some text some text", true}, {"b", "stored"}};
}

TEST(Zip, ReadsStoredDeflatedAndZip64) {
    const std::string expected = "a=some text some text some text;b=stored;";
    EXPECT_EQ(read_all(sample_zip(two())).value(), expected);
    EXPECT_EQ(read_all(sample_zip(two(), {.comment = "PK\x05\x06 a comment"})).value(), expected);
    auto wide = two();
    for (ZipPart& part : wide) part.zip64 = true;
    EXPECT_EQ(need(read_all(sample_zip(wide, {.zip64 = true}))), expected);
    EXPECT_EQ(read_all(sample_zip({})).value(), "");
    auto told = two();
    told[1].flags = 0;
    told[1].local_bytes = 6;
    EXPECT_EQ(read_all(sample_zip(told)).value(), expected);
}

TEST(Zip, RefusesPrefixesAndSurvivesDamage) {
    const auto accepts = [](Bytes bytes) { return read_all(bytes).ok(); };
    auto wide = two();
    wide[0].zip64 = true;
    for (const Buffer& file : {sample_zip(two()), sample_zip(wide, {.zip64 = true})}) {
        ASSERT_TRUE(accepts(file));
        expect_sturdy(file, accepts);
    }
}

TEST(Zip, RefusesWhatIsDamaged) {
    auto parts = two();
    parts[1].crc ^= 1U;
    expect_zip_refused(sample_zip(parts), "'b' has the CRC");
    parts = two();
    parts[0].packed[3] = static_cast<char>(parts[0].packed[3] ^ 0x55);
    EXPECT_FALSE(read_all(sample_zip(parts)).ok());
    parts = two();
    parts[1].local_name = "c";
    expect_zip_refused(sample_zip(parts), "another name or method");
    parts = two();
    parts[1].method = 12;
    expect_zip_refused(sample_zip(parts), "method 12", Code::kUnsupported);
    parts = two();
    parts[1].flags |= 1U;
    expect_zip_refused(sample_zip(parts), "'b' is encrypted", Code::kUnsupported);
    parts = two();
    parts[1].name = parts[1].local_name = "a";
    expect_zip_refused(sample_zip(parts), "'a' appears twice");
    expect_zip_refused(bytes_of("PK\x03\x04 no archive"), "no end-of-directory record");
    expect_zip_refused({}, "no end-of-directory record");
}

TEST(Zip, RefusesSizesThatLie) {
    for (const std::uint64_t bytes :
         {std::uint64_t{0}, std::uint64_t{28}, std::uint64_t{30}, std::uint64_t{0xFFFF'FFFE}}) {
        auto parts = two();
        parts[0].bytes = bytes;
        EXPECT_FALSE(read_all(sample_zip(parts)).ok()) << bytes;
        parts[0].zip64 = true;
        parts[0].bytes = bytes << 28U;
        EXPECT_FALSE(read_all(sample_zip(parts)).ok()) << bytes;
    }
    auto parts = two();
    parts[1].bytes = 7;
    expect_zip_refused(sample_zip(parts), "'b': 7 bytes cannot come from 6");
    parts = two();
    parts[1].packed_bytes = parts[1].bytes = 1000;
    expect_zip_refused(sample_zip(parts), "'b' reaches into the directory");
    parts[1].zip64 = true;
    parts[1].packed_bytes = parts[1].bytes = ~0ULL - 60;
    expect_zip_refused(sample_zip(parts), "'b' reaches into the directory");
    parts = two();
    parts[1].flags = 0;
    parts[1].local_bytes = 5;
    expect_zip_refused(sample_zip(parts), "other sizes in its own header");
}

TEST(Zip, RefusesOverlapsAndWrongPlaces) {
    std::vector<ZipPart> parts = {{"a", "first"}, {"a", "second"}};
    parts[1].shift = -36;
    parts[1].name = "a";
    EXPECT_FALSE(read_all(sample_zip(parts)).ok());
    // A file inside the data of another.
    const Buffer inner = sample_zip({{"i", "x"}});
    ZipPart outer("o", std::string(as_text(inner)));
    ZipPart again("i", "x");
    again.shift = -static_cast<std::int64_t>(inner.size());
    expect_zip_refused(sample_zip({outer, again}), "overlap");
    parts = two();
    parts[0].shift = 1;
    expect_zip_refused(sample_zip(parts), "'a' is not where the directory says");
    for (const std::int64_t shift : {-1, 1, 1 << 30}) {
        expect_zip_refused(sample_zip(two(), {.shift = shift}), "directory is not where");
        expect_zip_refused(sample_zip(two(), {.shift = shift, .zip64 = true}),
                           "truncated or damaged");
    }
    for (const std::int64_t more : {-1, 1, 60000})
        EXPECT_FALSE(read_all(sample_zip(two(), {.more_entries = more})).ok()) << more;
    EXPECT_FALSE(read_all(sample_zip(two(), {.more_entries = INT64_MAX / 2, .zip64 = true})).ok());
}

TEST(Zip, HoldsNoMoreThanTheLimits) {
    const Buffer file = sample_zip({{"a", std::string(100000, 'x'), true}});
    ASSERT_LT(file.size(), 1000U);
    EXPECT_OK(read_all(file));
    DecodeLimits limits{10, 1000, 10};
    EXPECT_ERROR(read_all(file, limits), Code::kFormat, "too many for a file of");
    limits = {};
    limits.max_items = 1;
    EXPECT_ERROR(read_all(sample_zip(two()), limits), Code::kFormat, "2 entries, the limit is 1");
}

TEST(Zip, ReadsWhatItWrites) {
    const std::string body = "the body";
    std::vector<ZipMember> members;
    members.push_back({"first", bytes_of("head and "), as_bytes(body)});
    members.push_back({"second", {}, {}});
    members.push_back({"third", {}, as_bytes(body)});
    const auto read = need(read_all(need(write_zip(std::move(members))).joined()));
    EXPECT_EQ(read, "first=head and the body;second=;third=the body;");
    std::vector<ZipMember> many(65535);
    EXPECT_ERROR(write_zip(std::move(many)), Code::kUnsupported, "65535 files");
}

}  // namespace
}  // namespace splat::io
