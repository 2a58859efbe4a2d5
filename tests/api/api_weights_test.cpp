// Files of weights through the C API. Needs no device.
#include <fstream>

#include "api/api_calls.h"
#include "support/system.h"

namespace splat::test {
namespace {

Floats values_of(splat_weights weights, const char* name) {
    const auto index = got(splat_weights_find, weights, name);
    const auto info = got(splat_weights_get_info, weights, index);
    EXPECT_STREQ(info.name, name);
    Floats values(info.elements);
    EXPECT_DONE(splat_weights_read(weights, index, values.data(), values.size() * sizeof(float)));
    return values;
}

TEST(ApiWeights, TellsWhatAFileHolds) {
    const Weights weights = make_weights();
    const auto count = got(splat_weights_count, weights);
    EXPECT_EQ(count, 2U);
    auto info = got(splat_weights_get_info, weights, 0);
    EXPECT_STREQ(info.name, "a");
    EXPECT_STREQ(info.dtype, "float32");
    EXPECT_EQ(info.rank, 2U);
    EXPECT_EQ(info.dims[0] * 10 + info.dims[1], 22);
    EXPECT_EQ(info.elements, 4U);
    ASSERT_DONE(splat_weights_get_info(weights, 1, &info));
    EXPECT_STREQ(info.dtype, "float16");
    EXPECT_EQ(info.rank, 0U);
    EXPECT_EQ(info.dims[0], 0);
    EXPECT_EQ(values_of(weights, "a"), (Floats{1, 2, 3, 4}));
    EXPECT_EQ(values_of(weights, "b"), (Floats{0.5F}));
    EXPECT_EQ(
        text_of(splat_weights_report, weights),
        R"({"format": "safetensors", "metadata": {"k": "v"}, "warnings": [], "published": {"fit": [], )"
        R"("head": "", "nearest": "", "differences": [], "sentence": "its tensors fit no published )"
        R"(configuration: none is 'network_with_offset.encoder.enc.RxR_conv.weight' or )"
        R"('unet.conv_in.weight', and they look like a network that is not known here; its first )"
        R"(tensor is 'a'"}})");
}

TEST(ApiWeights, SavesByExtension) {
    const Temporary folder;
    const Weights weights = make_weights();
    for (const char* name : {"x.safetensors", "x.npz", "x.pth"})
        for (const std::uint32_t flags : {0U, std::uint32_t{SPLAT_WEIGHTS_HALF}}) {
            const std::string path = folder / name;
            ASSERT_DONE(splat_weights_save(weights, path.c_str(), flags));
            const Weights again = got(splat_weights_load, path.c_str(), 0);
            EXPECT_EQ(values_of(again, "a"), (Floats{1, 2, 3, 4}));
            const auto info = got(splat_weights_get_info, again, 0);
            EXPECT_STREQ(info.dtype, flags != 0 ? "float16" : "float32");
        }
    EXPECT_REFUSED(splat_weights_save(weights, (folder / "x.bin").c_str(), 0), kUnsupported,
                   "written as .safetensors, .pth or .npz");
    std::ofstream(folder / "bad") << "PK\x03\x04 no archive";
    Weights none;
    EXPECT_REFUSED(splat_weights_load((folder / "bad").c_str(), 0, none.out()), kFormat,
                   "truncated or damaged");
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
    const Temporary path;
    std::ofstream(path.path(), std::ios::binary)
        << std::string(reinterpret_cast<const char*>(&size), sizeof size) << header
        << std::string(reinterpret_cast<const char*>(values), sizeof values);
    return got(splat_weights_load, path.c_str(), 0);
}

TEST(ApiWeights, FoldedOnesHaveNoAdapters) {
    const Weights weights = one_layer();
    Weights folded;
    // Not a float32: rounding alpha before the weight would give 1 + 2^-23.
    ASSERT_DONE(splat_weights_fold(weights, nullptr, 0x1.0000010001p0, 0, folded.out()));
    EXPECT_EQ(values_of(folded, "x.weight"), (Floats{0x1.0001p-24F}));
    const auto count = got(splat_weights_count, folded);
    EXPECT_EQ(count, 1U);
    EXPECT_TRUE(
        text_of(splat_weights_report, folded)
            .starts_with(
                R"({"format": "model", "metadata": {"format": "pt"}, "warnings": [], "published": )"));
    EXPECT_REFUSED(splat_weights_fold(weights, nullptr, 1e39, 0, folded.out()), kArgument,
                   "layer of 'x.weight': element 0 of the folded weight is inf");
    const Weights other = make_weights();
    EXPECT_REFUSED(splat_weights_fold(other, weights, 1, 0, folded.out()), kArgument,
                   "the file has no 'x.weight'");
}

/// Files of a megabyte or more are used in place.
TEST(ApiWeights, LargeFilesWrittenInPlaceAreRefused) {
    SPLAT_NEED_WRITES_TO_MAPPED_FILES();
    const Temporary folder;
    const std::string path = folder / "large.safetensors";
    const std::string copy = folder / "copy.safetensors";
    const Floats large = write_large_weights(path);
    Weights weights = got(splat_weights_load, path.c_str(), 0);
    EXPECT_EQ(values_of(weights, "w"), large);
    ASSERT_DONE(splat_weights_save(weights, path.c_str(), 0));  // over itself
    EXPECT_EQ(values_of(weights, "w"), large);

    ASSERT_DONE(splat_weights_load(path.c_str(), 0, weights.out()));
    std::filesystem::resize_file(path, 500000);
    Floats values(large.size(), -1.0F);
    const char* why = "large.safetensors' was written since it was opened";
    EXPECT_REFUSED(splat_weights_read(weights, 0, values.data(), values.size() * sizeof(float)),
                   kIo, why);
    EXPECT_EQ(values, Floats(large.size(), -1.0F));
    EXPECT_REFUSED(splat_weights_save(weights, copy.c_str(), 0), kIo, why);
    EXPECT_FALSE(std::filesystem::exists(copy));
    Weights folded;
    EXPECT_REFUSED(splat_weights_fold(weights, nullptr, 1, 0, folded.out()), kIo, why);
    EXPECT_REFUSED(splat_weights_fold(make_weights(), weights, 1, 0, folded.out()), kIo, why);
}

TEST(ApiWeights, EmptyOnesAreWrittenAndReadInEveryFormat) {
    const Weights empty = got(splat_weights_from_arrays, nullptr, 0);
    for (const splat_weights_format format : {SPLAT_WEIGHTS_SAFETENSORS, SPLAT_WEIGHTS_NPZ})
        for (const std::uint32_t flags : {std::uint32_t{0}, std::uint32_t{SPLAT_WEIGHTS_HALF}}) {
            const std::string file = bytes_of(splat_weights_save_memory, empty, format, flags);
            const Weights read = got(splat_weights_load_memory, file.data(), file.size());
            std::uint32_t count = 7;
            EXPECT_DONE(splat_weights_count(read, &count));
            EXPECT_EQ(count, 0U);
            const char* const name = format == SPLAT_WEIGHTS_NPZ ? "npz" : "safetensors";
            EXPECT_TRUE(holds(text_of(splat_weights_report, read), name));
        }
}

TEST(ApiWeights, ATensorWithoutElementsNeedsNoRoom) {
    splat_named_array none{};
    none.name = "none";
    none.rank = 2;
    none.dims[1] = 3;
    const Weights weights = got(splat_weights_from_arrays, &none, 1);
    EXPECT_DONE(splat_weights_read(weights, 0, nullptr, 0));
    EXPECT_REFUSED(splat_weights_read(weights, 0, nullptr, 4), kArgument, "values is NULL");
    EXPECT_REFUSED(splat_weights_read(make_weights(), 0, nullptr, 0), kArgument, "values is NULL");
}

TEST(ApiWeights, DestroyedOnesAreRefused) {
    Weights weights = make_weights();
    const splat_weights stale = weights.destroy();
    std::uint32_t count = 7;
    EXPECT_REFUSED(splat_weights_count(stale, &count), kHandle, "destroyed");
    EXPECT_REFUSED(splat_weights_destroy(stale), kHandle, "destroyed");
    EXPECT_EQ(count, 7U);
    EXPECT_DONE(splat_weights_destroy(nullptr));
}

}  // namespace
}  // namespace splat::test
