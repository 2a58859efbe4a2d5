// Models and libraries that must be refused with a sentence.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "prior_models/onnx/sample_models.h"
#include "prior_models/onnx_runtime.h"
#include "prior_models/prior_model.h"
#include "support/expect_status.h"
#include "support/system.h"

namespace splat::prior_models {
namespace {

using test::kOnnxFloat;

constexpr const char* kOwnPreset =
    R"({"name": "own", "input": {"fit": "stretch", "size": [8, 6], "filter": "cubic"},)"
    R"( "outputs": [{"map": "mask", "index": 0, "filter": "linear"}]})";

Status load_bytes_of(const std::string& bytes) {
    const std::string path = testing::TempDir() + "refused.onnx";
    std::ofstream(path, std::ios::binary) << bytes;
    return PriorModel::create({kOwnPreset, path, "", 1}).status();
}

Status load_graph(const test::OnnxGraph& graph) {
    return load_bytes_of(graph.file());
}

/// x [1,3,6,8] to y, the first channel.
test::OnnxGraph good_graph() {
    test::OnnxGraph graph;
    graph.input("x", kOnnxFloat, {1, 3, 6, 8});
    graph.floats("w", {1, 3, 1, 1}, {1, 0, 0}).node("Conv", {"x", "w"}, "y");
    graph.output("y", kOnnxFloat, {1, 1, 6, 8});
    return graph;
}

TEST(RefusedModel, TruncatedFiles) {
    const std::string file = good_graph().file();
    ASSERT_OK(load_bytes_of(file));
    for (std::size_t size = 0; size + 3 < file.size();
         ++size)  // the last field is the opset's number
        EXPECT_ERROR(load_bytes_of(file.substr(0, size)), Code::kFormat, "refused.onnx': ") << size;
    EXPECT_ERROR(load_bytes_of(std::string(4096, '\xff')), Code::kFormat,
                 "ONNX Runtime refuses the model");
    EXPECT_ERROR(load_bytes_of("not a model"), Code::kFormat, "ONNX Runtime refuses the model");
}

TEST(RefusedModel, FilesWithOneByteChanged) {
    // Any outcome but a crash; those that load may also run.
    const std::string file = good_graph().file();
    for (std::size_t i = 0; i < file.size(); ++i)
        for (const char flip : {'\x01', '\x80', '\x7f'}) {
            std::string bytes = file;
            bytes[i] = static_cast<char>(bytes[i] ^ flip);
            const Status status = load_bytes_of(bytes);
            EXPECT_TRUE(status.ok() || status.code() == Code::kFormat ||
                        status.code() == Code::kOutOfHostMemory)
                << status.message();
        }
}

TEST(RefusedModel, GraphsThatLie) {
    test::OnnxGraph weights;
    weights.input("x", kOnnxFloat, {1, 3, 6, 8}).floats("w", {1, 3000000, 1, 1}, {1, 0, 0});
    weights.node("Conv", {"x", "w"}, "y").output("y", kOnnxFloat, {1, 1, 6, 8});
    EXPECT_ERROR(load_graph(weights), Code::kFormat, "ONNX Runtime refuses the model");
    test::OnnxGraph missing;
    missing.input("x", kOnnxFloat, {1, 3, 6, 8}).node("Conv", {"x", "nowhere"}, "y");
    missing.output("y", kOnnxFloat, {1, 1, 6, 8});
    EXPECT_ERROR(load_graph(missing), Code::kFormat, "ONNX Runtime refuses the model");
    test::OnnxGraph unknown;
    unknown.input("x", kOnnxFloat, {1, 3, 6, 8}).node("Segment", {"x"}, "y");
    unknown.output("y", kOnnxFloat, {1, 1, 6, 8});
    EXPECT_ERROR(load_graph(unknown), Code::kFormat, "Segment");
}

TEST(RefusedModel, OtherInputsAndOutputs) {
    const auto graph_with = [](int in, const std::vector<std::int64_t>& dims) {
        test::OnnxGraph graph;
        graph.input("x", in, dims).node("Identity", {"x"}, "y").output("y", in, dims);
        return graph;
    };
    EXPECT_ERROR(load_graph(graph_with(kOnnxFloat, {1, 3, 6})), Code::kFormat,
                 "has the inputs 'x' float32 [1,3,6]; preset 'own' expects float32 or float16 of "
                 "[n,3,height,width]");
    EXPECT_ERROR(load_graph(graph_with(test::kOnnxInt64, {1, 3, 6, 8})), Code::kFormat,
                 "'x' int64");
    EXPECT_ERROR(load_graph(graph_with(test::kOnnxString, {1, 3, 6, 8})), Code::kFormat,
                 "'x' string");
    EXPECT_ERROR(load_graph(graph_with(kOnnxFloat, {1, 4, 6, 8})), Code::kFormat,
                 "[n,3,height,width]");
    EXPECT_ERROR(load_graph(graph_with(kOnnxFloat, {1, 3, 8, 6})), Code::kFormat, "8 x 6 pixels");
    EXPECT_ERROR(load_graph(graph_with(kOnnxFloat, {2, 3, 6, 8})), Code::kFormat,
                 "one picture at a time");
    EXPECT_ERROR(load_graph(graph_with(kOnnxFloat, {1, 3, -1, 8})), Code::kFormat,
                 "both fixed or both free");
    test::OnnxGraph two = good_graph();
    two.input("z", kOnnxFloat, {1});
    EXPECT_ERROR(load_graph(two), Code::kFormat, "preset 'own' expects 1");
    test::OnnxGraph flat;
    flat.input("x", kOnnxFloat, {1, 3, 6, 8})
        .whole("shape", {-1})
        .node("Reshape", {"x", "shape"}, "y");
    flat.output("y", kOnnxFloat, {144});
    EXPECT_ERROR(load_graph(flat), Code::kFormat, "output 'y' is float32 [144]");
    const std::string path = testing::TempDir() + "refused_name.onnx";
    good_graph().save(path);
    const std::string named =
        std::string(kOwnPreset)
            .replace(std::string(kOwnPreset).find("\"index\": 0"), 10, "\"name\": \"m\"");
    EXPECT_ERROR(PriorModel::create({named, path, "", 1}), Code::kFormat,
                 "has the outputs 'y' float32 [1,1,6,8]; preset 'own' expects 'm'");
}

Status run_graph(const test::OnnxGraph& graph) {
    const std::string path = testing::TempDir() + "refused_run.onnx";
    graph.save(path);
    const auto model = need(PriorModel::create({kOwnPreset, path, "", 1}));
    const io::Image picture{8, 6, 3, 8, std::vector<std::uint16_t>(144, 100), 0};
    WantedMaps wanted;
    wanted[data::MapKind::kMask] = MapForm::kBytes;
    return model->run({&picture, 1}, {&wanted, 1}).status();
}

TEST(RefusedModel, OutputsThatAreNotFiniteOrOfAnotherShape) {
    ASSERT_OK(run_graph(good_graph()));
    test::OnnxGraph nan;
    nan.input("x", kOnnxFloat, {1, 3, 6, 8}).node("Sub", {"x", "x"}, "zero");
    nan.node("Div", {"zero", "zero"}, "y").output("y", kOnnxFloat, {1, 3, 6, 8});
    EXPECT_ERROR(run_graph(nan), Code::kInvalidState, "output 'y' is ");
    // The declared sides are free, those of the result are not an image's.
    test::OnnxGraph strip;
    strip.input("x", kOnnxFloat, {1, 3, 6, 8})
        .whole("shape", {-1})
        .node("Reshape", {"x", "shape"}, "row");
    strip.whole("axes", {0})
        .node("Unsqueeze", {"row", "axes"}, "y")
        .output("y", kOnnxFloat, {-1, -1});
    EXPECT_OK(run_graph(strip)) << "[1,144] is an image of one row";
    test::OnnxGraph shape;
    shape.input("x", kOnnxFloat, {1, 3, 6, 8})
        .whole("shape", {1, 1, 7, 7})
        .node("Reshape", {"x", "shape"}, "y");
    shape.output("y", kOnnxFloat, {-1, -1, -1, -1});
    EXPECT_FALSE(load_graph(shape).ok() && run_graph(shape).ok()) << "144 numbers are not 49";
}

TEST(RefusedModel, MapsThatThePresetLacks) {
    const std::string path = testing::TempDir() + "refused_maps.onnx";
    good_graph().save(path);
    const auto model = need(PriorModel::create({kOwnPreset, path, "", 1}));
    const io::Image picture{8, 6, 3, 8, std::vector<std::uint16_t>(144, 100), 0};
    WantedMaps wanted;
    EXPECT_ERROR(model->run({&picture, 1}, {&wanted, 1}), Code::kInvalidArgument, "no map");
    wanted[data::MapKind::kDepth] = MapForm::kUnit;
    EXPECT_ERROR(model->run({&picture, 1}, {&wanted, 1}), Code::kInvalidArgument,
                 "preset 'own' makes no depth map");
}

TEST(OnnxRuntime, IsFoundWhereItIsNamed) {
    const std::string library = std::getenv("SPLAT_ONNXRUNTIME_LIBRARY");
    EXPECT_NE(need(OnnxRuntime::load(library))->version().find('.'), std::string::npos);
    EXPECT_OK(OnnxRuntime::load("")) << "by the environment";
    EXPECT_ERROR(OnnxRuntime::load("/nowhere/libonnxruntime.so"), Code::kNotFound,
                 "the library given is '/nowhere/libonnxruntime.so'");
    test::set_variable("SPLAT_ONNXRUNTIME_LIBRARY", "/nowhere/ort.so");
    EXPECT_ERROR(OnnxRuntime::load(""), Code::kNotFound,
                 "SPLAT_ONNXRUNTIME_LIBRARY is '/nowhere/ort.so'");
    test::unset_variable("SPLAT_ONNXRUNTIME_LIBRARY");
    const auto system = OnnxRuntime::load("");
    if (!system.ok()) {
        EXPECT_ERROR(system, Code::kNotFound, "npm pack onnxruntime-node@1.30.0");
    }
    test::set_variable("SPLAT_ONNXRUNTIME_LIBRARY", library);
}

TEST(OnnxRuntime, RefusesOtherLibraries) {
    const std::string text = testing::TempDir() + "no_library.so";
    std::ofstream(text) << "text";
    EXPECT_ERROR(OnnxRuntime::load(text), Code::kUnsupported, "cannot load ONNX Runtime");
    EXPECT_ERROR(OnnxRuntime::load(SPLAT_OTHER_LIBRARY), Code::kUnsupported, "no OrtGetApiBase");
    EXPECT_ERROR(OnnxRuntime::load(SPLAT_OLD_LIBRARY), Code::kUnsupported,
                 "is ONNX Runtime 1.2.3, expected 1.11 or later");
}

}  // namespace
}  // namespace splat::prior_models
