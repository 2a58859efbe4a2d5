// Every object of the API on devices with the limits of each class: made and run, or refused with the right sentence.
#include "api/devices/device_rows.h"

#include <algorithm>
#include <filesystem>

#include "api/evaluate/lpips_calls.h"
#include "api/handles.h"
#include "api/predict/picture_calls.h"
#include "api/raster_calls.h"

namespace splat::test {
namespace {

namespace fs = std::filesystem;

/// Ends a function that returns a splat_result at the first call that fails.
#define SPLAT_CALL(call) \
    if (const splat_result code = (call); code != SPLAT_OK) return code

void fake(const DeviceRow& row, vk::DeviceInfo& info) {
    info.name = row.name;  // what the self-test finds is kept by it
    info.kind = row.kind;
    info.features.unified_memory = row.kind != vk::DeviceKind::kDiscrete;
    info.features.subgroup_shuffle = row.subgroups != Subgroups::kBasic;
    if (row.subgroups == Subgroups::kBasic) info.features.subgroup_ballot = false;
    info.features.subgroup_arithmetic = row.subgroups == Subgroups::kArithmetic;
    vk::DeviceLimits& limits = info.limits;
    // The driver's own lanes are fewer than those of most rows: a kernel that counted on more would compute wrongly.
    limits.subgroup_size = std::min(limits.subgroup_size, row.lanes);
    limits.max_storage_buffers = row.storage_buffers;
    limits.max_group_invocations = row.invocations;
    limits.max_group_size = {row.invocations, row.invocations, 64};
    limits.shared_memory_bytes = row.shared_kib << 10;
    limits.max_storage_buffer_bytes = row.binding_bytes;
    limits.max_allocation_bytes = row.allocation_bytes;
    limits.max_texel_elements = row.texels;
}

Device open_row(const DeviceRow& row) {
    vk::ContextDesc desc;
    desc.device.fake = [&row](vk::DeviceInfo& info) { fake(row, info); };
    self_test::KernelTests tests;
    auto context = self_test::create_context(desc, tests);
    Device device;
    EXPECT_TRUE(context.ok()) << context.status().message();
    if (!context.ok()) return device;
    auto object = std::make_shared<api::DeviceObject>(std::move(context.value()));
    object->tests = std::move(tests);
    *device.out() = api::Devices::add(std::move(object));
    return device;
}

splat_result run_operator(splat_device device) {
    const Tensor x = upload(device, {2, 2}, {1, 2, 3, 4}),
                 weight = upload(device, {2, 2}, {1, 0, 0, 1});
    const Tensor y = make_tensor(device, {2, 2}), grad_x = make_tensor(device, {2, 2});
    OpRequest request("linear", {x, weight, nullptr}, {y});
    request.grad_outputs = {y};
    request.grad_inputs = {grad_x, nullptr, nullptr};
    const splat_op_desc desc = request.desc();
    Op op;
    SPLAT_CALL(splat_op_create(device, &desc, op.out()));
    SPLAT_CALL(splat_op_forward(op));
    SPLAT_CALL(splat_op_backward(op));
    EXPECT_EQ(download(y), (Floats{1, 2, 3, 4}));
    EXPECT_EQ(download(grad_x), (Floats{1, 2, 3, 4}));
    return SPLAT_OK;
}

splat_result run_module(splat_device device) {
    const splat_module_desc desc = module_desc();
    const Floats x(4, 0.5F);
    Module module;
    SPLAT_CALL(splat_module_create(device, &desc, module.out()));
    SPLAT_CALL(splat_module_write(module, "x", x.data(), x.size() * sizeof(float)));
    return splat_module_forward(module);
}

splat_result run_model(splat_device device) {
    const splat_model_desc desc = model_desc();
    const Floats images(std::size_t{3} * 16 * 16, 0.5F);
    auto input = sized<splat_model_input>();
    input.images = images.data();
    input.images_count = images.size();
    Model model;
    SPLAT_CALL(splat_model_create(device, &desc, model.out()));
    SPLAT_CALL(splat_model_init(model, 3));
    return splat_model_forward(model, &input);
}

splat_result run_predictor(splat_device device) {
    static const Weights& weights =  // never destroyed: the library may have ended before
        *new Weights(got(splat_model_store, random_model(open_device())));
    static const std::vector<std::uint8_t> bytes = picture_bytes(3);
    auto desc = sized<splat_predictor_desc>();
    desc.weights = weights;
    desc.config = kSmallModel;
    splat_picture picture{};
    picture.image.pixels = image_of(bytes, 3);
    Predictor predictor;
    Scene scene;
    SPLAT_CALL(splat_predictor_create(device, &desc, predictor.out()));
    SPLAT_CALL(splat_predictor_predict(predictor, &picture, 1, scene.out(), nullptr));
    EXPECT_EQ(info_of(scene).non_finite, 0U);
    return SPLAT_OK;
}

constexpr std::uint32_t kSide = 24;

splat_result run_rasterizer(splat_device device) {
    const Scene scene = SampleScene(40).create();
    const splat_rasterizer_desc desc =
        rasterizer_desc(40, kSide, kSide, SPLAT_RASTERIZER_BACKWARD | SPLAT_RASTERIZER_DEPTH);
    Rasterizer rasterizer;
    SPLAT_CALL(splat_rasterizer_create(device, &desc, rasterizer.out()));
    SPLAT_CALL(draw(rasterizer, scene, sample_camera(kSide, kSide)));
    const Tensor rgb =
        upload(device, {1, kSide, kSide, 3}, Floats(std::size_t{3} * kSide * kSide, 1));
    const Tensor means = make_tensor(device, {40, 3});
    auto gradients = sized<splat_gradients_desc>();
    gradients.grad_rgb = rgb;
    gradients.grad_means = means;
    return splat_rasterizer_backward(rasterizer, nullptr, &gradients);
}

splat_result render_scene(splat_device device) {
    const Scene scene = SampleScene(40, 3).create();
    const splat_camera camera = sample_camera(kSide, kSide);
    Floats pixels(std::size_t{3} * kSide * kSide);
    const splat_image image = packed_image(pixels, kSide, kSide, 3);
    return splat_scene_render(scene, device, &camera, 1, nullptr, &image);
}

splat_result run_trainer(splat_device device) {
    const splat_trainer_desc desc = trainer_desc();
    const TrainerBatch images;
    const splat_trainer_batch batch = images.desc();
    auto info = sized<splat_trainer_info>();
    Trainer trainer;
    Model model;
    SPLAT_CALL(splat_trainer_create(device, &desc, trainer.out()));
    SPLAT_CALL(splat_trainer_model(trainer, model.out()));
    SPLAT_CALL(splat_model_init(model, 3));
    SPLAT_CALL(splat_trainer_step(trainer, &batch, &info));
    EXPECT_EQ(info.skipped, 0U);
    return SPLAT_OK;
}

/// A folder of six photographs with their cameras.
std::string photographs() {
    static const Temporary folder;
    static const bool written = [] {
        const Device device = open_device();
        const Scene scene = SampleScene(40).create();
        std::vector<splat_camera> cameras;
        std::vector<std::string> names;
        for (int i = 0; i < 6; ++i) {
            cameras.push_back(sample_camera(40, 28, i));
            names.push_back(std::to_string(i) + ".png");
            std::vector<std::uint8_t> pixels(std::size_t{3} * 40 * 28);
            const splat_image image = packed_image(pixels, 40, 28, 3);
            EXPECT_DONE(splat_scene_render(scene, device, &cameras.back(), 1, nullptr, &image));
            EXPECT_DONE(splat_image_save((folder / names.back()).c_str(), &image));
        }
        std::vector<const char*> texts;
        for (const std::string& name : names) texts.push_back(name.c_str());
        EXPECT_DONE(splat_camera_save((folder / "transforms.json").c_str(), cameras.data(),
                                      texts.data(), 6));
        return true;
    }();
    return written ? folder.path() : "";
}

splat_result run_fit(splat_device device) {
    const std::string data = photographs(), folder = run_folder();
    auto desc = sized<splat_fit_desc>();
    desc.folder = folder.c_str();
    desc.data = data.c_str();
    desc.steps = 2;
    Training run;
    SPLAT_CALL(splat_fit_open(device, &desc, run.out()));
    auto event = sized<splat_run_event>();
    while (event.kind < SPLAT_EVENT_DONE) SPLAT_CALL(splat_run_next(run, &event));
    EXPECT_EQ(event.kind, SPLAT_EVENT_DONE);
    return SPLAT_OK;
}

splat_result run_lpips(splat_device device) {
    static const Weights& weights = *new Weights(lpips_weights());
    const splat_weights given = weights;
    auto desc = sized<splat_lpips_desc>();
    desc.weights = &given;
    desc.weight_count = 1;
    desc.side = kLpipsSide;
    const Floats a(std::size_t{3} * kLpipsSide * kLpipsSide, 0.5F);
    const splat_image image = planes_image(a.data(), kLpipsSide);
    double distance = -1;
    Lpips lpips;
    SPLAT_CALL(splat_lpips_create(device, &desc, lpips.out()));
    SPLAT_CALL(splat_lpips_compare(lpips, &image, &image, &distance));
    EXPECT_EQ(distance, 0);
    return SPLAT_OK;
}

class ApiDeviceRows : public testing::TestWithParam<DeviceRow> {
  protected:
    /// `part` of the sentence that refuses the object; nullptr: it is made.
    void expect(const char* object, const char* part, splat_result (*run)(splat_device)) {
        SCOPED_TRACE(object);
        if (part == nullptr)
            EXPECT_DONE(run(device_));
        else
            EXPECT_REFUSED(run(device_), kUnsupported, part);
    }

    const DeviceRow& row_ = GetParam();
    Device device_ = open_row(row_);
};

TEST_P(ApiDeviceRows, FamiliesHaveTheirKernels) {
    vk::DeviceInfo info;
    info.features.subgroup_ballot = info.features.int64 = true;
    fake(row_, info);
    info.limits.subgroup_size = info.limits.least_lanes = info.limits.most_lanes = row_.lanes;
    EXPECT_EQ(vk::kernels_text(vk::best_kernels(info)), row_.kernels);
}

TEST_P(ApiDeviceRows, NetworksAreMadeOrRefused) {
    expect("model", row_.no_networks, run_model);
    const char* no_predictor =
        row_.no_networks != nullptr ? row_.no_networks : row_.no_rendering;  // it draws, too
    expect("predictor", no_predictor, run_predictor);
    if (row_.no_networks != nullptr)
        return;  // operators and modules ask for fewer buffers, each for its own
    expect("operator", nullptr, run_operator);
    expect("module", nullptr, run_module);
}

TEST_P(ApiDeviceRows, RenderingIsMadeOrRefused) {
    expect("rasterizer", row_.no_rendering, run_rasterizer);
    expect("scene", row_.no_rendering, render_scene);
    expect("trainer", row_.no_rendering, run_trainer);
    expect("fit", row_.no_rendering, run_fit);
}

TEST_P(ApiDeviceRows, LpipsIsMadeOrRefused) {
    expect("LPIPS", row_.no_networks, run_lpips);
}

TEST_P(ApiDeviceRows, WhatIsTooLargeIsRefusedInNumbers) {
    const std::uint64_t most = std::min(row_.binding_bytes, row_.allocation_bytes);
    const splat_tensor_desc wide = tensor_desc({static_cast<std::int64_t>(most / 4 + 1)});
    Tensor tensor;
    EXPECT_REFUSED(splat_tensor_create(device_, &wide, tensor.out()), kUnsupported,
                   "at most " + std::to_string(most));
    if (row_.no_rendering != nullptr) return;
    const std::uint64_t gaussians = most / 48;
    splat_rasterizer_desc many =
        rasterizer_desc(static_cast<std::uint32_t>(gaussians + 1), kSide, kSide);
    many.flags |= SPLAT_RASTERIZER_BACKWARD;  // images alone are drawn in bands
    Rasterizer rasterizer;
    EXPECT_REFUSED(splat_rasterizer_create(device_, &many, rasterizer.out()), kUnsupported,
                   "takes at most " + std::to_string(gaussians) + " in all");
}

/// Kernels for CPUs alone read through texel buffers. 700 Gaussians on each of 64 tiles are 44,800 pairs, more than
/// 65,536 texels hold with their keys.
TEST_P(ApiDeviceRows, FewTexelsDoNotDivideAScene) {
    if (row_.no_rendering != nullptr || row_.kind == vk::DeviceKind::kCpu || row_.texels > 65536)
        return;
    SampleScene sample(700, 0);
    std::ranges::fill(sample.means, 0.0F);
    std::ranges::fill(sample.log_scales, 2.0F);
    std::ranges::fill(sample.opacity_logits, -5.0F);
    const Rasterizer rasterizer = make_rasterizer(device_, rasterizer_desc(700, 128, 128));
    ASSERT_DONE(draw(rasterizer, sample.create(), sample_camera(128, 128)));
    const splat_rasterizer_info info = got(splat_rasterizer_get_info, rasterizer, nullptr);
    EXPECT_EQ(info.pairs, 700U * 64);
    EXPECT_EQ(info.passes, 1U);
}

INSTANTIATE_TEST_SUITE_P(Rows, ApiDeviceRows, testing::ValuesIn(kDeviceRows), [](const auto& row) {
    std::string name = row.param.name;
    std::erase_if(name, [](unsigned char c) { return std::isalnum(c) == 0; });
    return name;
});

}  // namespace
}  // namespace splat::test
