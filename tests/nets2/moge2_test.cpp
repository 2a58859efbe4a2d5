// MoGe-2 of golden/nets2/moge2_*.npz, computed once by the published code in float64; see INDEX.md there.
#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "support/golden_file.h"
#include "vision/moge_model.h"

namespace splat::test {
namespace {

using vision::BlockNorm;
using vision::MogeConfig;
using vision::MogeModel;

/// Figure of issue 61 for outputs, relative L2.
constexpr double kOutput = 5e-6;

BlockNorm norm_of(const std::string& name) {
    return name == "none"         ? BlockNorm::kNone
           : name == "layer_norm" ? BlockNorm::kLayer
                                  : BlockNorm::kGroup;
}

MogeConfig config_of(const Golden& golden) {
    MogeConfig config;
    config.heads = static_cast<std::uint32_t>(golden.array("num_heads").ints().value()[0]);
    const auto taps = golden.array("intermediate_layers").ints().value();
    for (const std::int64_t tap : taps) config.taps.push_back(static_cast<std::uint32_t>(tap));
    config.in_norm = norm_of(golden.array("in_norm").strings().value()[0]);
    config.hidden_norm = norm_of(golden.array("hidden_norm").strings().value()[0]);
    EXPECT_EQ(golden.array("remap").strings().value()[0], "exp");
    return config;
}

/// The published state dict.
io::NamedTensors state_of(const Golden& golden) {
    io::NamedTensors tensors;
    const std::string prefix = "state.";
    for (const std::string& key : golden.npz.names()) {
        if (!key.starts_with(prefix)) continue;
        EXPECT_OK(tensors.add({key.substr(prefix.size()), golden.dims(key), io::NumberType::kF32,
                               golden.floats(key)}));
    }
    return tensors;
}

class Nets2 : public KernelsTest {
  protected:
    void SetUp() override {
        SPLAT_NEEDS_GOLDEN_FOLDER();
        KernelsTest::SetUp();
    }
};
SPLAT_INSTANTIATE_KERNELS(Nets2);

TEST_P(Nets2, Moge2) {
    for (const std::string& path : golden_files("nets2", "moge2_")) {
        const Golden golden{need(Npz::read(path)), golden_name(path)};
        const io::NamedTensors state = state_of(golden);
        const auto model = need(MogeModel::create(context(), state, config_of(golden)));
        ASSERT_OK(model->load(state));
        const std::vector<float> image = golden.floats("image");
        const auto maps = need(model->run(image, golden.dim("image", 3), golden.dim("image", 2),
                                          golden.array("num_tokens").ints().value()[0]));
        const auto expect = [&](const char* what, const std::vector<float>& got) {
            expect_relative(golden.name + " " + what, got, golden.doubles(what), kOutput);
        };
        expect("encoder", need(model->features()));
        expect("cls", need(model->class_token()));
        expect("out.points", maps.points);
        expect("out.normal", maps.normals);
        expect("out.mask", maps.mask);
        expect("out.metric_scale", {maps.scale});
    }
}

}  // namespace
}  // namespace splat::test
