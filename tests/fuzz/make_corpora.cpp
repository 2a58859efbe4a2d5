// Writes the small files that fuzzing starts from: `make_corpora <folder>`. They are kept in
// corpora/; run it again when a format gets a new writer.

#include <cstdio>
#include <filesystem>
#include <string>

#include "io/apng.h"
#include "io/file.h"
#include "io/npy.h"
#include "io/npz.h"
#include "io/ply.h"
#include "io/safetensors.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "io/sample_weights.h"
#include "io/splat_file.h"
#include "io/spz.h"
#include "io/transforms_json.h"
#include "scene/camera_pose.h"

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
        corpora.add("spz/v3-" + name, io::write_spz(scene));
        corpora.add("spz/v4-" + name, io::write_spz(scene, newer));
    }
    corpora.add("ply/ascii", ascii_ply());
    for (const std::size_t rest : {0U, 9U})
        corpora.add("ply/compressed" + std::to_string(rest),
                    test::sample_compressed_ply({rest == 0, rest, "1", "2", "2"}));
    corpora.add("splat/two", io::write_splat(test::sample_scene(2, 0)));
}

void add_cameras(Corpora& corpora) {
    scene::Statistics around;
    around.radius = 1;
    const auto cameras = scene::orbit(around, {.count = 2, .width = 8, .height = 6});
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
    corpora.add("npy/matrix", io::write_npy({{2, 3}, {1, 2, 3, 4, 5, 6}}));
    corpora.add("npy/number", io::write_npy({{}, {1}}));
}

/// A checkpoint with everything that one has beside weights.
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
    corpora.add("pth/pickle", test::bytes_of(checkpoint_pickle()));
    corpora.add("pth/system",
                test::bytes_of(test::PickleText().global("os", "system").raw(")R").done()));
    corpora.add("config/yaml", test::bytes_of("# c\na:\n  b: [1, 2.5e-3, x]\n  'c': |\n    t\nd:\n"
                                              "- e: ~\n- yes\nf: {g: -.inf, h: \"q\"}\n"));
    corpora.add("config/json",
                test::bytes_of(R"({"a": {"b": [1, -2.5, "x"]}, "c": [{"d": null}]})"));
    corpora.add("config/alias", test::bytes_of("a: &x {b: 1}\nc: *x\n<<: *x\n? [k]\n: !!str v\n"));
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
        return 2;
    }
    Corpora corpora(argv[1]);
    add_scenes(corpora);
    add_cameras(corpora);
    add_images(corpora);
    add_weights(corpora);
    return corpora.good() ? 0 : 1;
}
