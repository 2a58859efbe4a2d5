#include "vk/recorder.h"

#include <gtest/gtest.h>

#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"
#include "test_shaders.h"

namespace splat::vk {
namespace {

using namespace test;

constexpr std::uint32_t kElements = 1000;

class RecorderBarriers : public testing::Test {
  protected:
    void SetUp() override {
        context_ = shared_context();
        a_ = device_buffer(*context_, kElements);
        b_ = device_buffer(*context_, kElements);
        c_ = device_buffer(*context_, kElements);
    }

    /// Barriers inside the list that `record` makes, not counting those at its two ends; -1 if
    /// recording failed.
    template <class Record>
    int barriers(const Record& record) {
        vk::Recorder recorder(*context_);
        record(recorder);
        auto list = need(recorder.finish());
        EXPECT_OK(context_->run(list));  // under synchronisation validation
        int count = -1;
        for (const Command& command : list.commands())
            count += command.kind == CommandKind::kBarrier ? 1 : 0;
        EXPECT_EQ(list.commands().front().kind, CommandKind::kBarrier);
        EXPECT_EQ(list.commands().back().kind, CommandKind::kToHost);
        return count;
    }

    Context* context_ = nullptr;
    Buffer a_;
    Buffer b_;
    Buffer c_;
};

TEST_F(RecorderBarriers, OrdersReadAfterWrite) {
    EXPECT_EQ(barriers([&](vk::Recorder& r) {
                  EXPECT_OK(r.fill(a_.range(), 0));
                  EXPECT_OK(r.dispatch(scale(a_.range(), b_.range(), kElements, 2)));
                  EXPECT_OK(r.copy(b_.range(), c_.range()));
              }),
              2);
}

TEST_F(RecorderBarriers, OrdersWriteAfterRead) {
    EXPECT_EQ(barriers([&](vk::Recorder& r) {
                  EXPECT_OK(r.dispatch(scale(a_.range(), b_.range(), kElements, 2)));
                  EXPECT_OK(r.fill(a_.range(), 0));
              }),
              1);
}

TEST_F(RecorderBarriers, OrdersWriteAfterWrite) {
    EXPECT_EQ(barriers([&](vk::Recorder& r) {
                  EXPECT_OK(r.dispatch(scale(a_.range(), b_.range(), kElements, 2)));
                  EXPECT_OK(r.dispatch(scale(c_.range(), b_.range(), kElements, 2)));
              }),
              1);
}

TEST_F(RecorderBarriers, OrdersReadModifyWrite) {
    EXPECT_EQ(barriers([&](vk::Recorder& r) {
                  EXPECT_OK(r.dispatch(accumulate(a_.range(), b_.range(), kElements)));
                  EXPECT_OK(r.dispatch(accumulate(a_.range(), b_.range(), kElements)));
                  EXPECT_OK(r.dispatch(accumulate(c_.range(), b_.range(), kElements)));
              }),
              2);
}

TEST_F(RecorderBarriers, LeavesIndependentCommandsUnordered) {
    const BufferView whole = a_.range();
    EXPECT_EQ(
        barriers([&](vk::Recorder& r) {
            EXPECT_OK(r.dispatch(scale(whole, b_.range(), kElements, 2)));  // both only read a
            EXPECT_OK(r.dispatch(scale(whole, c_.range(), kElements, 3)));
        }),
        0);
    EXPECT_EQ(barriers([&](vk::Recorder& r) {  // neighbouring ranges of one buffer
                  EXPECT_OK(r.fill(part(whole, 0, 1024), 0));
                  EXPECT_OK(r.fill(part(whole, 1024, 1024), 0));
                  EXPECT_OK(r.copy(part(b_.range(), 0, 512), part(whole, 2048, 512)));
              }),
              0);
    EXPECT_EQ(barriers([&](vk::Recorder& r) {  // the last byte of one is the first of the other
                  EXPECT_OK(r.fill(part(whole, 0, 1040), 0));
                  EXPECT_OK(r.fill(part(whole, 1024, 1024), 0));
              }),
              1);
}

TEST_F(RecorderBarriers, OneBarrierServesAllBeforeIt) {
    EXPECT_EQ(barriers([&](vk::Recorder& r) {
                  EXPECT_OK(r.fill(a_.range(), 0));
                  EXPECT_OK(r.fill(b_.range(), 0));
                  EXPECT_OK(r.dispatch(accumulate(a_.range(), c_.range(), kElements)));
                  EXPECT_OK(r.dispatch(scale(b_.range(), a_.range(), kElements, 1)));
              }),
              2);
}

TEST_F(RecorderBarriers, RefusesViewsWithoutBuffers) {
    vk::Recorder r(*context_);
    EXPECT_ERROR(r.dispatch(scale({}, b_.range(), kElements, 2)), Code::kInternal, "no buffer");
    vk::BufferView nothing;
    nothing.bytes = a_.range().bytes;
    EXPECT_ERROR(r.copy(nothing, a_.range()), Code::kInternal, "no buffer");
    EXPECT_ERROR(r.copy(a_.range(), nothing), Code::kInternal, "no buffer");
    EXPECT_TRUE(r.finish().value().commands().empty());
}

/// Submits are cut by the estimates, so a forgotten one might keep a GPU busy for too long.
TEST_F(RecorderBarriers, RefusesWorkWithoutAnEstimate) {
    vk::Recorder r(*context_);
    Dispatch forgotten = scale(a_.range(), b_.range(), kElements, 2);
    forgotten.work = {};
    EXPECT_ERROR(r.dispatch(forgotten), Code::kInternal,
                 "no estimate of the work of shader test_scale");
    EXPECT_TRUE(r.finish().value().commands().empty());
}

TEST_F(RecorderBarriers, RefusesUndeclaredAliasing) {
    vk::Recorder r(*context_);
    EXPECT_ERROR(r.dispatch(scale(a_.range(), a_.range(), kElements, 2)), Code::kInternal, "alias");
    Dispatch in_place = scale(a_.range(), a_.range(), kElements, 2);
    in_place.may_alias = true;
    EXPECT_OK(r.dispatch(in_place));
    Dispatch shifted = scale(part(a_.range(), 0, 2048), part(a_.range(), 1024, 2048), 512, 2);
    shifted.may_alias = true;  // the same range is fine, an overlap never is
    EXPECT_ERROR(r.dispatch(shifted), Code::kInternal, "alias");
    EXPECT_ERROR(r.copy(part(a_.range(), 0, 2048), part(a_.range(), 1024, 2048)), Code::kInternal,
                 "overlap");
    EXPECT_OK(r.dispatch(scale(part(a_.range(), 0, 1024), part(a_.range(), 1024, 1024), 256, 2)));
}

TEST_F(RecorderBarriers, RefusesDeclarationsThatDifferFromTheShader) {
    vk::Recorder r(*context_);
    Dispatch wrong = scale(a_.range(), b_.range(), kElements, 2);
    wrong.accesses = {read(a_.range()), read_write(b_.range())};
    EXPECT_ERROR(r.dispatch(wrong), Code::kInternal, "binding 1");
    wrong.accesses = {read(a_.range()), read(b_.range())};
    EXPECT_ERROR(r.dispatch(wrong), Code::kInternal, "binding 1");
    wrong.accesses = {read_write(a_.range()), write(b_.range())};
    EXPECT_ERROR(r.dispatch(wrong), Code::kInternal, "binding 0");
    Dispatch rmw = accumulate(a_.range(), b_.range(), kElements);
    rmw.accesses[1].use = Use::kWrite;
    EXPECT_ERROR(r.dispatch(rmw), Code::kInternal, "binding 1");
    wrong.accesses = {read(a_.range())};
    EXPECT_ERROR(r.dispatch(wrong), Code::kInternal, "1 accesses");
    wrong.accesses = {read(a_.range()), write(b_.range()), write(c_.range())};
    EXPECT_ERROR(r.dispatch(wrong), Code::kInternal, "3 accesses");
    EXPECT_TRUE(r.finish().value().empty());
}

TEST_F(RecorderBarriers, RefusesWrongPushSizeAndShader) {
    vk::Recorder r(*context_);
    Dispatch wrong = scale(a_.range(), b_.range(), kElements, 2);
    wrong.push = kElements;
    EXPECT_ERROR(r.dispatch(wrong), Code::kInternal, "push constants");
    wrong.shader = "test_absent";
    EXPECT_ERROR(r.dispatch(wrong), Code::kInternal, "test_absent");
}

TEST_F(RecorderBarriers, FindsTheModuleForTheKernels) {
    const auto module_of = [&](Dispatch dispatch, std::optional<Kernels> kernels) -> std::string {
        vk::Recorder r(*context_);
        dispatch.kernels = kernels;
        EXPECT_OK(r.dispatch(dispatch));
        const auto list = r.finish();
        EXPECT_OK(list);
        for (const Command& command : list.value().commands())
            if (command.kind == CommandKind::kDispatch) return command.shader;
        return "";
    };
    const Dispatch add = accumulate(a_.range(), b_.range(), kElements);  // for CPUs, too
    EXPECT_EQ(module_of(add, Kernels::kPlain), "test_accumulate");
    EXPECT_EQ(module_of(add, Kernels::kCpu), "test_accumulate_cpu");
    EXPECT_EQ(module_of(add, Kernels::kGpu), "test_accumulate");
    EXPECT_EQ(module_of(add, {}), module_of(add, context_->device().kernels()));
    const Dispatch ones = test::ones(b_.range(), kElements);  // for CPUs and GPUs alone
    EXPECT_EQ(module_of(ones, Kernels::kCpu), "test_ones_cpu");
    EXPECT_EQ(module_of(ones, Kernels::kGpu), "test_ones_gpu");
}

TEST_F(RecorderBarriers, RefusesStemsWithoutAModule) {
    vk::Recorder r(*context_);
    Dispatch wrong = test::ones(b_.range(), kElements);
    wrong.kernels = Kernels::kPlain;
    EXPECT_ERROR(r.dispatch(wrong), Code::kInternal,
                 "ones: no shader 'test_ones' is built in for plain kernels");
    wrong.kernels = Kernels::kCpu;
    wrong.shader = "test_ones_cpu";  // a module, not a stem
    EXPECT_ERROR(r.dispatch(wrong), Code::kInternal, "'test_ones_cpu'");
}

TEST_F(RecorderBarriers, RefusesGroupsBeyondTheDevice) {
    vk::Recorder r(*context_);
    Dispatch wrong = scale(a_.range(), b_.range(), kElements, 2);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        wrong.groups = {1, 1, 1};
        wrong.groups[axis] = 0;
        EXPECT_ERROR(r.dispatch(wrong), Code::kUnsupported, "workgroups");
        if (context_->device().info().limits.max_groups[axis] == ~0U) continue;
        wrong.groups[axis] = context_->device().info().limits.max_groups[axis] + 1;
        EXPECT_ERROR(r.dispatch(wrong), Code::kUnsupported, "workgroups");
    }
}

TEST_F(RecorderBarriers, RefusesViewsBeyondTheBindingLimit) {
    ContextDesc desc = context_desc();
    desc.device.fake = [](DeviceInfo& info) {
        info.limits.max_storage_buffer_bytes = 4096;
        info.limits.max_texel_elements = 64;
    };
    const auto context = make_context(desc);
    const Buffer x = device_buffer(*context, 1028);
    const Buffer y = device_buffer(*context, 1028);
    vk::Recorder r(*context);
    EXPECT_OK(r.dispatch(scale(part(x.range(), 0, 4096), part(y.range(), 0, 4096), 1024, 2)));
    EXPECT_ERROR(r.dispatch(scale(x.range(), part(y.range(), 0, 4096), 1024, 2)),
                 Code::kUnsupported, "4112");
    Dispatch texel = test::texel(part(x.range(), 0, 1024), part(y.range(), 0, 1024), 64);
    EXPECT_OK(r.dispatch(texel));
    texel.accesses[0] = read(part(x.range(), 0, 1040));
    EXPECT_ERROR(r.dispatch(texel), Code::kUnsupported, "1040");
}

TEST_F(RecorderBarriers, ComputesThroughBothKindsOfLoads) {
    const std::vector<float> x = integer_fill(kElements, 1);
    const Buffer in = upload(*context_, x);
    CommandList list =
        test::record(*context_, {scale(in.range(), b_.range(), kElements, 3, 1),
                                 test::texel(b_.range(), c_.range(), kElements / 4)});
    EXPECT_OK(context_->run(list));
    const std::vector<float> y = download(*context_, c_.range(), kElements);
    for (std::uint32_t i = 0; i < kElements; ++i) ASSERT_EQ(y[i], 2 * (3 * x[i] + 1)) << i;
}

TEST_F(RecorderBarriers, EmptyListRuns) {
    vk::Recorder r(*context_);
    CommandList list = need(r.finish());
    EXPECT_TRUE(list.empty());
    EXPECT_TRUE(list.commands().empty());
    EXPECT_OK(context_->run(list));
}

}  // namespace
}  // namespace splat::vk
