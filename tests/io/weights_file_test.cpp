#include "io/weights_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "io/npy.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "io/sample_weights.h"
#include "io/weights_formats.h"
#include "support/expect_status.h"
#include "support/npz.h"

namespace splat::io {
namespace {

using test::sample_zip;

Result<WeightsFile> read_archive(Bytes file, const DecodeLimits& limits = decode_limits()) {
    return read_npz(MemorySource(file), limits);
}

std::string npy(const std::string& dtype, const std::vector<std::uint64_t>& shape,
                const std::string& data) {
    return std::string(as_text(write_npy_header(dtype, shape))) + data;
}

TEST(WeightsNpz, RoundTripAndASecondReader) {
    const NamedTensors tensors = test::sample_tensors();
    for (const bool half : {false, true}) {
        const auto file = need(write_npz(tensors, half));
        const auto again = need(read_archive(file.joined()));
        ASSERT_EQ(again.tensors.size(), tensors.size());
        for (std::size_t i = 0; i < tensors.size(); ++i) {
            EXPECT_EQ(again.tensors[i].name, tensors[i].name);
            EXPECT_EQ(again.tensors[i].dims, tensors[i].dims);
            EXPECT_EQ(again.tensors[i].values, tensors[i].values);
        }
        const auto other = need(test::Npz::parse(file.joined(), "npz"));
        if (half) continue;
        EXPECT_EQ(other.find("first.weight").value()->f32().value(), tensors[0].values);
    }
}

TEST(WeightsNpz, ReadsEveryTypeAndIgnoresText) {
    const auto file = need(read_archive(
        sample_zip({{"half.npy", npy("<f2", {2}, std::string("\0\x3c\0\xbc", 4)), true},
                    {"big.npy", npy(">i4", {1}, std::string("\0\0\1\0", 4))},
                    {"bool.npy", npy("|b1", {1, 1}, "\1")},
                    {"u2.npy", npy("<u2", {1}, std::string(2, '\xFF'))},
                    {"u4.npy", npy("<u4", {1}, std::string("\0\0\0\x80", 4))},
                    {"u8.npy", npy(">u8", {1}, std::string("\x80\0\0\0\0\0\0\0", 8))},
                    {"text.npy", npy("<U1", {1}, std::string("x\0\0\0", 4))}})));
    const NamedTensors& tensors = file.tensors;
    ASSERT_EQ(tensors.size(), 6U);
    EXPECT_EQ(tensors[0].values, (std::vector<float>{1, -1}));
    EXPECT_EQ(tensors[1].values, (std::vector<float>{256}));
    EXPECT_EQ(tensors[2].type, NumberType::kBool);
    EXPECT_EQ(tensors[3].values, (std::vector<float>{65535}));
    EXPECT_EQ(tensors[4].values, (std::vector<float>{0x1p31F}));
    EXPECT_EQ(tensors[5].values, (std::vector<float>{0x1p63F}));
    EXPECT_EQ(file.warnings, (std::vector<std::string>{"'text' holds text and is ignored"}));
}

TEST(WeightsNpz, RefusesPrefixesAndSurvivesDamage) {
    const auto accepts = [](Bytes bytes) { return read_archive(bytes).ok(); };
    const NamedTensors tensors = test::sample_tensors();
    const auto file = need(write_npz(tensors));
    test::expect_sturdy(file.joined(), accepts);
}

TEST(WeightsNpz, RefusesForeignMembers) {
    const auto refused = [](const std::string& name, const std::string& data, const char* part,
                            Code code = Code::kFormat) {
        EXPECT_ERROR(read_archive(sample_zip({{name, data}})), code, part);
    };
    refused("x", "y", "'x' is not a .npy array", Code::kUnsupported);
    refused("x.npy", "y", "npz: 'x': npy: ");
    refused("x.npy", npy("<c8", {1}, "12345678"), "dtype 'c8'", Code::kUnsupported);
    refused("x.npy", npy("<f4", {2}, "1234"), "4 bytes of data, its shape [2] of float32 needs 8");
    refused("x.npy", npy("<f4", {1}, "12345678"),
            "8 bytes of data, its shape [1] of float32 needs 4");
    refused("x.npy", npy("<f4", {1ULL << 60U}, "1234"), "more than 2147483647");
    refused("x.npy", npy("<f4", {~0ULL}, "1234"), "npz: 'x'");
    refused("x.npy", npy("<f4", {1, 1, 1, 1, 1, 1, 1, 1, 1}, "1234"), "9 dimensions");
    EXPECT_ERROR(
        read_archive(sample_zip({{"x.npy", npy("|u1", {100000}, std::string(100000, 'x')), true}}),
                     {64, 150000, 10}),
        Code::kFormat, "too many for a file of");
}

class WeightsFileTest : public test::FolderTest {};

TEST_F(WeightsFileTest, ContentsDecideAndExtensionsSave) {
    WeightsFile weights;
    weights.tensors = test::sample_tensors();
    weights.metadata = {{"iteration", "3"}};
    for (const char* extension : {".safetensors", ".npz", ".pth"}) {
        ASSERT_OK(save_weights(weights, path(std::string("a") + extension)));
        // The library of mingw copies over no file.
        std::filesystem::remove(path("any"));
        std::filesystem::copy_file(path(std::string("a") + extension), path("any"));
        const auto again = need(load_weights(path("any")));
        const bool npz = std::string(extension) == ".npz";
        EXPECT_EQ(weights_format_name(again.format), std::string(extension).substr(1));
        const Metadata& metadata = again.metadata;
        EXPECT_EQ(metadata.empty(), npz);
        if (!npz) {
            EXPECT_EQ(metadata[0], weights.metadata[0]);
        }
        for (const NamedTensor& tensor : weights.tensors) {
            ASSERT_NE(again.tensors.find(tensor.name), nullptr);
            EXPECT_EQ(again.tensors.find(tensor.name)->values, tensor.values);
        }
    }
    EXPECT_ERROR(save_weights(weights, path("a.bin")), Code::kUnsupported,
                 ".safetensors, .pth or .npz");
    weights.metadata = {{"iteration", "3.5"}};
    EXPECT_ERROR(save_weights(weights, path("b.pth")), Code::kInvalidArgument,
                 "'iteration' is '3.5', expected a number");
    EXPECT_FALSE(std::filesystem::exists(path("b.pth")));
    EXPECT_FALSE(save_weights(weights, path("none/a.npz")).ok());
}

TEST_F(WeightsFileTest, NamesThatAreNotUtf8StayOutOfSafetensors) {
    WeightsFile weights;
    for (const char* name : {"a\xE4", "a\xF6"})
        ASSERT_OK(weights.tensors.add({name, {1}, NumberType::kF32, {1.0F}}));
    ASSERT_OK(save_weights(weights, path("a.npz")));
    const auto read = need(load_weights(path("a.npz")));
    ASSERT_EQ(read.tensors.size(), 2U);
    EXPECT_ERROR(save_weights(read, path("a.safetensors")), Code::kInvalidArgument,
                 "the tensor 'a\\xe4' is not UTF-8");
    EXPECT_FALSE(std::filesystem::exists(path("a.safetensors")));
}

TEST_F(WeightsFileTest, KnowsCheckpoints) {
    test::PickleText pickle;
    pickle.raw("}(").text("iteration").integer(9).text("loss").real(0.1).text("model_state_dict");
    pickle.raw("}").text("w").tensor("FloatStorage", "0", 1, 0, {1}, {1}).raw("su");
    const Buffer file = test::sample_pth(pickle.done(), {test::raw_bytes<float>({4})});
    const auto weights = need(read_weights(MemorySource(file), "x"));
    EXPECT_EQ(weights.format, WeightsFormat::kPth);
    EXPECT_EQ(weights.metadata, (Metadata{{"iteration", "9"}, {"loss", "0.1"}}));
    EXPECT_EQ(weights.tensors[0].values, (std::vector<float>{4}));
}

/// The checkpoint of F3D-Gaus has "model" beside the optimiser's state, which is not read.
TEST_F(WeightsFileTest, TakesWrappersOffNames) {
    test::PickleText pickle;
    pickle.raw("}(").text("optimizer").raw("}").text("state").raw("}").raw("s").text("model");
    pickle.raw("}(").text("module.gaussian_predictor.w");
    pickle.tensor("FloatStorage", "0", 2, 0, {1}, {1}).text("module.gaussian_predictor.v");
    pickle.tensor("FloatStorage", "0", 2, 1, {1}, {1}).raw("uu");
    const Buffer file = test::sample_pth(pickle.done(), {test::raw_bytes<float>({4, 5})});
    const auto weights = need(read_weights(MemorySource(file), "x"));
    ASSERT_EQ(weights.tensors.size(), 2U);
    ASSERT_NE(weights.tensors.find("v"), nullptr);
    EXPECT_EQ(weights.tensors.find("v")->values, (std::vector<float>{5}));
    EXPECT_EQ(weights.warnings,
              (std::vector<std::string>{
                  "'module.', with which the names of all its tensors begin, is left out",
                  "'gaussian_predictor.', with which the names of all its tensors begin, is left "
                  "out"}));
    NamedTensors mixed;
    for (const char* name : {"module.a", "b"})
        ASSERT_OK(mixed.add({name, {1}, NumberType::kF32, {1.0F}}));
    EXPECT_FALSE(mixed.drop_start("module.")) << "not all begin with it";
    EXPECT_NE(mixed.find("module.a"), nullptr);
    NamedTensors bare;
    ASSERT_OK(bare.add({"module.", {1}, NumberType::kF32, {1.0F}}));
    EXPECT_FALSE(bare.drop_start("module.")) << "nothing would be left";
}

/// {'model_config': {...}, 'model': {...}}, as MoGe's checkpoints.
TEST_F(WeightsFileTest, KeepsTheConfigurationOfACheckpoint) {
    test::PickleText pickle;
    pickle.raw("}(").text("model_config").raw("}(").text("heads").integer(6).text("remap");
    pickle.text("exp").text("taps").raw("](").integer(5).integer(11).raw("e");
    pickle.text("none").raw("N").text("on").raw("\x88").text("x").real(0.5).raw("u").text("model");
    pickle.raw("}").text("w").tensor("FloatStorage", "0", 1, 0, {1}, {1}).raw("su");
    const Buffer file = test::sample_pth(pickle.done(), {test::raw_bytes<float>({4})});
    const auto weights = need(read_weights(MemorySource(file), "x"));
    EXPECT_EQ(weights.metadata,
              (Metadata{{"model_config", R"({"heads": 6, "remap": "exp", "taps": [5, 11], )"
                                         R"("none": null, "on": true, "x": 0.5})"}}));
    EXPECT_EQ(weights.tensors[0].values, (std::vector<float>{4}));
    const auto refused = [](const std::string& config, const char* part) {
        test::PickleText bad;
        bad.raw("}(").text("model").raw("}").text("w");
        bad.tensor("FloatStorage", "0", 1, 0, {1}, {1}).raw("s").text("model_config").raw(config);
        const Buffer broken = test::sample_pth(bad.raw("u").done(), {test::raw_bytes<float>({4})});
        EXPECT_ERROR(read_weights(MemorySource(broken), "x"), Code::kFormat, part);
    };
    std::string deep;
    for (int i = 0; i < 20; ++i) deep += "](";
    for (int i = 0; i < 20; ++i) deep += "e";
    refused(deep, "'model_config' has more than 4096 values, or nests deeper than 16");
    // A list that holds itself: kept under number 0, fetched, appended.
    refused(std::string("]q\0h\0a", 6), "nests deeper than 16");
    refused(test::PickleText().raw("}").integer(1).integer(2).raw("s").done().substr(2, 6),
            "a name in 'model_config' is not a text");
}

TEST_F(WeightsFileTest, TellsWeightsFromOtherFiles) {
    WeightsFile weights;
    ASSERT_OK(weights.tensors.add({"a", {1}, NumberType::kF32, {1.0F}}));
    for (const char* name : {"a.safetensors", "a.pth", "a.npz"}) {
        ASSERT_OK(save_weights(weights, path(name)));
        EXPECT_TRUE(is_weights_file(path(name))) << name;
        std::filesystem::rename(path(name), path("other"));
        EXPECT_TRUE(is_weights_file(path("other"))) << name;
    }
    EXPECT_FALSE(is_weights_file(path("none.pt")));
    std::ofstream(path("text.onnx")) << "no weights";
    EXPECT_FALSE(is_weights_file(path("text.onnx")));
    std::ofstream(path("damaged.pt")) << "no weights";
    EXPECT_TRUE(is_weights_file(path("damaged.pt"))) << "by its name";
}

TEST_F(WeightsFileTest, RefusesOtherFiles) {
    const auto refused = [](const std::string& text, const char* part, Code code) {
        EXPECT_ERROR(read_weights(MemorySource(test::bytes_of(text)), "x.pth"), code, part);
    };
    refused("", "'x.pth': not weights", Code::kFormat);
    refused("ply\n", "not weights of a known format", Code::kFormat);
    refused("\x80\x02\x8a\x0al\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19.",
            "'x.pth': pth: pickle: 'opcode' at byte 0", Code::kFormat);
    EXPECT_ERROR(load_weights(path("none")), Code::kNotFound, "No such file");
    EXPECT_ERROR(load_weights(path("")), Code::kIo, "regular file");
}

}  // namespace
}  // namespace splat::io
