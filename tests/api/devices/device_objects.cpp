// One object of each kind, made and run: what tests of devices try on each.
#include "api/devices/device_objects.h"

#include <algorithm>

#include "api/evaluate/lpips_calls.h"
#include "api/handles.h"
#include "api/predict/picture_calls.h"
#include "api/raster_calls.h"

namespace splat::test {
namespace {

/// Ends a function that returns a splat_result at the first call that fails.
#define SPLAT_CALL(call) \
    if (const splat_result code = (call); code != SPLAT_OK) return code

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

// Capabilities of the SPIR-V specification, 3.31, named as there.
enum Capability : std::uint32_t {
    Shader = 1,
    Int64 = 11,
    SampledBuffer = 46,
    GroupNonUniform = 61,
    GroupNonUniformVote = 62,
    GroupNonUniformArithmetic = 63,
    GroupNonUniformBallot = 64,
    GroupNonUniformShuffle = 65,
    SignedZeroInfNanPreserve = 4466,
};

bool has_capability(const vk::DeviceFeatures& features, std::uint32_t capability) {
    switch (capability) {
        case Shader:
        case SampledBuffer:
        case GroupNonUniform:
            return true;  // each device of Vulkan 1.2
        case Int64:
            return features.int64;
        case GroupNonUniformVote:
        case GroupNonUniformShuffle:
            return features.subgroup_shuffle;
        case GroupNonUniformArithmetic:
            return features.subgroup_arithmetic;
        case GroupNonUniformBallot:
            return features.subgroup_ballot;
        case SignedZeroInfNanPreserve:
            return features.nan_mode;
        default:
            return false;
    }
}

vk::DeviceFeatures g_features;  ///< the watched device's
PFN_vkCreateShaderModule g_create_module;

VKAPI_ATTR VkResult VKAPI_CALL watch_module(VkDevice device, const VkShaderModuleCreateInfo* info,
                                            const VkAllocationCallbacks* host,
                                            VkShaderModule* made) {
    EXPECT_EQ(needed_beyond({info->pCode, info->codeSize / sizeof(std::uint32_t)}, g_features), "");
    return g_create_module(device, info, host, made);
}

}  // namespace

std::string needed_beyond(std::span<const std::uint32_t> words,
                          const vk::DeviceFeatures& features) {
    constexpr std::uint32_t kExtension = 10, kCapability = 17, kVersion = 0x00010500;
    std::string beyond;
    const auto add = [&](const std::string& one) { beyond += (beyond.empty() ? "" : ", ") + one; };
    if (words[1] > kVersion) add("version " + std::to_string(words[1]));
    for (std::size_t at = 5; at < words.size(); at += words[at] >> 16) {
        const std::uint32_t op = words[at] & 0xFFFFU;
        if (op == kExtension)
            add(std::string("extension ") + reinterpret_cast<const char*>(&words[at + 1]));
        if (op == kCapability && !has_capability(features, words[at + 1]))
            add("capability " + std::to_string(words[at + 1]));
    }
    return beyond;
}

Device open_watched(const vk::ContextDesc& desc) {
    self_test::KernelTests tests;
    auto context = self_test::create_context(desc, tests);
    Device device;
    EXPECT_TRUE(context.ok()) << context.status().message();
    if (!context.ok()) return device;
    vk::Device& opened = context.value()->device();
    g_features = opened.info().features;
    g_create_module = opened.vk.vkCreateShaderModule;
    opened.vk.vkCreateShaderModule = watch_module;
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

splat_result run_rasterizer(splat_device device) {
    const Scene scene = SampleScene(40).create();
    const splat_rasterizer_desc desc = rasterizer_desc(
        40, kObjectSide, kObjectSide, SPLAT_RASTERIZER_BACKWARD | SPLAT_RASTERIZER_DEPTH);
    Rasterizer rasterizer;
    SPLAT_CALL(splat_rasterizer_create(device, &desc, rasterizer.out()));
    SPLAT_CALL(draw(rasterizer, scene, sample_camera(kObjectSide, kObjectSide)));
    const Tensor rgb = upload(device, {1, kObjectSide, kObjectSide, 3},
                              Floats(std::size_t{3} * kObjectSide * kObjectSide, 1));
    const Tensor means = make_tensor(device, {40, 3});
    auto gradients = sized<splat_gradients_desc>();
    gradients.grad_rgb = rgb;
    gradients.grad_means = means;
    return splat_rasterizer_backward(rasterizer, nullptr, &gradients);
}

splat_result render_scene(splat_device device) {
    const Scene scene = SampleScene(40, 3).create();
    const splat_camera camera = sample_camera(kObjectSide, kObjectSide);
    Floats pixels(std::size_t{3} * kObjectSide * kObjectSide);
    const splat_image image = packed_image(pixels, kObjectSide, kObjectSide, 3);
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

}  // namespace splat::test
