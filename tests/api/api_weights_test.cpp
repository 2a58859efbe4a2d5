// Files of weights through the C API. Needs no device.
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "api/api_calls.h"

namespace splat::test {
namespace {

std::string report_of(splat_weights weights) {
    std::size_t needed = 0;
    EXPECT_EQ(splat_weights_report(weights, nullptr, 0, &needed), SPLAT_INCOMPLETE);
    std::string text(needed, '\0');
    EXPECT_DONE(splat_weights_report(weights, text.data(), needed, nullptr));
    text.pop_back();
    return text;
}

std::vector<float> values_of(splat_weights weights, const char* name) {
    std::uint32_t index = 99;
    EXPECT_DONE(splat_weights_find(weights, name, &index));
    auto info = sized<splat_weights_info>();
    EXPECT_DONE(splat_weights_get_info(weights, index, &info));
    EXPECT_STREQ(info.name, name);
    std::vector<float> values(info.elements);
    EXPECT_DONE(splat_weights_read(weights, index, values.data(), values.size() * sizeof(float)));
    return values;
}

TEST(ApiWeights, TellsWhatAFileHolds) {
    const Weights weights = make_weights();
    std::uint32_t count = 0;
    ASSERT_DONE(splat_weights_count(weights, &count));
    EXPECT_EQ(count, 2U);
    auto info = sized<splat_weights_info>();
    ASSERT_DONE(splat_weights_get_info(weights, 0, &info));
    EXPECT_STREQ(info.name, "a");
    EXPECT_STREQ(info.dtype, "float32");
    EXPECT_EQ(info.rank, 2U);
    EXPECT_EQ(info.dims[0] * 10 + info.dims[1], 22);
    EXPECT_EQ(info.elements, 4U);
    ASSERT_DONE(splat_weights_get_info(weights, 1, &info));
    EXPECT_STREQ(info.dtype, "float16");
    EXPECT_EQ(info.rank, 0U);
    EXPECT_EQ(info.dims[0], 0);
    EXPECT_EQ(values_of(weights, "a"), (std::vector<float>{1, 2, 3, 4}));
    EXPECT_EQ(values_of(weights, "b"), (std::vector<float>{0.5F}));
    EXPECT_EQ(
        report_of(weights),
        R"({"format": "safetensors", "metadata": {"k": "v"}, "warnings": [], "published": {"fit": [], )"
        R"("nearest": "", "differences": [], "sentence": "it is no network of Splatter Image: )"
        R"(it has no tensor 'network_with_offset.encoder.enc.RxR_conv.weight'"}})");
}

TEST(ApiWeights, SavesByExtension) {
    const auto folder =
        std::filesystem::temp_directory_path() / ("splat-api-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    const Weights weights = make_weights();
    for (const char* name : {"x.safetensors", "x.npz", "x.pth"})
        for (const std::uint32_t flags : {0U, std::uint32_t{SPLAT_WEIGHTS_HALF}}) {
            const std::string path = folder / name;
            ASSERT_DONE(splat_weights_save(weights, path.c_str(), flags));
            Weights again;
            ASSERT_DONE(splat_weights_load(path.c_str(), 0, again.out()));
            EXPECT_EQ(values_of(again, "a"), (std::vector<float>{1, 2, 3, 4}));
            auto info = sized<splat_weights_info>();
            ASSERT_DONE(splat_weights_get_info(again, 0, &info));
            EXPECT_STREQ(info.dtype, flags != 0 ? "float16" : "float32");
        }
    EXPECT_REFUSED(splat_weights_save(weights, (folder / "x.bin").c_str(), 0),
                   SPLAT_ERROR_UNSUPPORTED, "written as .safetensors, .pth or .npz");
    std::ofstream(folder / "bad") << "PK\x03\x04 no archive";
    Weights none;
    EXPECT_REFUSED(splat_weights_load((folder / "bad").c_str(), 0, none.out()), SPLAT_ERROR_FORMAT,
                   "truncated or damaged");
    std::filesystem::remove_all(folder);
}

/// A layer of one weight of -1 and its adapters of 1 and 1.
Weights one_layer() {
    const std::string header =
        R"({"__metadata__":{"format":"pt","lora_alpha":"2","lora_rank":"1"},)"
        R"("x.weight":{"dtype":"F32","shape":[1,1],"data_offsets":[0,4]},)"
        R"("x.lora_A":{"dtype":"F32","shape":[1,1],"data_offsets":[4,8]},)"
        R"("x.lora_B":{"dtype":"F32","shape":[1,1],"data_offsets":[8,12]}})";
    const std::uint64_t size = header.size();
    const float values[] = {-1, 1, 1};
    const auto path =
        std::filesystem::temp_directory_path() / ("splat-one-layer-" + std::to_string(::getpid()));
    std::ofstream(path, std::ios::binary)
        << std::string(reinterpret_cast<const char*>(&size), sizeof size) << header
        << std::string(reinterpret_cast<const char*>(values), sizeof values);
    Weights weights;
    EXPECT_DONE(splat_weights_load(path.c_str(), 0, weights.out()));
    std::filesystem::remove(path);
    return weights;
}

TEST(ApiWeights, FoldedOnesHaveNoAdapters) {
    const Weights weights = one_layer();
    Weights folded;
    // Not a float32: rounding alpha before the weight would give 1 + 2^-23.
    ASSERT_DONE(splat_weights_fold(weights, nullptr, 0x1.0000010001p0, 0, folded.out()));
    EXPECT_EQ(values_of(folded, "x.weight"), (std::vector<float>{0x1.0001p-24F}));
    std::uint32_t count = 0;
    EXPECT_DONE(splat_weights_count(folded, &count));
    EXPECT_EQ(count, 1U);
    EXPECT_TRUE(report_of(folded).starts_with(
        R"({"format": "model", "metadata": {"format": "pt"}, "warnings": [], "published": )"));
    EXPECT_REFUSED(splat_weights_fold(weights, nullptr, 1e39, 0, folded.out()),
                   SPLAT_ERROR_INVALID_ARGUMENT,
                   "layer of 'x.weight': element 0 of the folded weight is inf");
    const Weights other = make_weights();
    EXPECT_REFUSED(splat_weights_fold(other, weights, 1, 0, folded.out()),
                   SPLAT_ERROR_INVALID_ARGUMENT, "the file has no 'x.weight'");
}

/// Files of a megabyte or more are used in place.
TEST(ApiWeights, LargeFilesWrittenInPlaceAreRefused) {
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("splat-large-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    const std::string path = folder / "large.safetensors";
    const std::string copy = folder / "copy.safetensors";
    const std::vector<float> large = write_large_weights(path);
    Weights weights;
    ASSERT_DONE(splat_weights_load(path.c_str(), 0, weights.out()));
    EXPECT_EQ(values_of(weights, "w"), large);
    ASSERT_DONE(splat_weights_save(weights, path.c_str(), 0));  // over itself
    EXPECT_EQ(values_of(weights, "w"), large);

    ASSERT_DONE(splat_weights_load(path.c_str(), 0, weights.out()));
    std::filesystem::resize_file(path, 500000);
    std::vector<float> values(large.size(), -1.0F);
    const char* why = "large.safetensors' was written since it was opened";
    EXPECT_REFUSED(splat_weights_read(weights, 0, values.data(), values.size() * sizeof(float)),
                   SPLAT_ERROR_IO, why);
    EXPECT_EQ(values, std::vector<float>(large.size(), -1.0F));
    EXPECT_REFUSED(splat_weights_save(weights, copy.c_str(), 0), SPLAT_ERROR_IO, why);
    EXPECT_FALSE(std::filesystem::exists(copy));
    Weights folded;
    EXPECT_REFUSED(splat_weights_fold(weights, nullptr, 1, 0, folded.out()), SPLAT_ERROR_IO, why);
    EXPECT_REFUSED(splat_weights_fold(make_weights(), weights, 1, 0, folded.out()), SPLAT_ERROR_IO,
                   why);
    std::filesystem::remove_all(folder);
}

TEST(ApiWeights, EmptyOnesAreWrittenAndReadInEveryFormat) {
    Weights empty;
    ASSERT_DONE(splat_weights_from_arrays(nullptr, 0, empty.out()));
    for (const splat_weights_format format : {SPLAT_WEIGHTS_SAFETENSORS, SPLAT_WEIGHTS_NPZ})
        for (const std::uint32_t flags : {std::uint32_t{0}, std::uint32_t{SPLAT_WEIGHTS_HALF}}) {
            std::size_t bytes = 0;
            EXPECT_EQ(splat_weights_save_memory(empty, format, flags, nullptr, 0, &bytes),
                      SPLAT_INCOMPLETE);
            std::vector<char> file(bytes);
            ASSERT_DONE(
                splat_weights_save_memory(empty, format, flags, file.data(), bytes, nullptr));
            Weights read;
            ASSERT_DONE(splat_weights_load_memory(file.data(), bytes, read.out())) << format;
            std::uint32_t count = 7;
            EXPECT_DONE(splat_weights_count(read, &count));
            EXPECT_EQ(count, 0U);
            const char* const name = format == SPLAT_WEIGHTS_NPZ ? "npz" : "safetensors";
            EXPECT_NE(report_of(read).find(name), std::string::npos) << report_of(read);
        }
}

TEST(ApiWeights, ATensorWithoutElementsNeedsNoRoom) {
    splat_named_array none{};
    none.name = "none";
    none.rank = 2;
    none.dims[1] = 3;
    Weights weights;
    ASSERT_DONE(splat_weights_from_arrays(&none, 1, weights.out()));
    EXPECT_DONE(splat_weights_read(weights, 0, nullptr, 0));
    EXPECT_REFUSED(splat_weights_read(weights, 0, nullptr, 4), SPLAT_ERROR_INVALID_ARGUMENT,
                   "values is NULL");
    EXPECT_REFUSED(splat_weights_read(make_weights(), 0, nullptr, 0), SPLAT_ERROR_INVALID_ARGUMENT,
                   "values is NULL");
}

TEST(ApiWeights, DestroyedOnesAreRefused) {
    Weights weights = make_weights();
    const splat_weights stale = weights.destroy();
    std::uint32_t count = 7;
    EXPECT_REFUSED(splat_weights_count(stale, &count), SPLAT_ERROR_INVALID_HANDLE, "destroyed");
    EXPECT_REFUSED(splat_weights_destroy(stale), SPLAT_ERROR_INVALID_HANDLE, "destroyed");
    EXPECT_EQ(count, 7U);
    EXPECT_DONE(splat_weights_destroy(nullptr));
}

}  // namespace
}  // namespace splat::test
