#include "io/weights_formats.h"

#include <gtest/gtest.h>

#include <cstring>

#include "io/sample_scene.h"
#include "io/sample_weights.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

Result<WeightsFile> read(Bytes file, const DecodeLimits& limits = decode_limits()) {
    return read_safetensors(MemorySource(file), limits);
}

TEST(Safetensors, RoundTrip) {
    const NamedTensors tensors = test::sample_tensors();
    const Metadata metadata = {{"iteration", "12"}, {"a \"text\"", "line\nline \xC3\xA9"}};
    for (const bool half : {false, true}) {
        const auto file = need(write_safetensors(tensors, metadata, half));
        const Buffer bytes = file.joined();
        EXPECT_TRUE(is_safetensors(bytes));
        EXPECT_EQ((bytes.size() - tensors.elements() * (half ? 2 : 4)) % 8, 0U);
        const auto again = need(read(bytes));
        EXPECT_EQ(again.metadata, metadata);
        ASSERT_EQ(again.tensors.size(), tensors.size());
        for (const NamedTensor& tensor : tensors) {
            const NamedTensor* other = again.tensors.find(tensor.name);
            ASSERT_NE(other, nullptr) << tensor.name;
            EXPECT_EQ(other->dims, tensor.dims);
            EXPECT_EQ(other->values, tensor.values);
            EXPECT_EQ(other->type, half ? NumberType::kF16 : NumberType::kF32);
        }
    }
}

/// Fails to read beyond some byte, as a damaged disk does.
class BadSource : public MemorySource {
  public:
    BadSource(Bytes bytes, std::uint64_t bad) : MemorySource(bytes), bad_(bad) {}
    Status read(std::uint64_t offset, std::span<std::byte> to) const override {
        if (offset + to.size() <= bad_) return MemorySource::read(offset, to);
        return error(Code::kFormat, "bad from byte %llu on, asked for %llu",
                     static_cast<unsigned long long>(bad_),
                     static_cast<unsigned long long>(offset));
    }

  private:
    std::uint64_t bad_;
};

/// Several threads read it.
TEST(Safetensors, LargeFilesComeWhole) {
    NamedTensors tensors;
    for (int i = 0; i < 40; ++i) {
        NamedTensor tensor{"t" + std::to_string(i), {1000 + i, 30}, NumberType::kF32, {}};
        for (int at = 0; at < 30 * (1000 + i); ++at)
            tensor.values.own().push_back(static_cast<float>(at % 1000 + i));
        ASSERT_OK(tensors.add(std::move(tensor)));
    }
    for (const bool half : {false, true}) {
        const Buffer bytes = write_safetensors(tensors, {}, half).value().joined();
        const auto again = need(read(bytes));
        ASSERT_EQ(again.tensors.size(), tensors.size());
        for (std::size_t i = 0; i < tensors.size(); ++i) {
            EXPECT_EQ(again.tensors[i].name, tensors[i].name);
            EXPECT_EQ(again.tensors[i].values, tensors[i].values);
        }
        const std::uint64_t first = bytes.size() - tensors.elements() * (half ? 2 : 4);
        const BadSource disk(bytes, first + 1);
        EXPECT_ERROR(read_safetensors(disk), Code::kFormat,
                     format("asked for %llu", static_cast<unsigned long long>(first)));
    }
}

/// Bytes as a mapped file.
class MappedSource : public MemorySource {
  public:
    explicit MappedSource(Bytes bytes)
        : MemorySource(bytes), file_(std::make_shared<File>(bytes)) {}
    [[nodiscard]] std::shared_ptr<const MappedFile> map(bool) const override { return file_; }

  private:
    class File : public MappedFile {
      public:
        explicit File(Bytes bytes) : bytes_(bytes) {}
        [[nodiscard]] Bytes bytes() const override { return bytes_; }
        [[nodiscard]] Status unchanged() const override { return {}; }

      private:
        Bytes bytes_;
    };
    std::shared_ptr<const File> file_;
};

TEST(Safetensors, LargeFilesAreUsedInPlace) {
    LargeVector<float> many(600000);
    for (std::size_t i = 0; i < many.size(); ++i) many[i] = static_cast<float>(i % 2000);
    NamedTensors tensors;
    ASSERT_OK(tensors.add({"one", {}, NumberType::kF32, {7}}));
    ASSERT_OK(tensors.add({"none", {0, 3}, NumberType::kF32, {}}));
    ASSERT_OK(tensors.add({"many", {600, 1000}, NumberType::kF32, many}));
    for (const bool half : {false, true})
        for (const std::size_t blanks : {0U, 1U, 2U, 4U}) {  // behind the header
            Buffer bytes = write_safetensors(tensors, {}, half).value().joined();
            const std::uint64_t header = number<std::uint64_t>(bytes.data()) + blanks;
            bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(8 + header - blanks), blanks,
                         std::byte{' '});
            std::memcpy(bytes.data(), &header, sizeof header);
            const auto read = need(read_safetensors(MappedSource(bytes)));
            for (const NamedTensor& tensor : tensors)
                EXPECT_EQ(read.tensors.find(tensor.name)->values, tensor.values);
            NamedTensor copy = *read.tensors.find("many");
            EXPECT_EQ(copy.values.file() != nullptr, !half && blanks % 4 == 0) << blanks;
            copy.values.own()[1] = -1;
            EXPECT_EQ(copy.values[0], many[0]);
            EXPECT_EQ(copy.values[1], -1);
            EXPECT_EQ(read.tensors.find("many")->values, TensorValues(many));
        }
}

TEST(Safetensors, NumbersOfOtherTypesAreConverted) {
    std::string header = R"({"many":{"dtype":"F32","shape":[300000],"data_offsets":[0,1200000]},)"
                         R"("half":{"dtype":"F16","shape":[2],"data_offsets":[1200000,1200004]}})";
    header.resize((header.size() + 7) / 8 * 8, ' ');
    Buffer bytes;
    put(bytes, std::uint64_t{header.size()});
    put_text(bytes, header);
    bytes.resize(bytes.size() + 1200000);
    put(bytes, std::uint16_t{0x3C00});
    put(bytes, std::uint16_t{0xC000});
    const auto read = need(read_safetensors(MappedSource(bytes)));
    EXPECT_NE(read.tensors.find("many")->values.file(), nullptr);
    EXPECT_EQ(read.tensors.find("half")->values.file(), nullptr);
    EXPECT_EQ(read.tensors.find("half")->values, TensorValues({1, -2}));
}

TEST(Safetensors, WholeNumbersKeepTheirSignAndSize) {
    Buffer bytes;
    const std::string header = R"({"a":{"dtype":"U16","shape":[1],"data_offsets":[0,2]},)"
                               R"("b":{"dtype":"I16","shape":[1],"data_offsets":[2,4]},)"
                               R"("c":{"dtype":"U32","shape":[1],"data_offsets":[4,8]},)"
                               R"("d":{"dtype":"U64","shape":[1],"data_offsets":[8,16]}})";
    put(bytes, std::uint64_t{header.size()});
    put_text(bytes, header);
    put(bytes, std::uint16_t{0xFFFF});
    put(bytes, std::uint16_t{0xFFFF});
    put(bytes, std::uint32_t{0x80000000});
    put(bytes, std::uint64_t{1} << 63U);
    const auto file = need(read(bytes));
    const float values[] = {65535, -1, 0x1p31F, 0x1p63F};
    ASSERT_EQ(file.tensors.size(), std::size(values));
    for (std::size_t i = 0; i < std::size(values); ++i)
        EXPECT_EQ(file.tensors[i].values, TensorValues({values[i]})) << i;
}

TEST(Safetensors, RefusesWhatItCannotWrite) {
    NamedTensors large;
    ASSERT_OK(large.add({"w", {2}, NumberType::kF32, {1, 65520}}));
    EXPECT_OK(write_safetensors(large));
    EXPECT_ERROR(write_safetensors(large, {}, true), Code::kInvalidArgument,
                 "'w' holds 65520, and float16 ends at 65504");
    NamedTensors named;
    ASSERT_OK(named.add({"__metadata__", {}, NumberType::kF32, {1}}));
    EXPECT_FALSE(write_safetensors(named).ok());
}

TEST(Safetensors, ReadsWhatOthersWrite) {
    // Keys in any order, blanks, tensors in another order than their data.
    const auto file = need(read(test::sample_safetensors(
        R"( {"b": {"shape": [2], "data_offsets": [4, 8], "dtype": "BF16"},)"
        R"("__metadata__": {}, "a": {"dtype":"U8","shape":[2,2],"data_offsets":[0,4]}} )",
        8)));
    ASSERT_EQ(file.tensors.size(), 2U);
    EXPECT_EQ(file.tensors[0].name, "a");
    EXPECT_EQ(file.tensors[0].values, (std::vector<float>{1, 1, 1, 1}));
    EXPECT_EQ(file.tensors[1].type, NumberType::kBf16);
    EXPECT_OK(read(test::sample_safetensors("{}", 0)));
}

TEST(Safetensors, RefusesPrefixesAndSurvivesDamage) {
    const auto accepts = [](Bytes bytes) { return read(bytes).ok(); };
    const NamedTensors tensors = test::sample_tensors();
    const auto file = need(write_safetensors(tensors, {{"k", "v"}}));
    test::expect_sturdy(file.joined(), accepts);
}

TEST(Safetensors, RefusesHeadersThatLie) {
    const auto refused = [](const std::string& header, const char* part,
                            Code code = Code::kFormat) {
        EXPECT_ERROR(read(test::sample_safetensors(header, 8)), code, part);
    };
    const auto tensor = [](const std::string& name, const std::string& shape,
                           const std::string& offsets, const std::string& type = "F32") {
        return "\"" + name + "\":{\"dtype\":\"" + type + "\",\"shape\":[" + shape +
               "],\"data_offsets\":[" + offsets + "]}";
    };
    refused("{" + tensor("a", "2", "0,4") + "}", "'a' of shape [2] and type float32 has 4 bytes");
    refused("{" + tensor("a", "2", "8,0") + "}", "has -8 bytes");
    refused("{" + tensor("a", "1", "0,4") + "," + tensor("b", "1", "0,4") + "}", "overlap");
    refused("{" + tensor("a", "1", "0,4") + "," + tensor("b", "1", "5,9") + "}", "overlap");
    refused("{" + tensor("a", "1", "4,8") + "}", "expected 0");
    refused("{" + tensor("a", "1", "0,4") + "}", "the tensors have 4 bytes, the file 8");
    refused("{" + tensor("a", "3", "0,12") + "}", "the tensors have 12 bytes, the file 8");
    refused("{" + tensor("a", "1152921504606846976", "0,8") + "}", "more than 2147483647");
    refused("{" + tensor("a", "2", "0,9223372036854775807") + "}", "bytes");
    refused("{" + tensor("a", "2", "0,18446744073709551615") + "}", "not as expected");
    refused("{" + tensor("a", "-2", "0,8") + "}", "not as expected");
    refused("{" + tensor("a", "2.0", "0,8") + "}", "not as expected");
    refused("{" + tensor("a", "[2]", "0,8") + "}", "not as expected");
    refused("{" + tensor("a", "2", "0,8,8") + "}", "two data_offsets");
    refused("{" + tensor("a", "2", "0,8", "F8_E4M3") + "}", "F8_E4M3", Code::kUnsupported);
    refused("{" + tensor("a", "1", "0,4") + "," + tensor("a", "1", "4,8") + "}",
            "'a' appears twice");
    refused(R"({"a":{"dtype":"F32","shape":[2],"shape":[2],"data_offsets":[0,8]}})", "twice");
    refused(R"({"a":{"dtype":"F32","dtype":"F32","shape":[2],"data_offsets":[0,8]}})", "twice");
    refused(R"({"a":{"dtype":"F32","shape":[2]}})", "lacks");
    refused(R"({"a":{"shape":[2],"data_offsets":[0,8]}})", "lacks");
    refused(R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8],"more":1}})", "'more' is not");
    refused("{" + tensor("a\\u0000b", "1", "0,4") + "," + tensor("a\\u0000c", "1", "4,8") + "}",
            "safetensors: the header: an escaped NUL");
    refused("{" + tensor(std::string(5000, 'n'), "3", "0,8") + "}", "nnn...' of shape [3]");
    refused(R"({"a":3})", "not a JSON object");
    refused("[]", "not a JSON object");
    refused(R"({"__metadata__":{"a":1}})", "something other than text");
    refused(R"({"__metadata__":{"a":"1","a":"2"}})", "twice");
    refused(R"({"a":)", "not valid JSON");
    refused(std::string(1000, '['), "");
    refused(R"({"a":)" + std::string(100, '['), "");
}

TEST(Safetensors, RefusesSizesThatLie) {
    for (const std::uint64_t size : {1ULL, 17ULL, 1ULL << 40U, 1ULL << 63U, ~0ULL}) {
        Buffer file;
        put(file, size);
        put_text(file, "{}              ");
        EXPECT_EQ(read(file).ok(), false) << size;
    }
    const auto few = [](std::size_t tensors) { return DecodeLimits{64, 100, tensors}; };
    const NamedTensors tensors = test::sample_tensors();
    const auto file = need(write_safetensors(tensors));
    EXPECT_OK(read(file.joined(), few(3)));
    EXPECT_ERROR(read(file.joined(), few(2)), Code::kFormat, "more than 2 tensors");
}

}  // namespace
}  // namespace splat::io
