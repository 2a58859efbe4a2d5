// What every function of each element must do, as the examples of its reference ask for its attributes.
#include "ops/activations/activation.h"

#include <gtest/gtest.h>

#include <set>

#include "ops/op_harness.h"
#include "support/gpu_buffers.h"

namespace splat::test {
namespace {

class Activation : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Activation);

/// Clamp has a plan of its own, which also checks its bounds.
bool is_activation(const ops::OpRow& row) {
    return row.plan == ops::activation_plan || std::string_view(row.name) == "clamp";
}

/// Calls use(call, name) for each activation and list of attributes, with x of that shape.
void for_each_activation(const Shape& shape, std::uint64_t seed,
                         const std::function<void(const OpCall&, const std::string&)>& use) {
    std::size_t calls = 0;
    for (const OpCall& call : op_samples()) {
        if (!is_activation(*ops::find_op(call.op).value())) continue;
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
        if (!is_activation(*row)) continue;
        for (const ops::Attribute& attribute : row->attributes)
            EXPECT_EQ(tried.count(std::string(row->name) + "." + attribute.name), 1U)
                << row->name << ": no example of its reference has " << attribute.name;
    }
}

TEST_P(Activation, MatchesFloat64) {
    std::uint64_t seed = 10;
    std::vector<Shape> shapes = image_shapes();
    shapes.push_back({1027});  // such as opacities
    for (const Shape& shape : shapes)
        for_each_activation(shape, ++seed, [&](const OpCall& call, const std::string& what) {
            expect_float64(context(), call, what);
        });
}

/// What comes after it reads whole quads.
TEST_P(Activation, LeavesTheChannelsBeyondTheLastZero) {
    const Shape shape{1, 6};
    for (const ops::OpRow* row : ops::op_table()) {
        if (!is_activation(*row)) continue;
        const vk::Buffer x = upload(context(), std::vector<float>{1, 2, 3, 4, 5, 6, 0, 0});
        const vk::Buffer y = device_buffer(context(), 8);
        ops::OpViews views;
        views.inputs = {x.view(shape)};
        views.outputs = {y.view(shape)};
        for (vk::BufferView* view : {&views.inputs[0], &views.outputs[0]}) view->bytes = 32;
        vk::Recorder recorder(context());
        const char* bounds = std::string_view(row->name) == "clamp" ? R"({"least": 1})" : "{}";
        const auto given = need(parse_flat_json(bounds, "attributes"));
        ASSERT_OK(row->forward(recorder, need(ops::complete_attributes(*row, given)), views));
        vk::CommandList list = need(recorder.finish());
        ASSERT_OK(context().run(list));
        const std::vector<float> quads = download(context(), y.range(), 8);
        for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(quads[i] != 0, i < 6) << row->name << i;
    }
}

TEST_P(Activation, RejectsBadShapes) {
    EXPECT_ERROR(
        ops::activation_plan(vk::Recorder(context()),
                             need(ops::complete_attributes(*need(ops::find_op("relu")), {})),
                             std::vector<Shape>{{}})
            .status(),
        Code::kShape, "channels");
}

TEST(ActivationReference, GradcheckFloat64) {
    for_each_activation({10, 4}, 1,
                        [](const OpCall& call, const std::string&) { expect_gradcheck(call); });
}

}  // namespace
}  // namespace splat::test
