// Which published configuration weights without one are for.
#include "predict/published.h"

#include <gtest/gtest.h>

#include "config/presets.h"
#include "model/camera_embedding.h"
#include "model/model.h"
#include "model/weights.h"
#include "predict/weights_place.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"

namespace splat::predict {
namespace {

using io::NamedTensors;

config::ModelConfig network_of(const char* preset) {
    const auto found = config::preset_of(preset);
    return need(settings_of(std::string(found.value().text), preset)).network;
}

void add(NamedTensors& to, const std::string& name, std::vector<std::int64_t> dims,
         std::vector<float> values = {}) {
    std::size_t count = 1;
    for (const std::int64_t dim : dims) count *= static_cast<std::size_t>(dim);
    values.resize(count);
    ASSERT_OK(to.add({name, std::move(dims), io::NumberType::kF32, values}));
}

/// The tensors of a published file that tell its network apart, without the large ones.
NamedTensors published_file(const config::ModelConfig& c, bool rays = true) {
    NamedTensors file;
    const auto r = static_cast<std::int64_t>(c.resolution);
    if (rays) add(file, "ray_dirs", {1, 3, r, r}, model::pixel_rays(c));
    const std::string net = c.network_name();
    for (std::uint32_t level = 0; level < c.levels(); ++level) {
        const std::string size = std::to_string(c.names_resolution() >> level);
        const std::string at = net + ".encoder.enc." + size + "x" + size + "_";
        const std::int64_t width = c.base_dim * c.channel_mult[level];
        if (level == 0) add(file, at + "conv.weight", {c.base_dim, c.image_channels(), 3, 3});
        for (std::uint32_t i = 0; i < c.num_blocks; ++i) {
            const std::string block = at + "block" + std::to_string(i);
            add(file, block + ".norm0.weight", {width});
            add(file, block + ".conv1.bias", {width});
            if (size == std::to_string(c.attention_resolutions[0]))
                add(file, block + ".qkv.weight", {3 * width, width, 1, 1});
        }
    }
    add(file, net + ".out.weight", {c.output_channels(), c.output_channels(), 1, 1});
    return file;
}

using Names = std::vector<std::string>;

TEST(Published, IsFoundByShapesAndFieldOfView) {
    EXPECT_EQ(published_fit(published_file(network_of("cars")), "x.pth").names,
              (Names{"cars", "chairs"}));
    EXPECT_EQ(published_fit(published_file(network_of("objaverse")), "x.pth").names,
              (Names{"gso", "objaverse"}));
    EXPECT_EQ(published_fit(published_file(network_of("hydrants")), "x.pth").names,
              (Names{"hydrants", "teddybears"}));
    EXPECT_EQ(published_fit(published_file(network_of("nmr")), "x.pth").names, Names{"nmr"});
    EXPECT_EQ(published_fit(published_file(network_of("cars_priors_depth")), "x.pth").names,
              Names{"cars_priors_depth"});
    const PublishedFit any = published_fit(published_file(network_of("cars"), false), "x.pth");
    EXPECT_EQ(any.names, (Names{"cars", "chairs", "gso", "hydrants", "objaverse", "teddybears"}));
    EXPECT_EQ(any.sentence(),
              "its tensors fit the published configurations cars, chairs, gso, hydrants, "
              "objaverse, teddybears");
}

TEST(Published, FindsF3dGausAndTellsItFromOthers) {
    const config::ModelConfig f3d = network_of("f3d-gaus-256"), cars = network_of("cars");
    const NamedTensors file = published_file(f3d);
    EXPECT_EQ(published_fit(file, "checkpoint_256x256_v1.pt").names, Names{"f3d-gaus-256"});
    EXPECT_EQ(published_fit(published_file(f3d, false), "x.pt").names, Names{"f3d-gaus-256"});
    EXPECT_EQ(published_fit(file, "x.pt").head, "f3d");
    EXPECT_OK(expect_network(file, f3d));
    EXPECT_OK(expect_network(published_file(cars), cars));
    EXPECT_ERROR(expect_network(file, cars), Code::kInvalidArgument,
                 "the weights are of another network than the configuration's: its tensors fit the "
                 "published configuration f3d-gaus-256, whose head is 'f3d', but 'model.head' is "
                 "'splatter'");
    EXPECT_ERROR(expect_network(published_file(cars), f3d), Code::kInvalidArgument,
                 "cars, chairs, whose head is 'splatter', but 'model.head' is 'f3d'");
}

/// The tensors of a file of LGM's network that tell it apart.
NamedTensors lgm_file(const config::ModelConfig& c) {
    NamedTensors file;
    add(file, "unet.conv_in.weight", {c.lgm.down[0], c.image_channels(), 3, 3});
    add(file, "conv.weight", {c.output_channels(), c.output_channels(), 1, 1});
    const auto side = [&](const std::string& blocks, const auto& widths, const auto& attention) {
        for (std::size_t i = 0; i < widths.size(); ++i) {
            const std::string block = "unet." + blocks + "_blocks." + std::to_string(i);
            add(file, block + ".nets.0.conv1.bias", {widths[i]});
            if (attention[i] != 0)
                add(file, block + ".attns.0.attn.qkv.weight", {3 * widths[i], widths[i]});
        }
    };
    side("down", c.lgm.down, c.lgm.down_attention);
    side("up", c.lgm.up, c.lgm.up_attention);
    return file;
}

TEST(Published, FindsLgmAndTellsItFromOthers) {
    for (const char* name : {"lgm-tiny", "lgm-small", "lgm-big"})
        EXPECT_EQ(published_fit(lgm_file(network_of(name)), "model_fp16_fixrot.safetensors").names,
                  Names{name});
    config::ModelConfig other = network_of("lgm-tiny");
    other.lgm.up[2] = 64;
    EXPECT_EQ(
        published_fit(lgm_file(other), "x").sentence(),
        "its tensors fit no published configuration; the nearest is lgm-tiny, but model.up is "
        "[512, 256, 64] (there [512, 256, 128])");
    const config::ModelConfig cars = network_of("cars"), big = network_of("lgm-big");
    EXPECT_ERROR(expect_network(lgm_file(big), cars), Code::kInvalidArgument,
                 "the weights are of another network than the configuration's: its tensors fit the "
                 "published configuration lgm-big");
    EXPECT_ERROR(expect_network(published_file(cars), big), Code::kInvalidArgument, "cars, chairs");
    EXPECT_OK(expect_network(lgm_file(big), big));
    EXPECT_ERROR(expect_network(lgm_file(big), network_of("lgm-tiny")), Code::kInvalidArgument,
                 "the weights are of another network than the configuration's: its tensors fit the "
                 "published configuration lgm-big");
}

TEST(Published, IsDecidedByTheNameOfTheFile) {
    const NamedTensors cars = published_file(network_of("cars"));
    EXPECT_EQ(published_fit(cars, "/models/model_chairs.pth").names, Names{"chairs"});
    EXPECT_EQ(published_fit(cars, "model_cars.safetensors").names, Names{"cars"});
    EXPECT_EQ(published_fit(cars, "model_latest.pth").names, (Names{"cars", "chairs"}))
        << "that of a training of one's own";
    EXPECT_EQ(published_fit(cars, "model_hydrants.pth").names, (Names{"cars", "chairs"}))
        << "the tensors say otherwise";
    EXPECT_EQ(published_fit(published_file(network_of("objaverse")), "model_latest.pth").names,
              Names{"objaverse"});
    EXPECT_EQ(published_fit(published_file(network_of("teddybears")), "model_teddybears.pth").names,
              Names{"teddybears"});
}

TEST(Published, NamesTheNearestAndWhatDiffers) {
    config::ModelConfig small = network_of("cars");
    small.base_dim = 32;
    small.num_blocks = 2;
    const PublishedFit fit = published_fit(published_file(small), "model_cars.pth");
    EXPECT_TRUE(fit.names.empty());
    EXPECT_EQ(fit.nearest, "cars");
    EXPECT_EQ(fit.sentence(),
              "its tensors fit no published configuration; the nearest is cars, but model.base_dim "
              "is 32 (there 128), model.num_blocks is 2 (there 4)");
    config::ModelConfig wide = network_of("cars");
    wide.fov_degrees = 70;
    EXPECT_EQ(published_fit(published_file(wide), "model_cars.pth").differences,
              Names{"the field of view of ray_dirs is 70 degrees (there 51.99 degrees)"});
    wide.fov_degrees = 0;
    wide.num_blocks = 5;
    EXPECT_EQ(published_fit(published_file(wide), "x").nearest, "hydrants");
    NamedTensors other;
    add(other, "features.0.weight", {64, 3, 3, 3});
    add(other, "network_with_offset.encoder.enc.99999999999999999999x_conv.weight", {1, 1, 1, 1});
    add(other, "network_with_offset.encoder.enc.x_conv.weight", {1, 1, 1, 1});
    add(other, "network_with_offset.encoder.enc.0x0_conv.weight", {1, 1, 1, 1});
    add(other, "ray_dirs", {0});
    EXPECT_EQ(
        published_fit(other, "model_cars.pth").sentence(),
        "its tensors fit no published configuration: none is "
        "'network_with_offset.encoder.enc.RxR_conv.weight' or 'unet.conv_in.weight', and they "
        "look like a SongUNet, as of Splatter Image or F3D-Gaus");
    NamedTensors moge;
    add(moge, "encoder.backbone.norm.bias", {1});
    EXPECT_ERROR(expect_network(moge, small), Code::kInvalidArgument, "and they look like MoGe-2");
}

TEST(Published, LeavesTheFirstTrainingOut) {
    EXPECT_TRUE(published_fit(published_file(network_of("small")), "x").names.empty());
}

/// The names and shapes that traits are read from are those of the networks that are built.
TEST(Published, TraitsAreThoseOfNetworksThatAreBuilt) {
    vk::Context* const context = test::shared_context();
    config::ModelConfig plain;
    plain.resolution = 16;
    plain.base_dim = 8;
    plain.num_blocks = 1;
    plain.channel_mult = {1, 2};
    plain.attention_resolutions = {8};
    std::vector<config::ModelConfig> all(7, plain);
    all[1].offset = false;
    all[1].sh_degree = 0;
    all[2].depth = all[2].normal = true;
    all[2].num_blocks = 2;
    all[2].channel_mult = {2, 3, 3};
    all[2].attention_resolutions = {16, 4};
    all[3].embedding = config::Embedding::kPose;
    all[4].embedding = config::Embedding::kIndex;
    all[4].film = config::Film::kAffine;
    all[4].lora.rank = 2;
    all[5].token_dim = 6;
    all[5].tokens = 3;
    all[6].named_resolution = 8;
    all[6].attention_resolutions = {4};
    all[6].positions = kHeadInputDepth;
    for (std::size_t i = 0; i < all.size(); ++i) {
        const auto made = need(model::Model::create(*context, all[i], {}));
        EXPECT_EQ(traits_of(need(model::save_state(*made))), traits_of(all[i])) << "network " << i;
    }
}

}  // namespace
}  // namespace splat::predict
