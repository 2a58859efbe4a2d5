// What every function of each element must do, as the examples of its reference ask for its attributes.
#include "ops/activations/activation.h"

#include <gtest/gtest.h>

#include <set>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class Activation : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Activation);

/// Calls use(call, name) for each activation and list of attributes, with x of that shape.
void for_each_activation(const Shape& shape, std::uint64_t seed,
                         const std::function<void(const OpCall&, const std::string&)>& use) {
    std::size_t calls = 0;
    for (const OpCall& call : op_samples()) {
        if (ops::find_op(call.op).value()->plan != ops::activation_plan) continue;
        ++calls;
        use(sample(call.op, call.attributes, {normal_tensor(shape, seed, 1, 3)}, {shape}),
            call.op + call.attributes.dump() + " " + shape.text());
    }
    EXPECT_GE(calls, 4U);
}

TEST(ActivationReference, NamesEveryAttribute) {
    std::set<std::string> tried;
    for (const OpCall& call : op_samples())
        for (const auto& attribute : call.attributes.items())
            tried.insert(call.op + "." + attribute.key());
    for (const ops::OpRow* row : ops::op_table()) {
        if (row->plan != ops::activation_plan) continue;
        for (const ops::Attribute& attribute : row->attributes)
            EXPECT_EQ(tried.count(std::string(row->name) + "." + attribute.name), 1U)
                << row->name << ": no example of its reference has " << attribute.name;
    }
}

TEST_P(Activation, MatchesFloat64) {
    std::uint64_t seed = 10;
    for (const Shape& shape : image_shapes())
        for_each_activation(shape, ++seed, [&](const OpCall& call, const std::string& what) {
            expect_float64(context(), call, what);
        });
}

TEST_P(Activation, RejectsBadShapes) {
    for_each_activation({6}, 1, [&](const OpCall& call, const std::string& what) {
        EXPECT_ERROR(run_op(context(), call).status, Code::kShape, "channels") << what;
    });
}

TEST(ActivationReference, GradcheckFloat64) {
    for_each_activation({10, 4}, 1,
                        [](const OpCall& call, const std::string&) { expect_gradcheck(call); });
}

}  // namespace
}  // namespace splat::test
