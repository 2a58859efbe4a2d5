#include <gtest/gtest.h>
#include <lzma.h>
#include <zlib.h>

#include <cstdio>
#include <cstring>
#include <fstream>

#include "support/expect_status.h"
#include "support/npz.h"
#include "support/npz_writer.h"

namespace splat::test {
namespace {

std::vector<std::byte> bytes_of(const std::string& text) {
    const auto* data = reinterpret_cast<const std::byte*>(text.data());
    return {data, data + text.size()};
}

std::string little(std::uint64_t value, std::size_t bytes) {
    std::string text;
    for (; text.size() < bytes; value >>= 8) text += static_cast<char>(value & 0xFF);
    return text;
}

template <class T>
std::string raw(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::string npy(const std::string& descr, const std::string& shape, const std::string& data,
                const std::string& order = "False") {
    const std::string header =
        "{'descr': '" + descr + "', 'fortran_order': " + order + ", 'shape': (" + shape + "), }\n";
    return std::string("\x93NUMPY\x01\x00", 8) + little(header.size(), 2) + header + data;
}

std::string deflate_raw(const std::string& text) {
    z_stream stream{};
    deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
    std::string out(text.size() + 100, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
    stream.avail_in = static_cast<uInt>(text.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    deflate(&stream, Z_FINISH);
    out.resize(stream.total_out);
    deflateEnd(&stream);
    return out;
}

struct Member {
    std::string name;
    std::string data;
    bool deflated;
};

std::string zip(const std::vector<Member>& members) {
    std::string file;
    std::string directory;
    for (const Member& member : members) {
        const std::string packed = member.deflated ? deflate_raw(member.data) : member.data;
        const auto crc =
            crc32_z(0, reinterpret_cast<const Bytef*>(member.data.data()), member.data.size());
        const std::string common =
            little(20, 2) + little(0, 2) + little(member.deflated ? 8 : 0, 2) + little(0, 4) +
            little(crc, 4) + little(packed.size(), 4) + little(member.data.size(), 4) +
            little(member.name.size(), 2) + little(0, 2);
        directory += "PK\x01\x02" + little(20, 2) + common + little(0, 10) +
                     little(file.size(), 4) + member.name;
        file += "PK\x03\x04" + common + member.name + packed;
    }
    const std::size_t at = file.size();
    return file + directory + "PK\x05\x06" + little(0, 4) + little(members.size(), 2) +
           little(members.size(), 2) + little(directory.size(), 4) + little(at, 4) + little(0, 2);
}

std::string sample() {
    return zip({{"a.npy", npy("<f4", "2, 3", raw<float>({1, 2, 3, 4, 5, 6.5F})), true},
                {"b.npy", npy("<f8", "2,", raw<double>({0.1, -1e300})), false},
                {"c.npy", npy("<i4", "", raw<std::int32_t>({-7})), true},
                {"d.npy", npy("|u1", "3,", std::string("\x01\x02\xFF", 3)), true},
                {"e.npy", npy("<i8", "0, 4", ""), true}});
}

Result<Npz> parse(const std::string& file) {
    return Npz::parse(bytes_of(file), "test.npz");
}

TEST(Npz, ReadsStoredAndDeflatedMembers) {
    const auto npz = need(parse(sample()));
    EXPECT_EQ(npz.names(), (std::vector<std::string>{"a", "b", "c", "d", "e"}));
    const NpyArray& a = *npz.find("a").value();
    EXPECT_EQ(a.shape, (std::vector<std::size_t>{2, 3}));
    EXPECT_EQ(a.f32().value(), (std::vector<float>{1, 2, 3, 4, 5, 6.5F}));
    EXPECT_EQ(a.f64().value()[5], 6.5);
    EXPECT_EQ(npz.find("b").value()->f64().value(), (std::vector<double>{0.1, -1e300}));
    EXPECT_EQ(npz.find("c").value()->ints().value(), (std::vector<std::int64_t>{-7}));
    EXPECT_EQ(npz.find("d").value()->ints().value(), (std::vector<std::int64_t>{1, 2, 255}));
    EXPECT_EQ(npz.find("e").value()->elements(), 0U);
}

TEST(Npz, ReadsWhatIsWritten) {
    const std::string path = testing::TempDir() + "npz_test.npz";
    const Status written = write_npz(path, {{"a", npy_f32({2, 1}, {1.5, -0.1})},
                                            {"b.c", npy_f64({2}, {0.1, -1e300})},
                                            {"d", npy_i32({-7, 8})},
                                            {"e", npy_text("ab")},
                                            {"f", npy_f32({0, 3}, {})}});
    ASSERT_TRUE(written.ok()) << written.message();
    const auto npz = need(Npz::read(path));
    std::remove(path.c_str());
    const auto at = [&](const char* name) { return *npz.find(name).value(); };
    EXPECT_EQ(npz.names(), (std::vector<std::string>{"a", "b.c", "d", "e", "f"}));
    EXPECT_EQ(at("a").shape, (std::vector<std::size_t>{2, 1}));
    EXPECT_EQ(at("a").f32().value(), (std::vector<float>{1.5F, -0.1F}));
    EXPECT_EQ(at("b.c").f64().value(), (std::vector<double>{0.1, -1e300}));
    EXPECT_EQ(at("d").ints().value(), (std::vector<std::int64_t>{-7, 8}));
    EXPECT_EQ(at("e").ints().value(), (std::vector<std::int64_t>{'a', 'b'}));
    EXPECT_EQ(at("f").shape, (std::vector<std::size_t>{0, 3}));
    EXPECT_FALSE(write_npz("/nonexistent/x.npz", {}).ok());
}

TEST(Npz, ReadsFilesCompressedAsAWhole) {
    const std::string path = testing::TempDir() + "npz_test.npz.xz";
    const std::string plain = sample();
    std::string packed(lzma_stream_buffer_bound(plain.size()), '\0');
    std::size_t size = 0;
    ASSERT_EQ(lzma_easy_buffer_encode(6, LZMA_CHECK_CRC64, nullptr,
                                      reinterpret_cast<const std::uint8_t*>(plain.data()),
                                      plain.size(), reinterpret_cast<std::uint8_t*>(packed.data()),
                                      &size, packed.size()),
              LZMA_OK);
    const auto read = [&](std::size_t length) {
        std::ofstream(path, std::ios::binary) << packed.substr(0, length);
        return Npz::read(path);
    };
    EXPECT_EQ(need(read(size)).names(), (std::vector<std::string>{"a", "b", "c", "d", "e"}));
    for (std::size_t length = 6; length < size; ++length)
        EXPECT_HAS(read(length).status().message(), "xz data is damaged")
            << length << " of " << size;
    std::remove(path.c_str());
}

TEST(Npz, NamesWhatIsThere) {
    const auto npz = parse(sample());
    const auto missing = npz.value().find("z");
    ASSERT_FALSE(missing.ok());
    EXPECT_HAS(missing.status().message(), "a b c d e");
    EXPECT_FALSE(npz.value().find("b").value()->f32().ok());
    EXPECT_FALSE(npz.value().find("a").value()->ints().ok());
    EXPECT_FALSE(Npz::read("/nonexistent/x.npz").ok());
}

TEST(Npz, RefusesEveryTruncation) {
    const std::string whole = sample();
    for (std::size_t size = 0; size < whole.size(); ++size)
        EXPECT_FALSE(parse(whole.substr(0, size)).ok()) << size << " of " << whole.size();
}

TEST(Npz, RefusesFlippedDataBits) {
    const std::string whole = sample();
    std::size_t refused = 0;
    for (std::size_t bit = 0; bit < whole.size() * 8; ++bit) {
        std::string damaged = whole;
        damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ 1 << bit % 8);
        refused +=
            parse(damaged).ok() ? 0U : 1U;  // unread header fields may change; nothing may crash
    }
    EXPECT_GT(refused, whole.size() * 8 / 2);
    const std::size_t last_of_b = whole.find("PK\x03\x04", whole.find("b.npy")) - 1;
    std::string damaged = whole;
    damaged[last_of_b] = static_cast<char>(damaged[last_of_b] ^ 1);
    const auto result = parse(damaged);
    ASSERT_FALSE(result.ok());
    EXPECT_HAS(result.status().message(), "b.npy: its CRC");
}

TEST(Npz, ReadsText) {
    const std::vector<std::uint32_t> characters = {'a', 'b', 0, 'c', 0, 0};
    const auto npz =
        need(parse(zip({{"x.npy", npy("<U3", "2,", raw(characters)), true},
                        {"y.npy", npy("<U3", "", raw<std::uint32_t>({960, 0, 0})), true}})));
    EXPECT_EQ(need(npz.find("x").value()->strings()), (std::vector<std::string>{"ab", "c"}));
    EXPECT_FALSE(npz.find("x").value()->f64().ok());
    EXPECT_FALSE(npz.find("y").value()->strings().ok()) << "not ASCII";
}

TEST(Npz, RefusesForeignArrays) {
    const std::string f4 = raw<float>({1, 2});
    const std::string big = "4294967296, 4294967296, 4294967296";
    const std::string cases[] = {
        npy(">f4", "2,", f4),       npy("<c8", "1,", f4), npy("<f4", "2,", f4, "True"),
        npy("<f4", "3,", f4),       npy("<f4", big, f4),  npy("<f4", "-2,", f4),
        npy("<f4", "2,", f4 + "x"), npy("<U0", "0,", ""), npy("<U", "2,", f4),
        npy("<U1x", "2,", f4),      npy(">U1", "2,", f4), "not an array at all"};
    for (const std::string& member : cases)
        EXPECT_FALSE(parse(zip({{"x.npy", member, true}})).ok()) << member.substr(0, 60);
    const std::string good = npy("<f4", "2,", f4);
    EXPECT_TRUE(parse(zip({{"x.npy", good, true}})).ok());
    EXPECT_FALSE(parse(zip({{"x.npy", good, true}, {"x.npy", good, false}})).ok());
}

}  // namespace
}  // namespace splat::test
