#include "ops/attention.h"

#include <gtest/gtest.h>

#include <iterator>

#include "ops/op_harness.h"
#include "support/golden_file.h"

namespace splat::test {
namespace {

class Attention : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Attention);

/// On a device whose slices hold no weights: every call takes blocks, of 16 queries.
class AttentionBlocks : public KernelsTest {
  protected:
    void SetUp() override {
        KernelsTest::SetUp();
        if (IsSkipped()) return;
        vk::ContextDesc desc = context_desc(GetParam());
        desc.device.fake = [](vk::DeviceInfo& info) { info.limits.slice_bytes = 1; };
        context_ = make_context(desc);
        ASSERT_NE(context_, nullptr);
    }
    [[nodiscard]] vk::Context& blocks() const { return *context_; }

  private:
    std::shared_ptr<vk::Context> context_;
};
SPLAT_INSTANTIATE_KERNELS(AttentionBlocks);

struct AttentionShape {
    std::uint32_t n;
    std::uint32_t c;
    std::uint32_t heads;
    std::uint32_t queries;
    std::uint32_t keys;

    [[nodiscard]] OpCall call(std::uint64_t seed, double spread = 1) const {
        return sample(
            "attention", {{"heads", heads}},
            {normal_tensor({n, c, queries}, seed, 0, spread), normal_tensor({n, c, keys}, seed + 1),
             normal_tensor({n, c, keys}, seed + 2)},
            {Shape{n, c, queries}});
    }
    [[nodiscard]] std::string text() const {
        return "n=" + std::to_string(n) + " c=" + std::to_string(c) +
               " heads=" + std::to_string(heads) + " queries=" + std::to_string(queries) +
               " keys=" + std::to_string(keys);
    }
};

constexpr AttentionShape kShapes[] = {
    {1, 1, 1, 1, 1},    {2, 3, 1, 5, 7},    {1, 8, 2, 9, 9},     {2, 16, 1, 20, 20},
    {1, 6, 1, 17, 33},  {2, 12, 3, 65, 31}, {1, 32, 1, 130, 70}, {1, 17, 1, 64, 1},
    {1, 64, 1, 16, 64}, {1, 4, 1, 1, 257},  {3, 20, 1, 3, 2},    {1, 5, 1, 2, 3},
    {2, 4, 1, 7, 8},    {1, 16, 4, 15, 16}, {1, 16, 1, 16, 17},  {1, 16, 2, 31, 63},
    {1, 12, 1, 33, 65}, {2, 8, 1, 64, 127}, {1, 8, 2, 127, 9},   {1, 7, 1, 8, 5},
    {1, 33, 1, 129, 2}, {1, 3, 1, 255, 3},  {3, 12, 3, 17, 15},  {1, 64, 2, 65, 33},
    {1, 1, 1, 257, 4},  {1, 129, 1, 3, 5},
};
static_assert(std::size(kShapes) >= 24);

/// Heads of up to 64 channels, and larger ones, which CPU devices compute by other kernels.
constexpr AttentionShape kBlockShapes[] = {
    {1, 1, 1, 1, 1},    {2, 16, 1, 20, 20}, {2, 12, 3, 65, 31}, {1, 20, 1, 130, 70},
    {1, 4, 1, 1, 257},  {2, 16, 4, 15, 16}, {1, 8, 2, 127, 9},  {3, 8, 2, 64, 17},
    {1, 64, 1, 20, 40}, {1, 129, 1, 3, 5},  {2, 80, 1, 70, 33},
};

void expect_matches(vk::Context& context, const AttentionShape& shape, const OpCall& call) {
    OpExpected expected = expected_of(call);
    // A single key has weight 1: the gradients of its score are zero.
    if (shape.keys == 1) expected.grad_inputs[0] = expected.grad_inputs[1] = {};
    expect_matches(context, call, expected.outputs, expected.grad_inputs, shape.text());
}

TEST_P(Attention, MatchesFloat64) {
    std::uint64_t seed = 10;
    for (const AttentionShape& shape : kShapes)
        expect_matches(context(), shape, shape.call(seed += 5));
}

/// Scores of some hundreds, where exp would overflow if the greatest score were not subtracted.
TEST_P(Attention, LargeScoresStayFinite) {
    const AttentionShape shape{1, 16, 1, 33, 40};
    const OpResult gpu = run_op(context(), shape.call(200, 300));
    ASSERT_OK(gpu.status);
    EXPECT_TRUE(all_finite(gpu.outputs[0], {"y", reproduce("large")}));
    for (const auto& grad : gpu.grad_inputs)
        EXPECT_TRUE(all_finite(grad, {"gradients", reproduce("large")}));
    expect_matches(context(), shape, shape.call(210, 20));
}

void expect_the_mean_of_equal_keys(vk::Context& context) {
    OpCall call = AttentionShape{1, 8, 1, 5, 16}.call(300);
    for (std::size_t i = 0; i < call.inputs[1].values.size(); ++i)
        call.inputs[1].values[i] = call.inputs[1].values[i / 16 * 16];
    const OpResult gpu = run_op(context, call);
    ASSERT_OK(gpu.status);
    for (std::size_t c = 0; c < 8; ++c) {
        double mean = 0;
        for (std::size_t j = 0; j < 16; ++j)
            mean += static_cast<double>(call.inputs[2].values[c * 16 + j]) / 16;
        for (std::size_t l = 0; l < 5; ++l)
            EXPECT_NEAR(static_cast<double>(gpu.outputs[0][c * 5 + l]), mean, 1e-6);
    }
}

TEST_P(Attention, EqualKeysGiveTheMean) {
    expect_the_mean_of_equal_keys(context());
}

TEST_P(AttentionBlocks, MatchFloat64) {
    std::uint64_t seed = 10;
    for (const AttentionShape& shape : kBlockShapes)
        expect_matches(blocks(), shape, shape.call(seed += 5));
    expect_the_mean_of_equal_keys(blocks());
}

/// Scores of thousands; a key that outweighs all others, the last of them.
TEST_P(AttentionBlocks, LargeScoresStayFinite) {
    const AttentionShape shape{1, 16, 2, 33, 40};
    OpCall one = shape.call(220);
    for (std::size_t i = 39; i < one.inputs[1].values.size(); i += 40)
        one.inputs[1].values[i] *= 1e4F;
    for (const OpCall& call : {shape.call(200, 1e4), one}) {
        const OpResult gpu = run_op(blocks(), call);
        ASSERT_OK(gpu.status);
        EXPECT_TRUE(all_finite(gpu.outputs[0], {"y", reproduce("large")}));
        for (const auto& grad : gpu.grad_inputs)
            EXPECT_TRUE(all_finite(grad, {"gradients", reproduce("large")}));
    }
    expect_matches(blocks(), shape, shape.call(210, 20));
}

TEST_P(AttentionBlocks, EachGradientAlone) {
    expect_each_gradient_alone(blocks(), AttentionShape{2, 8, 2, 37, 21}.call(230));
}

/// An image of a batch has the bits that it has alone, as ranks of a training need.
TEST_P(AttentionBlocks, ImagesDoNotDependOnOthers) {
    const AttentionShape shape{3, 8, 2, 37, 21};
    OpCall call = shape.call(240);
    const OpResult all = run_op(blocks(), call);
    ASSERT_OK(all.status);
    for (auto* tensors : {&call.inputs, &call.grad_outputs})
        for (HostTensor& tensor : *tensors) {
            const std::size_t count = tensor.values.size() / 3;
            tensor.values.erase(tensor.values.begin(),
                                tensor.values.end() - static_cast<std::ptrdiff_t>(count));
            tensor.shape = {1, tensor.shape[1], tensor.shape[2]};
        }
    const OpResult last = run_op(blocks(), call);
    ASSERT_OK(last.status);
    const auto expect_tail = [](const std::vector<float>& whole, const std::vector<float>& part) {
        EXPECT_TRUE(std::equal(part.rbegin(), part.rend(), whole.rbegin()));
    };
    expect_tail(all.outputs[0], last.outputs[0]);
    for (std::size_t i = 0; i < 3; ++i) expect_tail(all.grad_inputs[i], last.grad_inputs[i]);
}

TEST_P(Attention, ImagesAreRowsOfPixels) {
    const AttentionShape shape{2, 8, 1, 12, 12};
    OpCall call = shape.call(310);
    const OpResult flat = run_op(context(), call);
    for (auto* tensors : {&call.inputs, &call.grad_outputs})
        for (HostTensor& tensor : *tensors) tensor.shape = {2, 8, 3, 4};
    const OpResult image = run_op(context(), call);
    ASSERT_OK(image.status);
    EXPECT_TRUE(bit_equal(flat.outputs[0], image.outputs[0], {"y", reproduce("4-d")}));
    EXPECT_TRUE(bit_equal(flat.grad_inputs[1], image.grad_inputs[1], {"grad_k", reproduce("4-d")}));
}

TEST_P(Attention, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("norm", [&](const Golden& golden) {
        const std::vector<std::string> names = golden.cases("k");
        golden.expect_cases(names, {"att"});
        for (const std::string& name : names) {
            OpCall call;
            call.op = "attention";
            for (const char* key : {".q", ".k", ".v"})
                call.inputs.push_back(golden_tensor(golden.npz, name + key));
            call.grad_outputs = {golden_tensor(golden.npz, name + ".g")};
            const OpResult gpu = run_op(context(), call);
            ASSERT_OK(gpu.status) << name;
            const auto check = [&](const std::vector<float>& got, const char* key, bool gradient) {
                EXPECT_TRUE(close(got, golden.doubles(name + key), kGoldenLayer, kGoldenLayer,
                                  {name + key, reproduce(golden.name), gradient}));
            };
            check(gpu.outputs[0], ".y64", false);
            check(gpu.grad_inputs[0], ".d_q64", true);
            check(gpu.grad_inputs[1], ".d_k64", true);
            check(gpu.grad_inputs[2], ".d_v64", true);
        }
    });
}

TEST_P(Attention, RejectsBadShapes) {
    const auto status = [&](const auto& change) {
        OpCall call = AttentionShape{2, 6, 1, 4, 5}.call(400);
        change(call);
        return run_op(context(), call).status;
    };
    EXPECT_OK(status([](OpCall&) {}));
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[0] = normal_tensor({2, 6}, 1);
                 }),
                 Code::kShape, "'q'");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[1] = normal_tensor({2, 5, 6}, 1);
                 }),
                 Code::kShape, "'k'");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[2] = normal_tensor({2, 6, 4}, 1);
                 }),
                 Code::kShape, "'v'");
    EXPECT_ERROR(status([](OpCall& c) { c.attributes["heads"] = 0; }), Code::kInvalidArgument,
                 "heads");
    EXPECT_ERROR(status([](OpCall& c) { c.attributes["heads"] = 2; }), Code::kShape, "2 heads");
    EXPECT_ERROR(status([](OpCall& c) { c.attributes["heads"] = 4; }), Code::kShape, "4 heads");
}

TEST(AttentionReference, GradcheckFloat64) {
    for (const AttentionShape& shape :
         {AttentionShape{1, 3, 1, 4, 5}, AttentionShape{2, 8, 2, 3, 2}})
        expect_gradcheck(shape.call(500));
}

TEST(AttentionCheck, RefusesWhatIsTooLarge) {
    const vk::Recorder device(*shared_context());
    EXPECT_OK(ops::attention_check(device, {8, 256, 1, 4096, 4096}));
    EXPECT_OK(ops::attention_check(device, {1, 4, 1, 65536, 65536}));
    EXPECT_ERROR(ops::attention_check(device, {1, 4, 1, 70000, 4}), Code::kUnsupported, "65536");
    EXPECT_ERROR(ops::attention_check(device, {1, 8196, 2049, 65536, 65536}), Code::kUnsupported,
                 "2^31");
    EXPECT_ERROR(ops::attention_check(device, {~0U, 4, 1, 65536, 65536}), Code::kUnsupported,
                 "at most");
}

/// What small networks keep they keep, and the workspaces of large ones do not grow with the pairs.
TEST_P(Attention, BoundsItsMemory) {
    const vk::Recorder recorder(context());
    constexpr std::uint64_t kSlice = 16 << 20;
    ASSERT_EQ(recorder.device().limits.slice_bytes, kSlice);
    for (const std::uint32_t tokens : {256U, 1024U, 2048U})
        EXPECT_EQ(ops::attention_block(recorder, {8, 256, 1, tokens, tokens}), 0U) << tokens;
    const std::uint64_t most = GetParam() == vk::Kernels::kCpu ? kSlice : 8 * kSlice;
    const ops::AttentionDesc larges[] = {{1, 384, 6, 1201, 1201},   {1, 1024, 16, 3601, 3601},
                                         {1, 1024, 16, 4096, 4096}, {4, 1024, 16, 4096, 4096},
                                         {1, 256, 1, 65536, 65536}, {1, 256, 1, 65536, 77}};
    for (const ops::AttentionDesc& desc : larges) {
        const std::uint32_t block = ops::attention_block(recorder, desc);
        const std::uint64_t pixels = std::max(desc.queries, desc.keys);
        const std::uint64_t activation = std::uint64_t{desc.c} * pixels * 4;
        const std::uint64_t room = activation + (1 << 20);
        EXPECT_GT(block, 0U) << desc.queries;
        EXPECT_LE(ops::attention_forward_bytes(recorder, desc), room + most);
        EXPECT_LE(ops::attention_backward_bytes(recorder, desc), room + 3 * most);
    }
}

}  // namespace
}  // namespace splat::test
