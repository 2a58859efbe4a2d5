#include "io/weights_formats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "io/sample_scene.h"
#include "io/sample_weights.h"
#include "io/torch/pickle.h"
#include "io/torch/pth_archive.h"
#include "support/expect_status.h"
#include "support/golden_file.h"

namespace splat::io {
namespace {

using namespace test;

Result<WeightsFile> read_file(Bytes file, const DecodeLimits& limits = decode_limits()) {
    return read_pth(MemorySource(file), limits);
}

/// A bare state dict of one tensor "a" over one storage of this type.
Buffer one(const std::string& type, const std::string& storage, std::int64_t stored,
           std::int64_t offset, const std::vector<std::int64_t>& dims,
           const std::vector<std::int64_t>& strides) {
    PickleText pickle;
    pickle.raw("}").text("a").tensor(type, "0", stored, offset, dims, strides).raw("s");
    return sample_pth(pickle.done(), {storage});
}

void expect_pth_refused(const Buffer& file, const char* part, Code code = Code::kFormat) {
    EXPECT_ERROR(read_file(file), code, part);
}

/// ckpt.npz, which describes the checkpoints in the same folder.
Golden checkpoint_arrays(const std::string& folder) {
    auto npz = Npz::read(folder + "ckpt.npz.xz");
    EXPECT_OK(npz);
    return {npz.ok() ? std::move(npz.value()) : Npz(), "ckpt", false};
}

std::size_t weights_of(const Golden& golden) {
    const std::vector<std::string> names = golden.npz.names();
    return static_cast<std::size_t>(
        std::count_if(names.begin(), names.end(),
                      [](const std::string& name) { return name.starts_with("m."); }));
}

/// Every tensor of the file equals that of the other implementation, bit by bit.
void expect_golden(const NamedTensors& tensors, const Golden& golden) {
    EXPECT_EQ(tensors.size(), weights_of(golden));
    EXPECT_GT(tensors.size(), 100U);
    for (const NamedTensor& tensor : tensors) {
        const std::string key = "m." + tensor.name;
        EXPECT_EQ(tensor.dims, golden.dims(key)) << key;
        EXPECT_EQ(tensor.values, golden.floats(key)) << key;
        EXPECT_EQ(tensor.type, NumberType::kF32) << key;
    }
}

double golden_number(const Golden& golden, const std::string& name) {
    const NpyArray& array = golden.array(name);
    return array.dtype == "f8" ? array.f64().value()[0]
                               : static_cast<double>(array.ints().value()[0]);
}

/// A number of the metadata; NaN if there is none.
double noted(const WeightsFile& file, std::string_view name) {
    for (const auto& [key, text] : file.metadata)
        if (key == name) return std::stod(text);
    return std::nan("");
}

TEST(GoldenNetCheckpoint, WeightsAndScalars) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    const std::string folder = *golden_folder() + "/net/";
    const Golden golden = checkpoint_arrays(folder);
    for (const char* name : {"ckpt.pth", "ckgpu.pth"}) {
        const auto source = need(open_source(folder + name));
        const auto file = need(read_pth(*source));
        EXPECT_FALSE(std::isnan(noted(file, "iteration")));
        EXPECT_FALSE(std::isnan(noted(file, "best_PSNR")));
        if (std::string(name) == "ckgpu.pth") {  // other weights of the same network
            EXPECT_EQ(file.tensors.size(), weights_of(golden));
            continue;
        }
        expect_golden(file.tensors, golden);
        for (const char* number : {"loss", "iteration", "best_PSNR"})
            EXPECT_EQ(noted(file, number), golden_number(golden, number)) << number;
    }
}

/// The published trainer of cars and chairs: the pickle holds its configuration, too.
TEST(GoldenNetCheckpoint, OfficialFilesHoldAConfiguration) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    const std::string folder = *golden_folder() + "/net/";
    const auto source = need(open_source(folder + "official_style.pth"));
    const auto file = need(read_pth(*source));
    expect_golden(file.tensors, checkpoint_arrays(folder));
}

TEST(GoldenNetCheckpoint, StridesAreThoseOfTheFile) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    const Golden golden = checkpoint_arrays(*golden_folder() + "/net/");
    std::size_t scattered = 0;
    for (const std::string& name : golden.npz.names())
        if (name.starts_with("stride.") && name.ends_with("conv0.weight"))
            scattered += golden.array(name).ints().value().back() != 1 ? 1U : 0U;
    EXPECT_GT(scattered, 10U) << "else WeightsAndScalars does not look at strides";
}

TEST(Pth, ReadsStridesOffsetsAndTypes) {
    const auto file = need(read_file(sample_pth()));
    const NamedTensors& tensors = file.tensors;
    EXPECT_TRUE(file.metadata.empty());
    ASSERT_EQ(tensors.size(), 2U);
    EXPECT_EQ(tensors[0].name, "a");
    EXPECT_EQ(tensors[0].values, (std::vector<float>{1, 3, 5, 2, 4, 6}));
    EXPECT_EQ(tensors[1].type, NumberType::kF16);
    EXPECT_EQ(tensors[1].values, (std::vector<float>{1}));

    const std::string ten = raw_bytes<float>({0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
    const auto values = [&](std::int64_t offset, const std::vector<std::int64_t>& dims,
                            const std::vector<std::int64_t>& strides) {
        return need(read_file(one("FloatStorage", ten, 10, offset, dims, strides)))
            .tensors[0]
            .values;
    };
    EXPECT_EQ(values(9, {1, 1}, {100, 100}), (std::vector<float>{9}));
    EXPECT_EQ(values(2, {2, 3}, {3, 1}), (std::vector<float>{2, 3, 4, 5, 6, 7}));
    EXPECT_EQ(values(1, {2, 2, 2}, {0, 4, 2}), (std::vector<float>{1, 3, 5, 7, 1, 3, 5, 7}));
    EXPECT_EQ(values(0, {3, 0, 2}, {9, 9, 9}), std::vector<float>());
    EXPECT_EQ(values(3, {}, {}), (std::vector<float>{3}));
    const auto longs =
        need(read_file(one("LongStorage", raw_bytes<std::int64_t>({-4, 5}), 2, 0, {2}, {1})));
    EXPECT_EQ(longs.tensors[0].values, (std::vector<float>{-4, 5}));
}

TEST(Pth, ReadsFilesFromBeforeTorch16) {
    const Buffer bytes = sample_legacy_pth();
    const auto file = need(read_file(bytes));
    ASSERT_EQ(file.tensors.size(), 2U);
    EXPECT_EQ(file.tensors[0].values, (std::vector<float>{1, 3, 5, 2, 4, 6}));
    EXPECT_EQ(file.tensors[1].values, (std::vector<float>{1}));
    const auto accepts = [](Bytes file_bytes) { return read_file(file_bytes).ok(); };
    expect_sturdy(bytes, accepts);
}

/// Before PyTorch 0.4, Python 2: byte strings, another function, and parameters with a state.
TEST(Pth, ReadsParametersFromBeforeTorch04) {
    PickleText pickle;
    pickle.global("collections", "OrderedDict").raw("(](](U\1w");
    pickle.global("torch.nn.parameter", "Parameter").global("torch._utils", "_rebuild_tensor");
    pickle.raw("((U\7storage").global("torch", "FloatStorage").raw("U\0017U\3cpu").integer(6);
    pickle.raw("NtQ").integer(1).tuple({2}).tuple({3}).raw("tR\x85R(\x88\x89");
    pickle.global("collections", "OrderedDict").raw(")Rtbee").raw("tR");
    LegacyPth parts = legacy_parts();
    parts.saved = pickle.done();
    parts.keys = {"7"};
    parts.storages.pop_back();
    const auto file = need(read_file(sample_legacy_pth(parts)));
    ASSERT_EQ(file.tensors.size(), 1U);
    EXPECT_EQ(file.tensors[0].name, "w");
    EXPECT_EQ(file.tensors[0].values, (std::vector<float>{2, 5}));
}

TEST(Pth, RefusesDamageOfFilesFromBeforeTorch16) {
    const auto refused = [](const char* part, auto change, Code code = Code::kFormat) {
        LegacyPth parts = legacy_parts();
        change(parts);
        expect_pth_refused(sample_legacy_pth(parts), part, code);
    };
    using Parts = LegacyPth;
    const auto machine = [](const std::string& value) {
        return [value](Parts& parts) {
            parts.machine = PickleText().raw("}").text("little_endian").raw(value + "s").done();
        };
    };
    refused(
        "a protocol other than 1001",
        [](Parts& parts) { parts.protocol = PickleText().integer(1000).done(); },
        Code::kUnsupported);
    refused("byte order is 'big'", machine("\x89"), Code::kUnsupported);
    refused("does not tell its byte order", machine("N"));
    refused(
        "asks for 'os.system'",
        [](Parts& parts) { parts.saved = PickleText().global("os", "system").done(); },
        Code::kUnsupported);
    refused("'8' belongs to no tensor", [](Parts& parts) { parts.keys[0] = "8"; });
    refused("'7' is listed twice", [](Parts& parts) {
        parts.keys[1] = "7";
        parts.counts[1] = 6;
        parts.storages[1] = parts.storages[0];
    });
    refused("no storage '12', that of 'b'", [](Parts& parts) {
        parts.keys.pop_back();
        parts.storages.pop_back();
    });
    refused("ends within the storage '12'", [](Parts& parts) { parts.counts[1] = 3; });
    refused("ends within the storage '7'", [](Parts& parts) { parts.counts[0] = ~0ULL; });
    refused("2 bytes follow the last storage", [](Parts& parts) { parts.counts[1] = 1; });
    refused("'a' has 20 bytes, expected 6 of float32", [](Parts& parts) {
        parts.counts[0] = 5;
        parts.storages[0].resize(20);
    });
    refused(
        "is part of another one",
        [](Parts& parts) { parts.saved.replace(parts.saved.find("NtQ"), 1, "(K\1t"); },
        Code::kUnsupported);
    refused("elements of two types", [](Parts& parts) {
        PickleText pickle;
        pickle.raw("}(").text("a").tensor("FloatStorage", "7", 6, 0, {1}, {1}, true);
        pickle.text("b").tensor("HalfStorage", "7", 6, 0, {1}, {1}, true).raw("u");
        parts.saved = pickle.done();
    });
}

TEST(Pth, ReadsCheckpointsAndScalarsOfNumpy) {
    const std::string pair = "\x86";
    PickleText good;
    good.raw("}(").text("iteration").integer(70000).text("loss").real(-1.25).text("best_PSNR");
    good.global("numpy.core.multiarray", "scalar").global("numpy", "dtype");
    good.raw("(").text("f8").raw("\x89\x88tR(").integer(3).text("<").raw("NNNtb");
    good.global("_codecs", "encode").text(std::string("\0\0\0\0\0\0", 6) + "8@").text("latin1");
    good.raw(pair + "R" + pair + "R").text("state_dict").raw("}").text("w");
    good.tensor("BoolStorage", "0", 2, 0, {2}, {1}).raw("su");
    const auto file = need(read_file(sample_pth(good.done(), {std::string("\x01\0", 2)})));
    EXPECT_EQ(file.metadata,
              (Metadata{{"iteration", "70000"}, {"loss", "-1.25"}, {"best_PSNR", "24"}}));
    EXPECT_EQ(file.tensors[0].values, (std::vector<float>{1, 0}));
}

TEST(Pth, RefusesPrefixesAndSurvivesDamage) {
    const auto accepts = [](Bytes bytes) { return read_file(bytes).ok(); };
    const Buffer file = sample_pth();
    ASSERT_TRUE(accepts(file));
    expect_sturdy(file, accepts);
}

TEST(Pth, RefusesShapesThatLeaveTheStorage) {
    const std::string ten = raw_bytes<float>(std::vector<float>(10));
    const auto refused = [&](std::int64_t stored, std::int64_t offset,
                             const std::vector<std::int64_t>& dims,
                             const std::vector<std::int64_t>& strides, const char* part) {
        expect_pth_refused(one("FloatStorage", ten, stored, offset, dims, strides), part);
    };
    refused(10, 0, {11}, {1}, "'a' of shape [11] and stride [1] reaches beyond its storage");
    refused(10, 1, {2, 5}, {5, 1}, "reaches beyond");
    refused(10, 1LL << 60, {1}, {1}, "reaches beyond");
    refused(10, INT64_MAX, {3}, {INT64_MAX}, "reaches beyond");
    refused(10, 0, {2}, {1LL << 60}, "reaches beyond");
    refused(10, -1, {1}, {1}, "below 0");
    refused(10, 0, {2}, {-1}, "stride of 'a'");
    refused(10, 0, {1LL << 60}, {0}, "more than 2147483647");
    refused(10, 0, {1LL << 30}, {0}, "too many for a file of");
    refused(10, 0, {2}, {1, 1}, "1 dimensions and 2 strides");
    refused(9, 0, {2}, {1}, "has 40 bytes, expected 9 of float32");
    refused(1LL << 60, 0, {2}, {1}, "has 40 bytes");
    expect_pth_refused(one("DoubleStorage", ten, 10, 0, {2}, {1}), "expected 10 of float64");
}

TEST(Pth, RefusesOtherFiles) {
    expect_pth_refused(sample_zip({{"x/other", "y"}}), "holds no data.pkl");
    expect_pth_refused(sample_zip({{"x/data.pkl", "N."}, {"y/data.pkl", "N."}}),
                       "two files data.pkl");
    expect_pth_refused(sample_pth(PickleText().raw("}").done(), {}, "big"), "byte order is 'big'",
                       Code::kUnsupported);
    expect_pth_refused(sample_pth(PickleText().raw("]").done(), {}), "it holds a list");
    expect_pth_refused(sample_pth(PickleText().raw("}").text("a").integer(1).raw("s").done(), {}),
                       "'a' is a number, expected a tensor");
    expect_pth_refused(sample_pth(PickleText().raw("}").integer(1).integer(1).raw("s").done(), {}),
                       "not text");
    PickleText twice;
    twice.raw("}(").text("a").tensor("FloatStorage", "0", 1, 0, {1}, {1});
    twice.text("a").tensor("FloatStorage", "0", 1, 0, {1}, {1}).raw("u");
    expect_pth_refused(sample_pth(twice.done(), {raw_bytes<float>({1})}), "'a' appears twice");
    PickleText missing;
    missing.raw("}").text("a").tensor("FloatStorage", "7", 1, 0, {1}, {1}).raw("s");
    expect_pth_refused(sample_pth(missing.done(), {raw_bytes<float>({1})}), "has no 'x/data/7'");
    EXPECT_TRUE(is_legacy_pth(sample_legacy_pth()));
    EXPECT_FALSE(is_legacy_pth(sample_pth()));
}

TEST(Pth, ManyViewsOfOneStorageStayWithinTheLimits) {
    PickleText pickle;
    pickle.raw("}(");
    for (int i = 0; i < 200; ++i)
        pickle.text(std::to_string(i)).tensor("FloatStorage", "0", 1000, 0, {1000}, {1});
    pickle.raw("u");
    const Buffer file = sample_pth(pickle.done(), {std::string(4000, '\0')});
    EXPECT_OK(read_file(file));
    EXPECT_ERROR(read_file(file, {0, 1'000'000, 1000}), Code::kFormat,
                 "1000 x 4 bytes are too many for a file of");
}

}  // namespace
}  // namespace splat::io
