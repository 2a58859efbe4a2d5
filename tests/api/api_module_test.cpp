// Modules through the C API: one operator, one block of the network.
#include <cmath>
#include <map>

#include "api/api_calls.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

/// A splat_module_desc with what it points to.
struct ModuleRequest {
    std::string type, attributes;
    std::vector<splat_port> ports;
    std::uint32_t flags = SPLAT_MODULE_GRADIENTS | SPLAT_MODULE_INPUT_GRADIENTS;

    [[nodiscard]] splat_module_desc desc() const {
        auto made = sized<splat_module_desc>();
        made.flags = flags;
        made.type = type.c_str();
        made.attributes = attributes.empty() ? nullptr : attributes.c_str();
        made.ports = ports.data();
        made.port_count = static_cast<std::uint32_t>(ports.size());
        if (type == "residual_block") made.precision = SPLAT_PRECISION_STRICT;
        return made;
    }
};

class ApiModule : public testing::Test {
  protected:
    Module make(const ModuleRequest& request) {
        return got(splat_module_create, shared_device(), request.desc());
    }
    void refused(const ModuleRequest& request, splat_result code, const char* sentence) {
        const splat_module_desc desc = request.desc();
        Module module;
        EXPECT_REFUSED(splat_module_create(shared_device(), &desc, module.out()), code, sentence);
    }
    static void write(const Module& module, const char* name, const Floats& values) {
        EXPECT_DONE(splat_module_write(module, name, values.data(), values.size() * sizeof(float)))
            << name;
    }
    static Floats read(const Module& module, const char* name, std::size_t count) {
        return floats_of(count, splat_module_read, module, name);
    }
    static std::string report(const Module& module) { return text_of(splat_module_report, module); }
};

/// y = x W^T + b of whole numbers: x = [1 2; 3 4; 5 6], W = [1 0; 2 1; 0 3], b = [10 20 30], grad_y
/// = 1.
TEST_F(ApiModule, OperatorsHaveNamedPortsAndParameters) {
    const Module linear =
        make({"linear",
              "",
              {port_desc({3, 2}, "x"), port_desc({3, 2}, "weight"), port_desc({3}, "bias")}});
    EXPECT_TRUE(holds(report(linear), "\"outputs\": [{\"name\": \"y\", \"shape\": [3, 3]}]"));
    EXPECT_TRUE(
        holds(report(linear), "{\"name\": \"weight\", \"shape\": [3, 2], \"trainable\": true}"));
    Floats y(9);
    EXPECT_REFUSED(splat_module_read(linear, "y", y.data(), 36), kState, "has not run forward");
    write(linear, "x", {1, 2, 3, 4, 5, 6});
    write(linear, "weight", {1, 0, 2, 1, 0, 3});
    write(linear, "bias", {10, 20, 30});
    for (const float sum : {1.0F, 2.0F}) {  // only gradients of parameters add up
        ASSERT_DONE(splat_module_forward(linear));
        EXPECT_EQ(read(linear, "y", 9), (Floats{11, 24, 36, 13, 30, 42, 15, 36, 48}));
        write(linear, "grad:y", Floats(9, 1));
        ASSERT_DONE(splat_module_backward(linear));
        EXPECT_EQ(read(linear, "grad:x", 6), (Floats{3, 4, 3, 4, 3, 4}));
        EXPECT_EQ(read(linear, "grad:weight", 6),
                  (Floats{9 * sum, 12 * sum, 9 * sum, 12 * sum, 9 * sum, 12 * sum}));
        EXPECT_EQ(read(linear, "grad:bias", 3), Floats(3, 3 * sum));
    }
    EXPECT_REFUSED(splat_module_backward(linear), kState, "run forward before each");
    ASSERT_DONE(splat_module_zero_gradients(linear));
    EXPECT_EQ(read(linear, "grad:bias", 3), Floats(3, 0));
    ASSERT_DONE(splat_module_init(linear, 4));
    EXPECT_EQ(read(linear, "bias", 3), Floats(3, 0));
    for (const float w : read(linear, "weight", 6)) {
        EXPECT_LT(std::abs(w), 1.1F) << "Glorot: sqrt(6 / 5)";
        EXPECT_NE(w, 0.0F);
    }
}

/// A block with all options at once: its gradients match finite differences.
TEST_F(ApiModule, BlocksHaveGradients) {
    ModuleRequest request{"residual_block",
                          R"({"out_channels": 12, "attention": true, "affine_film": true,
                              "lora_rank": 2, "lora_alpha": 4})",
                          {port_desc({2, 8, 4, 6}, "x"), port_desc({2, 16}, "embedding"),
                           port_desc({2, 5, 3, 1}, "tokens")}};
    const Module block = make(request);
    const std::string text = report(block);
    EXPECT_TRUE(holds(text, "[{\"name\": \"y\", \"shape\": [2, 12, 4, 6]}]"));
    EXPECT_TRUE(holds(text, "\"block.conv0.lora_A\", \"shape\": [2, 72], \"trainable\": true"));
    EXPECT_TRUE(holds(text, "\"block.conv0.weight\", \"shape\": [12, 8, 3, 3], \"trainable\": f"));
    ASSERT_DONE(splat_module_init(block, 3));
    struct Tensor {
        const char* name;
        std::size_t count;
    };
    const Tensor moved[] = {{"x", 384},
                            {"embedding", 32},
                            {"tokens", 30},
                            {"block.conv0.lora_A", 144},
                            {"block.conv0.lora_B", 24}};
    // These start near zero and would hide the layers before them.
    write(block, "block.conv1.weight", normal_fill(1296, 20, 0, 0.1));
    write(block, "block.proj.weight", normal_fill(144, 21, 0, 0.3));
    write(block, "block.cross_attention.out_proj.weight", normal_fill(144, 22, 0, 0.3));
    std::map<std::string, Floats> values;
    for (std::uint64_t i = 0; i < 5; ++i) {
        values[moved[i].name] = normal_fill(moved[i].count, 10 + i, 0, i < 3 ? 1 : 0.2);
        write(block, moved[i].name, values[moved[i].name]);
    }
    const Floats weights = normal_fill(576, 30);
    const auto loss = [&] {
        EXPECT_DONE(splat_module_forward(block));
        double sum = 0;
        const Floats y = read(block, "y", 576);
        for (std::size_t i = 0; i < y.size(); ++i)
            sum += static_cast<double>(weights[i]) * static_cast<double>(y[i]);
        return sum;
    };
    loss();
    write(block, "grad:y", weights);
    ASSERT_DONE(splat_module_backward(block));
    std::map<std::string, Floats> gradients;
    for (const Tensor& tensor : moved)
        gradients[tensor.name] =
            read(block, (std::string("grad:") + tensor.name).c_str(), tensor.count);
    for (const Tensor& tensor : moved) {
        const Floats direction = normal_fill(tensor.count, 40);
        double expected = 0;
        double norm = 0;
        for (std::size_t i = 0; i < tensor.count; ++i) {
            const auto g = static_cast<double>(gradients[tensor.name][i]);
            expected += g * static_cast<double>(direction[i]);
            norm += g * g;
        }
        const auto at = [&](float step) {
            Floats there = values[tensor.name];
            for (std::size_t i = 0; i < there.size(); ++i) there[i] += step * direction[i];
            write(block, tensor.name, there);
            return loss();
        };
        constexpr float kStep = 1.0F / 256;
        const double measured = (at(kStep) - at(-kStep)) / (2 * double{kStep});
        write(block, tensor.name, values[tensor.name]);
        // Second-order terms of the step, and float32 sums of 576 terms over 1/128.
        EXPECT_NEAR(measured, expected, 0.01 * std::sqrt(norm)) << tensor.name;
        EXPECT_GT(norm, 1e-4) << tensor.name;
    }
}

TEST_F(ApiModule, DropoutFollowsItsCounter) {
    ModuleRequest request{"residual_block",
                          R"({"dropout": 0.5})",
                          {port_desc({1, 8, 4, 4}, "x"), port_desc({4}, "random_counter")},
                          SPLAT_MODULE_TRAINING};
    const Module block = make(request);
    ASSERT_DONE(splat_module_init(block, 3));
    write(block, "block.conv1.weight", normal_fill(576, 5));  // starts next to zero
    write(block, "x", normal_fill(128, 4));
    const auto y = [&](float counter) {
        write(block, "random_counter", {counter, 0, 0, 0});
        EXPECT_DONE(splat_module_forward(block));
        return read(block, "y", 128);
    };
    const Floats first = y(1);
    EXPECT_NE(y(2), first);
    EXPECT_EQ(y(1), first);
    request.flags = 0;
    refused(request, kArgument, "'random_counter' is given");
    request.flags = SPLAT_MODULE_TRAINING;
    request.ports.pop_back();
    refused(request, kShape, "give it, of shape [4]");
}

TEST_F(ApiModule, SaysWhatIsWrong) {
    const splat_port x = port_desc({2, 8, 4, 4}, "x");
    refused({"residual_blok", "", {x}}, kArgument, "no operator named 'residual_blok'");
    refused({"residual_block", "", {}}, kShape, "port 'x' has shape none");
    refused({"residual_block", "", {x, x}}, kArgument, "port 'x' is given twice");
    refused({"residual_block", "", {x, port_desc({4}, "tokes")}}, kArgument,
            "no port 'tokes'; there are: x embedding tokens random_counter");
    refused({"residual_block", R"({"attentions": true})", {x}}, kArgument,
            "no attribute 'attentions'");
    refused({"residual_block", R"({"views": 3})", {x}}, kArgument, "'views' is 3");
    refused({"residual_block", R"({"dropout": 1})", {x}}, kArgument, "'dropout' is 1");
    refused({"residual_block", R"({"up": true, "down": true})", {x}}, kArgument, "expected one");
    refused({"residual_block", R"({"out_channels": 13})", {x}}, kShape,
            "'out_channels' has 13 channels, which do not divide into 3 groups");
    refused({"residual_block", "", {port_desc({2, 9, 4, 4}, "x")}}, kShape,
            "port 'x' has 9 channels");
    refused({"residual_block", "", {x, port_desc({3, 5}, "embedding")}}, kShape,
            "'embedding' has shape [3, 5], expected [N,E] for 2");
    refused({"residual_block", "", {x, port_desc({2, 5, 3}, "tokens")}}, kShape,
            "expected [N,D,T,1]");
    refused({"silu", "", {x}, SPLAT_MODULE_GRADIENTS}, kArgument,
            "gradients need SPLAT_MODULE_INPUT_GRADIENTS");
    refused({"silu", "", {x}, SPLAT_MODULE_TRAINING}, kArgument, "apply to residual_block");
    refused({"linear", "", {port_desc({3, 2}, "x")}}, kShape, "tensor 'weight' is absent");
    refused({"silu", "", {x}, SPLAT_MODULE_INPUT_GRADIENTS}, kArgument,
            "needs SPLAT_MODULE_GRADIENTS");
    const Module silu = make({"silu", "", {x}, 0});
    Floats values(256);
    EXPECT_REFUSED(splat_module_write(silu, "z", values.data(), 1024), kNotFound,
                   "ports and parameters are: x y");
    EXPECT_REFUSED(splat_module_write(silu, "x", values.data(), 1020), kShape,
                   "'x' of shape [2, 8, 4, 4] takes 1024");
    EXPECT_REFUSED(splat_module_write(silu, "grad:y", values.data(), 1024), kState,
                   "made without gradients");
    EXPECT_REFUSED(splat_module_read(silu, "grad:x", values.data(), 1024), kState,
                   "is not computed");
    EXPECT_REFUSED(splat_module_backward(silu), kState, "without gradients");
    values[3] = NAN;
    EXPECT_REFUSED(splat_module_write(silu, "x", values.data(), 1024), kArgument,
                   "'x' holds nan at 3");
}

/// Writes after forward do not affect its backward pass, and refused writes lose nothing.
TEST_F(ApiModule, BackwardIsOfTheLatestForward) {
    const Module linear =
        make({"linear", "", {port_desc({1, 2}, "x"), port_desc({1, 2}, "weight")}});
    EXPECT_EQ(read(linear, "x", 2), Floats(2, 0)) << "not yet written";
    write(linear, "x", {2, 3});
    write(linear, "weight", {5, 7});
    ASSERT_DONE(splat_module_forward(linear));
    ASSERT_DONE(splat_module_backward(linear));
    EXPECT_EQ(read(linear, "grad:x", 2), Floats(2, 0)) << "no gradient was given";
    write(linear, "grad:y", {1});
    EXPECT_REFUSED(splat_module_backward(linear), kState, "run forward before each");
    EXPECT_EQ(read(linear, "grad:x", 2), Floats(2, 0)) << "still there";
    ASSERT_DONE(splat_module_forward(linear));
    write(linear, "x", {4, 4});
    EXPECT_REFUSED(splat_module_backward(linear), kState, "after an input had been written");
    ASSERT_DONE(splat_module_forward(linear));
    write(linear, "weight", {1, 1});
    EXPECT_REFUSED(splat_module_backward(linear), kState, "after parameters had changed");
    ASSERT_DONE(splat_module_forward(linear));
    ASSERT_DONE(splat_module_backward(linear));
    EXPECT_EQ(read(linear, "grad:x", 2), Floats(2, 1));
    EXPECT_EQ(read(linear, "grad:weight", 2), Floats(2, 4));
}

/// Writing a parameter takes effect, also where its prepared form is kept.
TEST_F(ApiModule, ParametersOfModelsAreWritten) {
    const Model model = random_model(shared_device());
    const Floats image = normal_fill(768, 4);
    const auto opacity = [&] {
        forward(model, image);
        return floats_of(256, splat_model_read, model, "opacities")[100];
    };
    for (int pass = 0; pass < 3; ++pass) EXPECT_LT(opacity(), 0.5F);
    const char* const name = "network_with_offset.out.bias";
    Floats bias(24, 0.0F);
    bias[4] = 3;
    ASSERT_DONE(splat_model_write(model, name, bias.data(), 96));
    EXPECT_GT(opacity(), 0.9F);
    EXPECT_EQ(floats_of(24, splat_model_read, model, name), bias);
    bias[7] = NAN;
    EXPECT_REFUSED(splat_model_write(model, name, bias.data(), 96), kArgument, "at 7");
    EXPECT_REFUSED(splat_model_write(model, name, bias.data(), 92), kShape, "takes 96");
    EXPECT_REFUSED(splat_model_write(model, "out.bias", bias.data(), 96), kNotFound,
                   "no parameter 'out.bias'");
}

}  // namespace
}  // namespace splat::test
