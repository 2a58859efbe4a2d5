// Scenes through the C API. Most tests need no device.
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>

#include <nlohmann/json.hpp>

#include "api/raster_calls.h"

namespace splat::test {
namespace {

Floats values_of(splat_scene scene, const char* name, std::size_t elements) {
    return floats_of(elements, splat_scene_read, scene, name);
}

splat_scene_file_desc file_desc(splat_scene_format format, std::int32_t degree = 0) {
    auto desc = sized<splat_scene_file_desc>();
    desc.format = format;
    desc.sh_degree = degree;
    return desc;
}

std::string saved(splat_scene scene, const splat_scene_file_desc& desc) {
    return bytes_of(splat_scene_save_memory, scene, desc);
}

Scene loaded(const std::string& file, const splat_scene_file_desc* desc = nullptr) {
    return got(splat_scene_load_memory, file.data(), file.size(), desc);
}

TEST(ApiScene, HoldsWhatItWasMadeOf) {
    const SampleScene sample(7, 2);
    const Scene scene = sample.create();
    EXPECT_EQ(values_of(scene, "means", 21), sample.means);
    EXPECT_EQ(values_of(scene, "log_scales", 21), sample.log_scales);
    EXPECT_EQ(values_of(scene, "rotations", 28), sample.rotations);
    EXPECT_EQ(values_of(scene, "opacity_logits", 7), sample.opacity_logits);
    EXPECT_EQ(values_of(scene, "sh", 7 * 27), sample.sh);
    const Floats scales = values_of(scene, "scales", 21);
    const Floats opacities = values_of(scene, "opacities", 7);
    for (std::size_t i = 0; i < 21; ++i) EXPECT_FLOAT_EQ(scales[i], std::exp(sample.log_scales[i]));
    for (std::size_t i = 0; i < 7; ++i)
        EXPECT_FLOAT_EQ(opacities[i], 1 / (1 + std::exp(-sample.opacity_logits[i])));
    EXPECT_EQ(load_report(scene), "{}") << "it was not loaded";
    const splat_scene_info info = info_of(scene);
    EXPECT_EQ(info.count, 7U);
    EXPECT_EQ(info.sh_degree, 2U);
    EXPECT_EQ(info.non_finite + info.bad_rotations + info.degenerate, 0U);
    EXPECT_LE(info.low[0], info.center[0]);
    EXPECT_GT(info.radius, 0);
    EXPECT_GT(info.scale_min, 0);
    EXPECT_LE(info.opacity_min, info.opacity_mean);
}

TEST(ApiScene, DefaultsAreZerosAndNoTurn) {
    auto desc = sized<splat_scene_desc>();
    desc.count = 2;
    Scene scene = got(splat_scene_create, &desc);
    EXPECT_EQ(values_of(scene, "means", 6), Floats(6));
    EXPECT_EQ(values_of(scene, "rotations", 8), (Floats{1, 0, 0, 0, 1, 0, 0, 0}));
    EXPECT_EQ(values_of(scene, "opacities", 2), (Floats{0.5, 0.5}));
    desc.count = 0;
    ASSERT_DONE(splat_scene_create(&desc, scene.out()));
    EXPECT_EQ(info_of(scene).count, 0U);
    Output<splat_tensor> tensor;
    EXPECT_REFUSED(splat_scene_to_tensor(scene, "sh", shared_device(), tensor.out()), kState,
                   "no Gaussians");
    EXPECT_TRUE(tensor.untouched());
}

TEST(ApiScene, AttributesAreWrittenActivatedOrNot) {
    const Scene scene = SampleScene(2).create();
    const Floats scales = {0.5F, 1, 2, 4, 8, 16};
    EXPECT_DONE(splat_scene_write(scene, "scales", scales.data(), 24));
    const Floats logs = values_of(scene, "log_scales", 6);
    EXPECT_FLOAT_EQ(logs[0], std::log(0.5F));
    EXPECT_EQ(logs[1], 0.0F);
    const float opacities[] = {0.25F, 1};
    EXPECT_DONE(splat_scene_write(scene, "opacities", opacities, 8));
    EXPECT_FLOAT_EQ(values_of(scene, "opacity_logits", 2)[0], std::log(1.0F / 3));
    const Floats before = values_of(scene, "log_scales", 6);
    const Floats bad = {1, 1, 1, 1, 0, 1};
    EXPECT_REFUSED(splat_scene_write(scene, "scales", bad.data(), 24), kArgument,
                   "values[4] of 'scales' is 0, expected > 0");
    EXPECT_EQ(values_of(scene, "log_scales", 6), before);
    const float beyond[] = {0.5F, 1.5F};
    EXPECT_REFUSED(splat_scene_write(scene, "opacities", beyond, 8), kArgument, "values[1]");
}

TEST(ApiScene, AttributesBecomeTensors) {
    const SampleScene sample(5, 1);
    const Scene scene = sample.create();
    const std::pair<const char*, Dims> shapes[] = {
        {"means", {5, 3}}, {"scales", {5, 3}}, {"log_scales", {5, 3}},  {"rotations", {5, 4}},
        {"sh", {5, 4, 3}}, {"opacities", {5}}, {"opacity_logits", {5}},
    };
    for (const auto& [name, dims] : shapes) {
        const Tensor tensor = got(splat_scene_to_tensor, scene, name, shared_device());
        const auto info = got(splat_tensor_get_info, tensor);
        EXPECT_EQ(dims_of(tensor), dims) << name;
        EXPECT_STREQ(info.name, name);
        EXPECT_EQ(download(tensor), values_of(scene, name, info.elements)) << name;
    }
}

TEST(ApiScene, FormatsAreListedByTheirNumbers) {
    const auto list = nlohmann::json::parse(text_of(splat_scene_formats));
    const struct {
        const char* name;
        splat_scene_format id;
        const char* frame;
        bool written;
    } formats[] = {{"ply", SPLAT_SCENE_PLY, "RDF", true},
                   {"compressed ply", SPLAT_SCENE_COMPRESSED_PLY, "RDF", true},
                   {"splat", SPLAT_SCENE_SPLAT, "RDF", true},
                   {"spz", SPLAT_SCENE_SPZ, "RUB", true},
                   {"ksplat", SPLAT_SCENE_KSPLAT, "RDF", false},
                   {"sog", SPLAT_SCENE_SOG, "RDF", true},
                   {"gltf", SPLAT_SCENE_GLTF, "LUF", true},
                   {"glb", SPLAT_SCENE_GLB, "LUF", true}};
    ASSERT_GE(list.size(), std::size(formats));
    for (std::size_t i = 0; i < std::size(formats); ++i) {
        EXPECT_EQ(list[i].at("name"), formats[i].name);
        EXPECT_EQ(list[i].at("id"), formats[i].id);
        EXPECT_EQ(list[i].at("frame"), formats[i].frame);
        EXPECT_EQ(list[i].at("written"), formats[i].written);
        EXPECT_EQ(list[i].at("extension").get<std::string>().front(), '.');
    }
    // The number after the last one is refused.
    Output<splat_scene> out;
    const auto last = static_cast<splat_scene_format>(list.size());
    for (splat_scene_format id = 1; id <= last + 1; ++id) {
        const auto desc = file_desc(id);
        const std::string part = id <= last ? "'memory': " : "format is " + std::to_string(id);
        EXPECT_REFUSED(splat_scene_load_memory("x", 1, &desc, out.out()),
                       id <= last ? kFormat : kArgument, part.c_str());
    }
}

TEST(ApiScene, FilesComeBack) {
    const SampleScene sample(6, 3);
    const Scene scene = sample.create();
    const Scene ply = loaded(saved(scene, file_desc(SPLAT_SCENE_PLY)));
    EXPECT_EQ(values_of(ply, "means", 18), sample.means);
    EXPECT_EQ(values_of(ply, "sh", 6 * 48), sample.sh);
    EXPECT_TRUE(holds(load_report(ply), "\"format\": \"ply\""));
    EXPECT_TRUE(holds(load_report(ply), "\"frame\": \"RDF\""));
    const Scene constant = loaded(saved(scene, file_desc(SPLAT_SCENE_PLY, SPLAT_SH_CONSTANT)));
    EXPECT_EQ(info_of(constant).sh_degree, 0U);
    const auto degree_1 = file_desc(0, 1);
    EXPECT_EQ(info_of(loaded(saved(scene, file_desc(SPLAT_SCENE_PLY)), &degree_1)).sh_degree, 1U);
    auto spz = file_desc(SPLAT_SCENE_SPZ);
    spz.spz_version = 4;
    EXPECT_TRUE(holds(load_report(loaded(saved(scene, spz))), "\"version\": 4"));
    const auto splat = file_desc(SPLAT_SCENE_SPLAT);
    const Scene eight_bits = loaded(saved(scene, splat), &splat);
    EXPECT_EQ(values_of(eight_bits, "means", 18), sample.means);
    auto turned = file_desc(SPLAT_SCENE_PLY);
    turned.frame = SPLAT_FRAME_RUB;
    const Floats means = values_of(loaded(saved(scene, turned)), "means", 18);
    for (std::size_t i = 0; i < 18; ++i)
        EXPECT_EQ(means[i], i % 3 == 0 ? sample.means[i] : -sample.means[i]);
    EXPECT_EQ(values_of(loaded(saved(scene, turned), &turned), "means", 18), sample.means);
}

TEST(ApiScene, FilesBesideAGltfAreReadByItsPath) {
    const SampleScene sample(4);
    const std::string glb = saved(sample.create(), file_desc(SPLAT_SCENE_GLB));
    constexpr std::size_t kStart = 20, kChunk = 8;  // where the JSON is; bytes before each chunk
    std::uint32_t bytes = 0;
    std::memcpy(&bytes, glb.data() + kStart - kChunk, sizeof bytes);
    std::string report = glb.substr(kStart, bytes);
    const std::string buffer = R"("buffers":[{)";
    report.insert(report.find(buffer) + buffer.size(), R"("uri":"a.bin",)");
    const Temporary folder;
    std::ofstream(folder / "a.bin", std::ios::binary) << glb.substr(kStart + bytes + kChunk);
    std::ofstream(folder / "a.gltf", std::ios::binary) << report;
    const Scene by_path = got(splat_scene_load, (folder / "a.gltf").c_str(), nullptr);
    EXPECT_EQ(values_of(by_path, "means", 12), sample.means);
    EXPECT_TRUE(holds(load_report(by_path), R"("drawn_as": ["by distance", "3 sigma"])"));
    const auto as_gltf = file_desc(SPLAT_SCENE_GLTF);
    Output<splat_scene> out;
    EXPECT_REFUSED(splat_scene_load_memory(report.data(), report.size(), &as_gltf, out.out()),
                   kUnsupported, "read it by its path");
}

TEST(ApiScene, AFormatThatIsSaidChoosesTheReader) {
    SampleScene sample(4);
    // The first float of a .splat file is a position. Here its bytes are the magic of gzip.
    sample.means[0] = std::bit_cast<float>(std::uint32_t{0x41008B1F});
    const auto as_splat = file_desc(SPLAT_SCENE_SPLAT);
    const std::string file = saved(sample.create(), as_splat);
    EXPECT_EQ(values_of(loaded(file, &as_splat), "means", 12), sample.means) << "from memory";
    const Temporary path;
    std::ofstream(path.path(), std::ios::binary) << file;
    const Scene by_path = got(splat_scene_load, path.c_str(), &as_splat);
    EXPECT_EQ(values_of(by_path, "means", 12), sample.means) << "by path";
    Output<splat_scene> out;
    EXPECT_REFUSED(splat_scene_load_memory(file.data(), file.size(), nullptr, out.out()), kFormat,
                   "spz");
    EXPECT_TRUE(out.untouched());
}

TEST(ApiScene, RefusesFilesThatAreNot) {
    const Scene scene = SampleScene(4).create();
    Output<splat_scene> out;
    std::string file = saved(scene, file_desc(SPLAT_SCENE_PLY));
    const auto load_refused = [&](std::size_t size, const splat_scene_file_desc* desc,
                                  splat_result code, const char* part) {
        EXPECT_REFUSED(splat_scene_load_memory(file.data(), size, desc, out.out()), code, part);
        EXPECT_TRUE(out.untouched());
    };
    const auto as_spz = file_desc(SPLAT_SCENE_SPZ);
    load_refused(file.size(), &as_spz, kFormat, "ply, expected spz");
    load_refused(file.size() - 1, nullptr, kFormat, "truncated");
    file.push_back('x');
    load_refused(file.size(), nullptr, kFormat, "1 bytes after the last row");
    auto lenient = file_desc(0);
    lenient.flags = SPLAT_SCENE_LENIENT;
    loaded(file, &lenient);
    file.pop_back();
    auto few = file_desc(0);
    few.max_count = 3;
    load_refused(file.size(), &few, kUnsupported, "4");
    std::size_t needed = 77;
    const auto save_refused = [&](const splat_scene_file_desc& desc, splat_result code,
                                  const char* part) {
        EXPECT_REFUSED(splat_scene_save_memory(scene, &desc, nullptr, 0, &needed), code, part);
    };
    save_refused(file_desc(SPLAT_SCENE_KSPLAT), kUnsupported, "read only");
    EXPECT_REFUSED(splat_scene_save_memory(scene, nullptr, nullptr, 0, &needed), kArgument,
                   "format is 0");
    auto old = file_desc(SPLAT_SCENE_SPZ), other = file_desc(SPLAT_SCENE_SPLAT);
    old.spz_version = 2;
    other.spz_version = 4;
    save_refused(old, kArgument, "spz_version is 2");
    save_refused(other, kArgument, "spz_version is 4, but the file is a splat");
    save_refused(file_desc(SPLAT_SCENE_SPLAT, 2), kArgument, "splat holds at most 0");
    EXPECT_EQ(needed, 77U);
}

TEST(ApiScene, PathsAreReadAndWritten) {
    const SampleScene sample(4);
    const Scene scene = sample.create();
    const Temporary folder;
    const std::string path = folder / "scene.ply";
    EXPECT_DONE(splat_scene_save(scene, path.c_str(), nullptr));
    const Scene read = got(splat_scene_load, path.c_str(), nullptr);
    EXPECT_EQ(values_of(read, "means", 12), sample.means);
    EXPECT_REFUSED(splat_scene_save(scene, (folder / "scene.obj").c_str(), nullptr), kUnsupported,
                   ".obj");
}

TEST(ApiScene, IsMovedCutAndMerged) {
    const SampleScene sample(20);
    const Scene scene = sample.create();
    const splat_similarity twice = {{1, 0, 0, 0}, {1, 2, 3}, 2};
    EXPECT_DONE(splat_scene_transform(scene, &twice));
    const Floats moved = values_of(scene, "means", 60);
    for (std::size_t i = 0; i < 60; ++i)
        EXPECT_FLOAT_EQ(moved[i], 2 * sample.means[i] + static_cast<float>(i % 3 + 1));
    const double low[3] = {1, -100, -100};
    const double high[3] = {100, 100, 100};
    EXPECT_DONE(splat_scene_crop(scene, low, high));
    const std::uint64_t kept = info_of(scene).count;
    EXPECT_GT(kept, 0U);
    EXPECT_LT(kept, 20U);
    EXPECT_GE(info_of(scene).low[0], 1);
    EXPECT_DONE(splat_scene_filter(scene, SPLAT_FILTER_FINITE | SPLAT_FILTER_SORT, 0.5));
    EXPECT_GE(info_of(scene).opacity_min, 0.5);
    const Scene other = SampleScene(3, 2).create();
    const splat_scene both[] = {scene, other};
    const std::uint64_t left = info_of(scene).count;
    const Scene merged = got(splat_scene_merge, both, 2);
    EXPECT_EQ(info_of(merged).count, left + 3);
    EXPECT_EQ(info_of(merged).sh_degree, 2U);
}

TEST(ApiScene, IsCutToASphereAndToADegree) {
    const SampleScene sample(20, 1);
    const Scene scene = sample.create();
    const std::vector<double> center(sample.means.begin(), sample.means.begin() + 3);
    EXPECT_DONE(splat_scene_crop_sphere(scene, center.data(), 0));
    EXPECT_EQ(values_of(scene, "means", 3), Floats(sample.means.begin(), sample.means.begin() + 3));
    std::uint64_t count = 0;
    std::uint32_t degree = 0;
    EXPECT_DONE(splat_scene_get_size(scene, &count, &degree));
    EXPECT_EQ(count, 1U);
    EXPECT_EQ(degree, 1U);
    EXPECT_REFUSED(splat_scene_crop_sphere(scene, center.data(), -1), kArgument, "radius -1");
    EXPECT_DONE(splat_scene_set_sh_degree(scene, 3));
    EXPECT_EQ(values_of(scene, "sh", 48)[11], sample.sh[11]);
    EXPECT_REFUSED(splat_scene_set_sh_degree(scene, 4), kArgument, "sh_degree is 4");
    EXPECT_DONE(splat_scene_set_sh_degree(scene, 0));
    EXPECT_DONE(splat_scene_get_size(scene, nullptr, &degree));
    EXPECT_EQ(degree, 0U);
}

TEST(ApiScene, SaysWhatOtherRenderersNeed) {
    SampleScene sample(4, 1);
    sample.log_scales.assign(12, 0.0F);
    sample.log_scales[5] = 6.5F;
    sample.sh.assign(48, 1.0F);
    sample.sh[9] = -3;
    splat_scene_info info = info_of(sample.create());
    EXPECT_EQ(info.bytes, 4U * 4 * (3 + 3 + 4 + 1 + 12));
    EXPECT_EQ(info.device_bytes, 4U * 4 * (12 + 12));
    EXPECT_EQ(info.band_max, 3);
    EXPECT_EQ(info.beyond_spz, 1U);
    EXPECT_GT(info.fill_ratio, 0);
    // A caller of an earlier version gets what it knows.
    info.bytes = 77;
    info.struct_size = offsetof(splat_scene_info, bytes);
    EXPECT_DONE(splat_scene_get_info(sample.create(), &info));
    EXPECT_EQ(info.bytes, 77U);
}

TEST(ApiScene, MayBeEmpty) {
    const Scene empty = got(splat_scene_merge, nullptr, 0);
    EXPECT_EQ(info_of(empty).count, 0U);
    EXPECT_EQ(info_of(empty).sh_degree, 0U);
    for (const char* name : {"means", "scales", "rotations", "opacities", "sh"}) {
        EXPECT_DONE(splat_scene_read(empty, name, nullptr, 0)) << name;
        EXPECT_DONE(splat_scene_write(empty, name, nullptr, 0)) << name;
    }
    EXPECT_REFUSED(splat_scene_read(empty, "colour", nullptr, 0), kArgument, "name is 'colour'");
    EXPECT_REFUSED(splat_scene_write(empty, "means", nullptr, 4), kArgument, "values is NULL");
    EXPECT_REFUSED(splat_scene_read(SampleScene(1).create(), "means", nullptr, 0), kArgument,
                   "values is NULL");
    const splat_scene none[] = {empty, empty};
    Scene merged = got(splat_scene_merge, none, 2);
    EXPECT_EQ(info_of(merged).count, 0U);
    auto desc = sized<splat_scene_desc>();
    desc.count = 1;
    desc.mean_count = 3;
    EXPECT_REFUSED(splat_scene_create(&desc, merged.out()), kArgument,
                   "splat_scene_desc.means is NULL, but its length is 3");
}

TEST(ApiScene, FilterDropsWhatIsNotFinite) {
    SampleScene sample(5);
    sample.means[4] = NAN;
    const Scene scene = sample.create();
    EXPECT_EQ(info_of(scene).non_finite, 1U);
    EXPECT_DONE(splat_scene_filter(scene, SPLAT_FILTER_FINITE, 0));
    EXPECT_EQ(info_of(scene).count, 4U);
}

}  // namespace
}  // namespace splat::test
