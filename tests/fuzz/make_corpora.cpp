// Writes the small files that fuzzing starts from: `make_corpora <folder>`. They are kept in
// corpora/; run it again when a format gets a new writer.

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string>

#include "io/animation.h"
#include "io/file.h"
#include "io/npy.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "io/sample_webp.h"
#include "io/sample_weights.h"
#include "io/scene_formats.h"
#include "io/scenes/sample_gltf.h"
#include "io/transforms_json.h"
#include "io/weights_formats.h"
#include "scene/arrays.h"
#include "scene/orbit.h"

namespace {

using namespace splat;

class Corpora {
  public:
    explicit Corpora(std::string folder) : folder_(std::move(folder)) {}

    void add(const std::string& name, const Result<io::Buffer>& file) {
        const std::string path = folder_ + "/" + name;
        std::filesystem::create_directories(std::filesystem::path(path).parent_path());
        const Status status = file.ok() ? io::write_file(path, file.value()) : file.status();
        if (status.ok()) return;
        std::fprintf(stderr, "%s: %s\n", name.c_str(), status.message().c_str());
        good_ = false;
    }
    [[nodiscard]] bool good() const { return good_; }

  private:
    std::string folder_;
    bool good_ = true;
};

io::Buffer ascii_ply() {
    std::string text = "ply\nformat ascii 1.0\nelement vertex 1\n";
    for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0",
                             "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
        text += std::string("property double ") + name + "\n";
    text += "property list uchar int extra\nelement face 1\nproperty uchar a\nend_header\n";
    return test::bytes_of(text + "1 2 3 0.5 nan 0 -1 -3 -4 -5 1 0 0 0 2 7 8\n9\n");
}

io::Buffer colmap(const io::Buffer& cameras, const io::Buffer& images) {
    io::Buffer file;
    io::put(file, static_cast<std::uint32_t>(cameras.size()));
    io::put_bytes(file, cameras);
    io::put_bytes(file, images);
    return file;
}

io::Image image(std::uint32_t channels, std::uint32_t bits) {
    io::Image result{3, 2, channels, bits, {}};
    for (std::uint32_t i = 0; i < 6 * channels; ++i)
        result.samples.push_back(static_cast<std::uint16_t>(i * 13 % 256));
    return result;
}

void add_scenes(Corpora& corpora) {
    io::SaveOptions newer;
    newer.spz_version = 4;
    for (std::uint32_t degree = 0; degree <= 3; ++degree) {
        const auto scene = test::sample_scene(2, degree);
        const std::string name = "degree" + std::to_string(degree);
        corpora.add("ply/" + name, io::write_ply(scene));
        corpora.add("ply/packed-" + name, io::write_compressed_ply(scene));
        corpora.add("spz/v3-" + name, io::write_spz(scene));
        corpora.add("spz/v4-" + name, io::write_spz(scene, newer));
        auto zeros = scene::make_gaussians(2, degree);  // their codebooks are short
        zeros.rotations[0] = zeros.rotations[4] = 1;
        corpora.add("sog/" + name, io::write_sog(zeros));
    }
    corpora.add("ply/ascii", ascii_ply());
    for (const std::size_t rest : {0U, 9U})
        corpora.add("ply/compressed" + std::to_string(rest),
                    test::sample_compressed_ply({rest == 0, rest, "1", "2", "2"}));
    auto drawn = test::sample_scene(1, 0);
    drawn.drawn_as = {.antialiased = true, .linear_colors = true};
    corpora.add("ply/drawn", io::write_ply(drawn));
    corpora.add("splat/two", io::write_splat(test::sample_scene(2, 0)));
    for (std::uint16_t level = 0; level <= 2; ++level)
        corpora.add("ksplat/level" + std::to_string(level), test::sample_ksplat(level, {2}));
    corpora.add("scene_file/ksplat", test::sample_ksplat(0, {0}));
    corpora.add("ksplat/sections", test::sample_ksplat(1, {1, 0}));
}

/// Files of this program, and others with all that a document may have.
void add_gltf(Corpora& corpora) {
    for (const std::uint32_t degree : {0U, 1U}) {
        const std::string name = "degree" + std::to_string(degree);
        corpora.add("gltf/glb-" + name, io::write_glb(test::sample_scene(1, degree)));
        corpora.add("gltf/text-" + name, io::write_gltf(test::sample_scene(1, degree)));
    }
    corpora.add("gltf/empty", io::write_glb({}));
    corpora.add("scene_file/glb", io::write_glb(test::sample_scene(1, 0)));
    corpora.add("scene_file/gltf", io::write_gltf(test::sample_scene(1, 0)));
    const auto add = [&](const std::string& name, const test::SampleGltf& sample) {
        corpora.add("gltf/" + name, sample.glb());
    };
    test::SampleGltf bytes = test::sample_gltf();
    bytes.add<std::uint8_t>(test::gltf_attribute("OPACITY"), {51, 255}, test::kGltfUbyte, "SCALAR",
                            1, true);
    bytes.add<std::uint16_t>(test::gltf_attribute("SCALE"), {1, 2, 3, 4, 5, 6}, test::kGltfUshort,
                             "VEC3", 3);
    bytes.add<std::int8_t>(test::gltf_attribute("ROTATION"), {0, 90, 0, 90, 0, 0, -128, 0},
                           test::kGltfByte, "VEC4", 4, true);
    add("integers", bytes);
    test::SampleGltf nodes = test::sample_gltf();
    nodes.nodes = R"([{"mesh":0,"scale":[2,1,3],"children":[1]},{"rotation":[0.6,0,0,0.8],)"
                  R"("translation":[1,2,3],"mesh":0,"children":[2]},{"matrix":)"
                  R"([2,0,0,0,0,2,0,0,0,0,2,0,5,6,7,1],"mesh":0}])";
    add("nodes", nodes);
    test::SampleGltf sparse = test::sample_gltf();
    sparse.add<std::uint16_t>("", {1}, test::kGltfUshort, "SCALAR", 1);
    sparse.add<float>("", {7, 8, 9}, test::kGltfFloat, "VEC3", 3);
    sparse.accessors[0] =
        R"({"componentType":5126,"count":2,"type":"VEC3","sparse":{"count":1,"indices":)"
        R"({"bufferView":5,"componentType":5123},"values":{"bufferView":6}}})";
    add("sparse", sparse);
    test::SampleGltf more = test::sample_gltf();
    more.used = R"("extensionsUsed":["KHR_gaussian_splatting","KHR_mesh_quantization"])";
    more.more = R"(,"extras":1,"cameras":[{}],"extensionsRequired":["KHR_materials_unlit"])";
    more.buffer = R"(,"uri":"data:;base64,AAAA")";
    add("more", more);
    test::SampleGltf beside = test::sample_gltf();
    beside.buffer = R"(,"uri":"a%20b.bin")";
    corpora.add("gltf/beside", test::bytes_of(beside.json()));
}

/// The first two thirds of a file.
io::Buffer cut(const Result<io::Buffer>& file) {
    if (!file.ok()) return {};
    const auto& bytes = file.value();
    return {bytes.begin(), bytes.begin() + std::ssize(bytes) * 2 / 3};
}

/// Two triangles of a square, with normals, texture coordinates and colours.
test::SampleGltf square(const std::vector<std::uint16_t>& indices = {0, 1, 2, 0, 2, 3}) {
    test::SampleGltf sample;
    sample.used = R"("extensionsUsed":["KHR_texture_transform"])";
    sample.add<float>("POSITION", {0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1}, test::kGltfFloat, "VEC3",
                      3);
    const int corners = sample.add<std::uint16_t>("", indices, test::kGltfUshort, "SCALAR", 1);
    sample.primitive = R"("mode":4,"material":0,"indices":)" + std::to_string(corners);
    sample.add<std::int8_t>("NORMAL", {0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0},
                            test::kGltfByte, "VEC3", 4, true);
    sample.views.back().insert(sample.views.back().size() - 1, R"(,"byteStride":4)");
    sample.add<float>("TEXCOORD_0", {0, 0, 1, 0, 1, 1, 0, 1}, test::kGltfFloat, "VEC2", 2);
    sample.add<std::uint8_t>("COLOR_0", {255, 0, 0, 255, 0, 255, 0, 99, 0, 0, 255, 0, 9, 9, 9, 9},
                             test::kGltfUbyte, "VEC4", 4, true);
    sample.more = R"(,"materials":[{"alphaMode":"MASK","doubleSided":true,"pbrMetallicRoughness":)"
                  R"({"baseColorFactor":[1,0.5,0,1],"baseColorTexture":{"index":0,"extensions":)"
                  R"({"KHR_texture_transform":{"rotation":1,"scale":[2,1],"offset":[0,1]}}}}}],)"
                  R"("samplers":[{"wrapS":33071,"magFilter":9728}],)"
                  R"("textures":[{"source":0,"sampler":0}],"images":[{"bufferView":5}])";
    const auto png = io::write_png({1, 1, 3, 8, {1, 2, 3}});
    if (png.ok()) sample.add("", png.value(), test::kGltfUbyte, "SCALAR", 1);
    return sample;
}

void add_meshes(Corpora& corpora) {
    const auto add = [&](const std::string& name, const test::SampleGltf& sample) {
        corpora.add("gltf_mesh/" + name, sample.glb());
    };
    add("square", square());
    corpora.add("gltf_mesh/text", square().gltf());
    test::SampleGltf nodes = square();
    nodes.nodes =
        R"([{"mesh":0,"scale":[2,1,-3],"children":[1]},{"translation":[1,2,3],"mesh":0}])";
    add("nodes", nodes);
    test::SampleGltf strip = square({0, 1, 3, 2});
    strip.primitive.replace(strip.primitive.find("4"), 1, "5");
    strip.mesh =
        R"(,{"attributes":{"POSITION":0},"mode":6},{"attributes":{"POSITION":0},"mode":0})";
    add("strip", strip);
    test::SampleGltf quantized = square();
    quantized.used = R"("extensionsUsed":["KHR_mesh_quantization"])";
    quantized.add<std::int16_t>("POSITION", {0, 0, 0, 0, 9, 0, 0, 0, 9, 9, 0, 0, 0, 9, 0, 0},
                                test::kGltfShort, "VEC3", 4, true);
    quantized.views.back().insert(quantized.views.back().size() - 1, R"(,"byteStride":8)");
    add("quantized", quantized);
    add("damaged-index", square({0, 1, 2, 0, 2, 4}));
    add("damaged-corners", square({0, 1, 2, 3}));
    test::SampleGltf lies = square();
    lies.accessors[0] = R"({"componentType":5126,"count":4000000,"type":"VEC3"})";
    add("damaged-count", lies);
    corpora.add("gltf_mesh/damaged-cut", cut(square().glb()));
}

void add_cameras(Corpora& corpora) {
    const auto cameras =
        scene::orbit(test::sample_scene(2, 0), {.count = 2, .width = 8, .height = 6});
    if (cameras.ok())
        corpora.add("transforms_json/orbit", io::write_transforms_json(cameras.value()));
    corpora.add(
        "transforms_json/angle",
        test::bytes_of(R"({"camera_angle_x": 1, "w": 4, "h": 4, "k1": 0, "frames": [{"file_path":)"
                       R"("a", "transform_matrix": [[1,0,0,5],[0,1,0,6],[0,0,1,7]]}]})"));
    corpora.add("colmap/text",
                colmap(test::bytes_of(test::kColmapCameras), test::bytes_of(test::kColmapImages)));
    corpora.add("colmap/binary",
                colmap(test::sample_colmap_cameras(), test::sample_colmap_images()));
}

void add_images(Corpora& corpora) {
    for (std::uint32_t channels = 1; channels <= 4; ++channels)
        corpora.add("png/channels" + std::to_string(channels), io::write_png(image(channels, 8)));
    corpora.add("png/gray16", io::write_png(image(1, 16)));
    corpora.add("png/animated", io::write_apng({image(3, 8), image(3, 8)}));
    corpora.add("webp/groups", test::sample_webp_groups(3, 2));
    corpora.add("npy/matrix", io::write_npy({{2, 3}, {1, 2, 3, 4, 5, 6}}));
    corpora.add("npy/number", io::write_npy({{}, {1}}));
}

/// A checkpoint with all that it may hold beside weights.
std::string checkpoint_pickle() {
    test::PickleText p;
    const auto tensor = [&p] { p.tensor("FloatStorage", "0", 2, 0, {2}, {1}); };
    p.raw("}q\x01(").text("iteration").integer(70000).text("loss").real(0.5).text("state_dict");
    p.global("collections", "OrderedDict").raw(")R(").text("w");
    p.global("torch._utils", "_rebuild_parameter").raw("(");
    tensor();
    p.raw("\x89Nt").raw("Ru").text("optimizer_state_dict").raw("}(").text("state").raw("}");
    p.integer(0).raw("}(").text("step").real(3).text("exp_avg");
    tensor();
    p.text("exp_avg_sq");
    tensor();
    p.raw("us").text("param_groups").raw("]}(").text("lr").real(1e-3).text("eps").real(1e-8);
    p.text("weight_decay")
        .integer(0)
        .text("betas")
        .real(0.9)
        .real(0.999)
        .raw("\x86")
        .text("params");
    return p.raw("](").integer(0).raw("euauu").done();
}

void add_weights(Corpora& corpora) {
    const io::NamedTensors tensors = test::sample_tensors();
    for (const bool half : {false, true}) {
        const std::string name = half ? "half" : "float";
        const auto safetensors = io::write_safetensors(tensors, {{"k", "v"}}, half);
        const auto npz = io::write_npz(tensors, half);
        if (!safetensors.ok() || !npz.ok()) continue;
        corpora.add("safetensors/" + name, safetensors.value().joined());
        corpora.add("npz/" + name, npz.value().joined());
    }
    corpora.add("npz/deflated", test::sample_zip({{"a.npy", "none", true}, {"b", "x"}}));
    auto wide = test::ZipPart("a", "text", true);
    wide.zip64 = true;
    test::ZipEnd end;
    end.zip64 = true;
    corpora.add("npz/zip64", test::sample_zip({wide}, end));
    corpora.add("pth/two", test::sample_pth());
    corpora.add("pth/checkpoint", test::sample_pth(checkpoint_pickle(), {"12345678"}));
    corpora.add("pth/legacy", test::sample_legacy_pth());
    corpora.add("pth/pickle", test::bytes_of(checkpoint_pickle()));
    corpora.add("pth/system",
                test::bytes_of(test::PickleText().global("os", "system").raw(")R").done()));
    corpora.add("config/yaml", test::bytes_of("# c\na:\n  b: [1, 2.5e-3, x]\n  'c': |\n    t\nd:\n"
                                              "- e: ~\n- yes\nf: {g: -.inf, h: \"q\"}\n"));
    corpora.add("config/json",
                test::bytes_of(R"({"a": {"b": [1, -2.5, "x"]}, "c": [{"d": null}]})"));
    corpora.add("config/alias", test::bytes_of("a: &x {b: 1}\nc: *x\n<<: *x\n? [k]\n: !!str v\n"));
}

// Damaged files: cut short, with wrong counts, an unknown mark, or invalid numbers. Fuzzing starts close
// to the checks that refuse them.

/// The bytes of `value` from `at` on.
template <class T>
io::Buffer patched(const Result<io::Buffer>& file, std::size_t at, T value) {
    io::Buffer bytes = file.ok() ? file.value() : io::Buffer();
    if (bytes.size() >= at + sizeof value) std::memcpy(bytes.data() + at, &value, sizeof value);
    return bytes;
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

void add_damaged_scenes(Corpora& corpora) {
    const auto scene = test::sample_scene(2, 0);
    const auto ply = io::write_ply(scene);
    io::SaveOptions newer;
    newer.spz_version = 4;
    const auto spz3 = io::write_spz(scene);
    const auto spz4 = io::write_spz(scene, newer);
    const auto splat = io::write_splat(scene);
    constexpr std::size_t kCount = 8;  ///< place of the number of Gaussians in the header of .spz

    corpora.add("ply/damaged-cut", cut(ply));
    corpora.add("ply/damaged-mark", patched(ply, 0, 'x'));
    if (ply.ok()) {
        const std::size_t count = io::as_text(ply.value()).find("vertex 2") + 7;
        corpora.add("ply/damaged-count", patched(ply, count, '9'));
    }
    auto with_nan = scene;
    with_nan.means[1] = with_nan.rotations[2] = kNan;
    corpora.add("ply/damaged-nan", io::write_ply(with_nan));
    corpora.add("ply/damaged-chunks", test::sample_compressed_ply({true, 0, "1", "300", "2"}));
    // 20: the level; 4096: the header of the first section, whose Gaussians and buckets are counted there.
    const io::Buffer ksplat = test::sample_ksplat(1, {1});
    corpora.add("ksplat/damaged-cut", cut(ksplat));
    corpora.add("ksplat/damaged-level", patched(ksplat, 20, std::uint16_t{0}));
    corpora.add("ksplat/damaged-room", patched(ksplat, 4096 + 4, 4095U));
    corpora.add("ksplat/damaged-buckets", patched(ksplat, 4096 + 8, 1U));
    corpora.add("splat/damaged-cut", cut(splat));
    corpora.add("splat/damaged-nan", patched(splat, 0, kNan));
    corpora.add("spz/damaged-v3-cut", cut(spz3));
    corpora.add("spz/damaged-v4-cut", cut(spz4));
    corpora.add("spz/damaged-mark", patched(spz4, 0, 'x'));
    corpora.add("spz/damaged-version", patched(spz4, 4, std::uint32_t{5}));
    corpora.add("spz/damaged-count", patched(spz4, kCount, std::uint32_t{4096}));
    corpora.add("gltf/damaged-cut", cut(io::write_glb(scene)));
    const auto glb = io::write_glb(scene);
    corpora.add("gltf/damaged-version", patched(glb, 4, std::uint32_t{1}));
    corpora.add("gltf/damaged-length", patched(glb, 12, ~std::uint32_t{3}));
    auto lies = test::sample_gltf();
    lies.accessors[0] =
        R"({"bufferView":0,"componentType":5126,"count":9007199254740992,"type":"VEC3"})";
    corpora.add("gltf/damaged-count", lies.glb());
    lies = test::sample_gltf();
    lies.length = 4294967296;
    corpora.add("gltf/damaged-bytes", lies.glb());
    lies = test::sample_gltf();
    lies.nodes = R"([{"children":[1]},{"children":[0]}])";
    corpora.add("gltf/damaged-nodes", lies.glb());
    io::Buffer bare;  // version 2 without gzip, and without its arrays
    io::put(bare, std::uint32_t{0x5053474E});
    for (const std::uint32_t word : {2U, 4095U, 0x00000C03U}) io::put(bare, word);
    corpora.add("spz/damaged-bare", bare);
}

void add_damaged_cameras(Corpora& corpora) {
    const std::string pose = R"("transform_matrix": [[1,0,0,5],[0,1,0,6],[0,0,1,7]])";
    const auto json = [&](const std::string& name, const std::string& text) {
        corpora.add("transforms_json/damaged-" + name, test::bytes_of(text));
    };
    json("cut", R"({"fl_x": 9, "w": 4, "h": 4, "frames": [{)" + pose);
    json("list", "[1, 2]");
    json("size", R"({"fl_x": 9, "w": 1e9, "h": -4, "frames": [{)" + pose + "}]}");
    json("infinite", R"({"fl_x": 1e999, "w": 4, "h": 4, "frames": [{)" + pose + "}]}");
    json("singular",
         R"({"fl_x": 9, "frames": [{"transform_matrix": [[0,0,0,0],[0,0,0,0],[0,0,0,0]]}]})");
    json("lens", R"({"fl_x": 9, "k1": 0.5, "p2": 1e300, "frames": [{)" + pose + "}]}");

    const io::Buffer cameras = test::sample_colmap_cameras();
    const io::Buffer images = test::sample_colmap_images();
    const auto both = [&](const std::string& name, const io::Buffer& first,
                          const io::Buffer& second) {
        corpora.add("colmap/damaged-" + name, colmap(first, second));
    };
    both("cut", cameras, cut(images));
    both("counts", patched<std::uint64_t>(cameras, 0, ~0ULL), images);
    both("more-images", cameras, patched<std::uint64_t>(images, 0, 1000));
    // After the count: the id of the image, and its rotation.
    both("nan", cameras, patched(images, 12, std::numeric_limits<double>::quiet_NaN()));
    both("text-nan", test::bytes_of(test::kColmapCameras),
         test::bytes_of("1 nan 0 0 0 1 2 inf 1 a.png\n\n"));
    both("text-model", test::bytes_of("1 FISHEYE 64 48 50 50 32 24\n"),
         test::bytes_of(test::kColmapImages));
}

void add_damaged_archives(Corpora& corpora) {
    const io::NamedTensors tensors = test::sample_tensors();
    const auto npz = io::write_npz(tensors, false);
    if (npz.ok()) corpora.add("npz/damaged-cut", cut(npz.value().joined()));
    corpora.add("npz/damaged-count", test::sample_zip({{"a", "x"}}, {.more_entries = 60000}));
    corpora.add("npz/damaged-place", test::sample_zip({{"a", "x"}}, {.shift = 1000}));
    auto wrong = test::ZipPart("a.npy", "none", true);
    wrong.crc ^= 1U;
    corpora.add("npz/damaged-sum", test::sample_zip({wrong}));
    auto large = test::ZipPart("a.npy", "none", true);
    large.bytes = large.local_bytes = 0xFFFFFFF0U;
    corpora.add("npz/damaged-size", test::sample_zip({large}));
    corpora.add("pth/damaged-cut", cut(test::sample_pth()));
    corpora.add("pth/damaged-legacy-cut", cut(test::sample_legacy_pth()));
    test::LegacyPth legacy = test::legacy_parts();
    legacy.counts[1] = ~0ULL;
    corpora.add("pth/damaged-legacy-count", test::sample_legacy_pth(legacy));
    legacy = test::legacy_parts();
    legacy.keys[0] = "8";
    corpora.add("pth/damaged-legacy-keys", test::sample_legacy_pth(legacy));
    corpora.add("pth/damaged-storage", test::sample_pth(checkpoint_pickle(), {"1234"}));
    corpora.add("pth/damaged-pickle", cut(test::bytes_of(checkpoint_pickle())));
    corpora.add("pth/damaged-strides",
                test::sample_pth(test::PickleText()
                                     .raw("}(")
                                     .text("w")
                                     .tensor("FloatStorage", "0", 2, 1, {2, 1000000}, {1, -1})
                                     .raw("u")
                                     .done(),
                                 {"12345678"}));
}

void add_damaged_weights(Corpora& corpora) {
    const io::NamedTensors tensors = test::sample_tensors();
    const auto safetensors = io::write_safetensors(tensors, {}, false);
    if (safetensors.ok()) {
        const io::Buffer file = safetensors.value().joined();
        corpora.add("safetensors/damaged-cut", cut(file));
        corpora.add("safetensors/damaged-header", patched<std::uint64_t>(file, 0, ~0ULL >> 1U));
        corpora.add("safetensors/damaged-nan", patched(file, file.size() - 4, kNan));
    }
    const auto header = [&](const std::string& name, const std::string& text) {
        corpora.add("safetensors/damaged-" + name, test::sample_safetensors(text, 8));
    };
    header("offsets", R"({"a": {"dtype": "F32", "shape": [2], "data_offsets": [4, 12]}})");
    header("backwards", R"({"a": {"dtype": "F32", "shape": [2], "data_offsets": [8, 0]}})");
    header("shape",
           R"({"a": {"dtype": "F32", "shape": [4294967296, 4294967296], "data_offsets": [0, 8]}})");
    const auto npy = io::write_npy({{2, 3}, {1, 2, kNan, 4, 5, 6}});
    corpora.add("npy/damaged-nan", npy);
    corpora.add("npy/damaged-cut", cut(npy));
    corpora.add("npy/damaged-mark", patched(npy, 1, 'n'));
    corpora.add("npy/damaged-header", patched(npy, 8, std::uint16_t{0xFFFF}));
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
        return 2;
    }
    Corpora corpora(argv[1]);
    add_scenes(corpora);
    add_gltf(corpora);
    add_meshes(corpora);
    add_cameras(corpora);
    add_images(corpora);
    add_weights(corpora);
    add_damaged_scenes(corpora);
    add_damaged_cameras(corpora);
    add_damaged_archives(corpora);
    add_damaged_weights(corpora);
    return corpora.good() ? 0 : 1;
}
