// What every operator of the table must do, on the examples of its reference.
#include "ops/op_harness.h"

#include <gtest/gtest.h>

#include <set>

namespace splat::test {
namespace {

class OpSamples : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(OpSamples);

TEST(OpSamplesTable, HoldEveryOperator) {
    std::set<std::string> names;
    for (const OpCall& call : op_samples()) names.insert(call.op);
    for (const ops::OpRow* row : ops::op_table())
        EXPECT_TRUE(names.contains(row->name)) << row->name << " has no row in tests/ref";
}

TEST_P(OpSamples, MatchTheirReference) {
    for (const OpCall& call : op_samples()) {
        const OpExpected expected = expected_of(call);
        const OpResult gpu = run_op(context(), call);
        ASSERT_OK(gpu.status) << call.op;
        const auto compare = [&](const auto& got, const ref::Sums& sums) {
            ASSERT_EQ(got.size(), sums.size()) << call.op;
            for (std::size_t i = 0; i < got.size(); ++i) {
                // Winograd's algorithms round like their neighbours: 5e-6, see tolerances.h.
                const Tolerance whole{call.op, "sample", 1e9, 5e-6, ""};
                if (sums[i].value.empty()) continue;
                EXPECT_TRUE(matches(got[i], sums[i], whole,
                                    {std::to_string(i), reproduce(call.op), false, true}));
            }
        };
        compare(gpu.outputs, expected.outputs);
        compare(gpu.grad_inputs, expected.grad_inputs);
    }
}

TEST_P(OpSamples, BitEqualOverRunsAndPoison) {
    for (OpCall call : op_samples()) {
        std::vector<std::vector<float>> first;
        call.runs = 2;
        for (const std::uint32_t pattern : kPoisonPatterns) {
            vk::Context* poisoned = poisoned_context(GetParam(), pattern);
            ASSERT_NE(poisoned, nullptr);
            const OpResult gpu = run_op(*poisoned, call);
            ASSERT_OK(gpu.status) << call.op;
            std::vector<std::vector<float>> all = gpu.grad_inputs;
            all.insert(all.end(), gpu.outputs.begin(), gpu.outputs.end());
            all.insert(all.end(), gpu.saved.begin(), gpu.saved.end());
            if (first.empty()) first = all;
            for (std::size_t i = 0; i < all.size(); ++i)
                EXPECT_TRUE(bit_equal(first[i], all[i],
                                      {call.op + " " + std::to_string(i), reproduce(call.op)}));
        }
    }
}

TEST_P(OpSamples, EachGradientAlone) {
    for (const OpCall& call : op_samples()) expect_each_gradient_alone(context(), call);
}

/// Gradients of row-major inputs are added to what is there, up to one rounding; those of activations
/// overwrite it.
TEST_P(OpSamples, AccumulateAddsToParameterGradients) {
    for (OpCall call : op_samples()) {
        const ops::OpRow& row = *ops::find_op(call.op).value();
        const OpResult plain = run_op(context(), call);
        ASSERT_OK(plain.status) << call.op;
        for (const HostTensor& input : call.inputs)
            call.accumulate_to.push_back(normal_fill(input.values.size(), 77));
        const OpResult added = run_op(context(), call);
        ASSERT_OK(added.status) << call.op;
        for (std::size_t i = 0; i < plain.grad_inputs.size(); ++i) {
            const bool parameter = row.inputs[i].layout == ops::Layout::kRowMajor;
            for (std::size_t k = 0; k < plain.grad_inputs[i].size(); ++k) {
                const float before = parameter ? call.accumulate_to[i][k] : 0.0F;
                ASSERT_EQ(added.grad_inputs[i][k], plain.grad_inputs[i][k] + before)
                    << call.op << " grad_" << row.inputs[i].name << "[" << k << "]";
            }
        }
    }
}

}  // namespace
}  // namespace splat::test
