#include "prior_models/preset.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "support/expect_status.h"
#include "support/system.h"

namespace splat::prior_models {
namespace {

/// A preset with other text in place of `from`.
std::string changed(const std::string& from, const std::string& to) {
    std::string text =
        R"({"name": "own", "input": {"layout": "NCHW", "fit": "stretch", "size": [8, 6], "filter": "cubic",)"
        R"( "scale": 255, "mean": [0, 0, 0], "std": [1, 1, 1]}, "outputs": [{"map": "mask", "index": 0,)"
        R"( "filter": "linear"}]})";
    const std::size_t place = text.find(from);
    EXPECT_NE(place, std::string::npos) << from;
    return text.replace(place, from.size(), to);
}

TEST(Preset, EveryEmbeddedOneIsReadAndNamedLikeItsFile) {
    const std::vector<std::string> names = preset_names();
    EXPECT_TRUE(std::is_sorted(names.begin(), names.end()));
    std::set<std::string> files;
    for (const std::string& name : names) {
        const auto preset = need(preset_of(name));
        EXPECT_EQ(preset.name, name);
        EXPECT_FALSE(preset.title.empty()) << name;
        EXPECT_FALSE(preset.licence.empty()) << name;
        EXPECT_TRUE(files.insert(preset.file.name).second) << name << ": a file of two presets";
        EXPECT_TRUE(preset.file.sha256.empty() || preset.file.sha256.size() == 64);
        // Without an address the note says how the file is had.
        EXPECT_TRUE(!preset.file.url.empty() || !preset.note.empty()) << name;
    }
    for (const char* name : {"midas-dpt-large", "midas-dpt-hybrid", "midas-small",
                             "midas-small-hub", "u2net", "isnet-general-use", "isnet-imgly",
                             "inspyrenet", "birefnet", "normal-uncertainty-scannet",
                             "normal-uncertainty-nyu", "moge-2-vits", "moge-2-vits-normal"})
        EXPECT_EQ(std::count(names.begin(), names.end(), name), 1) << name;
}

/// What the code of a model's authors does, or that of rembg or of the reference.
struct ModelFacts {
    const char* name;
    Fit fit;
    std::uint32_t width, multiple;
    data::ValueFilter in;
    double scale;      ///< 0: the picture's greatest sample
    double mean, std;  ///< values of red
    std::int32_t index;
    bool sigmoid, min_max, bytes_first;
    int threshold;  ///< -1: none
    data::ValueFilter out;
};

using VF = data::ValueFilter;
constexpr ModelFacts kFacts[] = {
    {"midas-dpt-large", Fit::kMinimal, 384, 32, VF::kCubic, 255, 0.5, 0.5, 0, false, false, false,
     -1, VF::kCubic},
    {"midas-dpt-hybrid", Fit::kMinimal, 384, 32, VF::kCubic, 255, 0.5, 0.5, 0, false, false, false,
     -1, VF::kCubic},
    {"midas-small", Fit::kStretch, 256, 1, VF::kCubic, 255, 0, 1, 0, false, false, false, -1,
     VF::kCubic},
    {"midas-small-hub", Fit::kUpperBound, 256, 32, VF::kCubic, 255, 0.485, 0.229, 0, false, false,
     false, -1, VF::kCubic},
    {"normal-uncertainty-scannet", Fit::kStretch, 512, 1, VF::kPillowBilinear, 255, 0.485, 0.229,
     -1, false, false, false, -1, VF::kCubic},
    {"normal-uncertainty-nyu", Fit::kStretch, 512, 1, VF::kPillowBilinear, 255, 0.485, 0.229, -1,
     false, false, false, -1, VF::kCubic},
    {"u2net", Fit::kStretch, 320, 1, VF::kPillowLanczos, 0, 0.485, 0.229, 0, false, true, true, -1,
     VF::kPillowLanczos},
    {"isnet-general-use", Fit::kStretch, 1024, 1, VF::kPillowLanczos, 0, 0.485, 1, 0, false, true,
     true, -1, VF::kPillowLanczos},
    {"isnet-imgly", Fit::kStretch, 1024, 1, VF::kLinearOrigin, 1, 128, 256, 0, false, false, true,
     -1, VF::kLinearOrigin},
    {"inspyrenet", Fit::kStretch, 1024, 1, VF::kPillowBilinear, 255, 0.485, 0.229, 0, false, false,
     false, 127, VF::kLinearCorners},
    {"birefnet", Fit::kStretch, 384, 1, VF::kPillowBilinear, 255, 0.485, 0.229, -1, true, false,
     true, 127, VF::kPillowBicubic},
    {"birefnet-general", Fit::kStretch, 1024, 1, VF::kPillowLanczos, 0, 0.485, 0.229, 0, true, true,
     true, -1, VF::kPillowLanczos},
};

TEST(Preset, HasTheFactsOfItsModel) {
    for (const ModelFacts& facts : kFacts) {
        SCOPED_TRACE(facts.name);
        const Preset preset = preset_of(facts.name).value();
        const PresetInput& in = preset.input;
        ASSERT_EQ(preset.outputs.size(), 1U);
        const PresetOutput& out = preset.outputs[0];
        EXPECT_EQ(in.fit, facts.fit);
        EXPECT_EQ(in.width, facts.width);
        EXPECT_EQ(in.height, facts.width);
        EXPECT_EQ(in.multiple, facts.multiple);
        EXPECT_EQ(in.filter, facts.in);
        EXPECT_EQ(in.by_maximum ? 0 : in.scale, facts.scale);
        EXPECT_FALSE(in.channels_last);
        using Colors = std::array<double, 3>;
        EXPECT_EQ(in.mean, facts.mean == 0.485 ? (Colors{0.485, 0.456, 0.406})
                                               : (Colors{facts.mean, facts.mean, facts.mean}));
        EXPECT_EQ(in.std, facts.std == 0.229 ? (Colors{0.229, 0.224, 0.225})
                                             : (Colors{facts.std, facts.std, facts.std}));
        EXPECT_EQ(out.index, facts.index);
        EXPECT_EQ(out.channel, 0U);
        EXPECT_EQ(out.sigmoid, facts.sigmoid);
        EXPECT_EQ(out.min_max, facts.min_max);
        EXPECT_EQ(out.bytes_first, facts.bytes_first);
        EXPECT_EQ(out.threshold ? *out.threshold : -1, facts.threshold);
        EXPECT_EQ(out.filter, facts.out);
        EXPECT_EQ(out.depth, DepthOf::kInverse);
        EXPECT_EQ(out.signs, (std::array<float, 3>{1, 1, 1}));
    }
}

TEST(Preset, TakesHashesInCapitals) {
    const auto with_hash = [](const std::string& hash) {
        return preset_of(
            changed("\"outputs\"", R"("file": {"name": "a", "url": "https://a/a", "sha256": ")" +
                                       hash + R"("}, "outputs")"));
    };
    EXPECT_EQ(need(with_hash(std::string(64, 'A'))).file.sha256, std::string(64, 'a'));
    for (const std::string& wrong : {std::string(63, 'a'), std::string(64, 'g')})
        EXPECT_ERROR(with_hash(wrong), Code::kInvalidArgument, "expected 64 hexadecimal digits");
}

TEST(Preset, NamesAFileInTheFolderOfModels) {
    const auto with_name = [](const std::string& name) {
        return preset_of(changed("\"outputs\"", R"("file": {"name": ")" + name +
                                                    R"(", "url": "https://a/a"}, "outputs")"));
    };
    EXPECT_EQ(need(with_name("a.onnx")).file.name, "a.onnx");
    for (const std::string wrong : {"../a.onnx", "/a.onnx", "a/b.onnx", "a\\\\b.onnx", "C:a.onnx"})
        EXPECT_ERROR(with_name(wrong), Code::kInvalidArgument,
                     "the preset.file.name is '" + wrong.substr(0, 1));
}

TEST(Preset, HasTheFactsOfMoge) {
    for (const char* name : {"moge-2-vits", "moge-2-vitb", "moge-2-vitl", "moge-2-vits-normal",
                             "moge-2-vitb-normal", "moge-2-vitl-normal"}) {
        const Preset moge = preset_of(name).value();
        EXPECT_EQ(moge.maps(), 7U);
        EXPECT_EQ(moge.input.fit, Fit::kOwn);
        EXPECT_EQ(moge.input.scale, 255);
        EXPECT_EQ(moge.input.mean, (std::array<double, 3>{}));
        EXPECT_EQ(moge.input.tokens, 3600);
        const PresetOutput& depth = *moge.find(data::MapKind::kDepth);
        EXPECT_EQ(depth.depth, DepthOf::kPoints);
        EXPECT_EQ(depth.name + depth.scale + depth.mask, "pointsmetric_scale|scalemask");
        EXPECT_TRUE(depth.channels_last);
        const PresetOutput& normal = *moge.find(data::MapKind::kNormal);
        EXPECT_EQ(normal.name, "normal");
        EXPECT_TRUE(normal.channels_last);
        const PresetOutput& mask = *moge.find(data::MapKind::kMask);
        EXPECT_EQ(mask.name, "mask");
        EXPECT_FALSE(mask.sigmoid) << "it is inside the model";
        EXPECT_EQ(mask.threshold, 127);
    }
}

TEST(Preset, AModelMayHaveAnotherForm) {
    EXPECT_EQ(need(preset_of_file("a/moge-2-vitb-normal.onnx")).name, "moge-2-vitb");
    EXPECT_EQ(need(preset_of_file("a/moge-2-vitb-normal.pt")).name, "moge-2-vitb-normal");
    EXPECT_EQ(need(preset_of_file("moge-2-vits-normal.safetensors")).maps(), 7U);
    const std::string folder = testing::TempDir() + "preset_forms";
    std::filesystem::create_directories(folder);
    test::set_variable("SPLAT_PRIORS_DIR", folder.c_str());
    const Preset moge = preset_of("moge-2-vits-normal").value();
    EXPECT_EQ(preset_path(moge), folder + "/moge-2-vits-normal.pt");
    std::ofstream(folder + "/moge-2-vits-normal.safetensors") << "x";
    EXPECT_EQ(preset_path(moge), folder + "/moge-2-vits-normal.safetensors");
    EXPECT_EQ(preset_path(preset_of("moge-2-vits").value()), folder + "/moge-2-vits-normal.onnx");
    std::ofstream(folder + "/moge-2-vits-normal.pt") << "x";
    EXPECT_EQ(preset_path(moge), folder + "/moge-2-vits-normal.pt");
    std::filesystem::remove_all(folder);
    test::unset_variable("SPLAT_PRIORS_DIR");
}

TEST(Preset, OneOfTheCallersOwnIsJson) {
    const auto own =
        need(preset_of("  " + changed("\"index\": 0", "\"index\": -1, \"threshold\": 9")));
    EXPECT_EQ(own.input.height, 6U);
    EXPECT_EQ(own.outputs[0].index, -1);
    EXPECT_EQ(own.outputs[0].threshold, 9);
}

TEST(Preset, SaysWhatIsWrong) {
    const struct {
        const char *from, *to, *part;
    } cases[] = {
        {"\"name\": \"own\"", "\"name\": \"\"", "needs a text 'name'"},
        {"\"name\": \"own\"", "\"nam\": \"own\"", "unknown member 'nam'; did you mean 'name'?"},
        {"\"stretch\"", "\"streched\"", "the fit 'streched', expected one of stretch, minimal"},
        {"\"cubic\"", "\"qubic\"", "the filter 'qubic', expected one of nearest"},
        {"[8, 6]", "[8, 6.5]", "'size' of two whole numbers"},
        {"[8, 6]", "[8, 99999]", "'size' of two whole numbers"},
        {"[1, 1, 1]", "[1, 0, 1]", "above 0 in 'std'"},
        {"[1, 1, 1]", "[1, 1]", "'std' of 3 numbers"},
        {"255", "0", "number 'scale'"},
        {"255", "\"most\"", "number 'scale'"},
        {"\"mask\"", "\"edges\"", "the map 'edges', expected one of depth, normal, mask"},
        {"\"index\": 0", "\"signs\": [1, 1, 1]", "'signs', which goes with normals"},
        {"\"index\": 0", "\"depth\": \"inverse\"", "'depth', which goes with depth"},
        {"\"index\": 0", "\"sigmoid\": 1", "true or false for 'sigmoid'"},
        {"\"index\": 0", "\"threshold\": 256", "number 'threshold' from 0 to 255"},
        {"[{\"map\"", "[{\"map\": \"mask\", \"filter\": \"cubic\"}, {\"map\"", "a second mask map"},
        {"\"stretch\"", "\"own\"", "has a 'size', but its fit is 'own'"},
        {"\"outputs\": [", "\"outputs\": 1, \"x\": [", "unknown member 'x'"},
        {"{\"layout\"", "[{\"layout\"", "preset"},
    };
    for (const auto& one : cases)
        EXPECT_ERROR(preset_of(changed(one.from, one.to)), Code::kInvalidArgument, one.part);
    EXPECT_ERROR(preset_of("{"), Code::kInvalidArgument, "preset");
    EXPECT_ERROR(preset_of("u2nte"), Code::kNotFound, "did you mean 'u2net'?");
    EXPECT_ERROR(preset_of("segment"), Code::kNotFound, "expected birefnet, ");
}

TEST(Preset, IsFoundByTheNameOfItsFile) {
    EXPECT_EQ(preset_of_file("/models/u2net.onnx").value().name, "u2net");
    EXPECT_ERROR(preset_of_file("/models/net.onnx"), Code::kNotFound, "'net.onnx'");
}

TEST(Preset, ModelsLieInTheFolderOfTheEnvironment) {
    const char* const names[] = {"SPLAT_PRIORS_DIR", "XDG_DATA_HOME", "HOME", "LOCALAPPDATA"};
    std::vector<std::string> before;
    for (const char* name : names) before.emplace_back(getenv(name) == nullptr ? "" : getenv(name));
    test::unset_variable("SPLAT_PRIORS_DIR");
#if defined(_WIN32)
    test::set_variable("LOCALAPPDATA", "C:/l");
    EXPECT_EQ(models_folder(), "C:/l/libsplat/priors");
#else
    test::set_variable("HOME", "/h");
    test::unset_variable("XDG_DATA_HOME");
    EXPECT_EQ(models_folder(), "/h/.local/share/libsplat/priors");
    test::set_variable("XDG_DATA_HOME", "/x");
    EXPECT_EQ(models_folder(), "/x/libsplat/priors");
#endif
    test::set_variable("SPLAT_PRIORS_DIR", "/p");
    EXPECT_EQ(models_folder(), "/p");
    for (std::size_t i = 0; i < before.size(); ++i) test::set_variable(names[i], before[i]);
}

}  // namespace
}  // namespace splat::prior_models
