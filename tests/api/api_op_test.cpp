// Operators through the C API: the list, results against the references, accumulation, states.
#include <nlohmann/json.hpp>

#include "api/api_calls.h"
#include "ref/group_norm_ref.h"
#include "ref/linear_ref.h"
#include "support/compare.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using Json = nlohmann::json;

Subject subject(const char* name, bool gradient = false) {
    return {name, reproduce("C API"), gradient};
}

void expect_match(const char* op, const char* result, splat_tensor got,
                  const ref::Summed<double>& expected) {
    EXPECT_TRUE(matches(download(got), expected, tolerance(op, result),
                        subject(result, std::string(result).starts_with("grad_"))));
}

TEST(ApiOpList, IsJsonWithWhatTheHeaderSays) {
    const Json list = Json::parse(text_of(splat_op_list));
    ASSERT_TRUE(list.is_array());
    std::vector<std::string> names;
    for (const Json& op : list) {
        names.push_back(op.at("name"));
        EXPECT_FALSE(op.at("equation").get<std::string>().empty());
        for (const char* field : {"inputs", "outputs", "saved", "attributes"})
            EXPECT_TRUE(op.at(field).is_array()) << op;
        EXPECT_FALSE(op.at("inputs").empty());
        for (const Json& attribute : op.at("attributes")) {
            EXPECT_FALSE(attribute.at("about").get<std::string>().empty());
            const std::string type = attribute.at("type");
            const Json& value = attribute.at("default");
            EXPECT_TRUE(type == "integer"  ? value.is_number_integer()
                        : type == "number" ? value.is_number()
                                           : value.is_boolean())
                << attribute;
        }
    }
    for (const char* name : {"group_norm", "linear"})
        EXPECT_EQ(std::count(names.begin(), names.end(), name), 1) << name;
}

/// group_norm on 2 x 8 x 5 x 3 with 4 groups and SiLU, all gradients.
struct GroupNorm {
    explicit GroupNorm(splat_device device) : device_(device) {
        in.shape = {2, 8, 15, 4};
        in.eps = 1e-5;
        in.silu = true;
        in.x = to_double(x_values);
        in.gamma = to_double(gamma_values);
        in.beta = to_double(beta_values);
    }

    [[nodiscard]] OpRequest request(std::uint32_t flags = 0) const {
        OpRequest request("group_norm", {x, gamma, beta}, {y});
        request.attributes = R"({"groups": 4, "eps": 1e-5, "silu": true})";
        request.flags = flags;
        request.grad_outputs = {grad_y};
        request.grad_inputs = {grad_x, grad_gamma, grad_beta};
        return request;
    }

    splat_device device_;
    Floats x_values = normal_fill(240, 1, 0.5, 2);
    Floats gamma_values = normal_fill(8, 2, 1);
    Floats beta_values = normal_fill(8, 3);
    Floats grad_y_values = normal_fill(240, 4);
    ref::GroupNormInput<double> in;
    Tensor x = upload(device_, {2, 8, 5, 3}, x_values, "x");
    Tensor gamma = upload(device_, {8}, gamma_values, "gamma");
    Tensor beta = upload(device_, {8}, beta_values, "beta");
    Tensor y = make_tensor(device_, {2, 8, 5, 3}, "y");
    Tensor grad_y = upload(device_, {2, 8, 5, 3}, grad_y_values, "grad_y");
    Tensor grad_x = make_tensor(device_, {2, 8, 5, 3}, "grad_x");
    Tensor grad_gamma = upload(device_, {8}, Floats(8, 100.0F), "grad_gamma");
    Tensor grad_beta = upload(device_, {8}, Floats(8, 100.0F), "grad_beta");
};

TEST(ApiOp, GroupNormMatchesFloat64) {
    const GroupNorm norm(shared_device());
    const Op op = make_op(shared_device(), norm.request());
    ASSERT_DONE(splat_op_forward(op));
    ASSERT_DONE(splat_op_backward(op));
    const auto forward = ref::group_norm_forward(norm.in);
    const auto backward = ref::group_norm_backward(norm.in, to_double(norm.grad_y_values));
    expect_match("group_norm", "y", norm.y, forward.y);
    expect_match("group_norm", "grad_x", norm.grad_x, backward.grad_x);
    expect_match("group_norm", "grad_gamma", norm.grad_gamma, backward.grad_gamma);
    expect_match("group_norm", "grad_beta", norm.grad_beta, backward.grad_beta);
}

/// linear, 5 rows, 7 -> 3.
struct Linear {
    explicit Linear(splat_device device) : device_(device) {
        in = {{5, 7, 3}, to_double(x_values), to_double(weight_values), to_double(bias_values)};
    }

    [[nodiscard]] OpRequest request(bool with_bias = true) const {
        OpRequest request("linear", {x, weight, with_bias ? bias.get() : nullptr}, {y});
        request.grad_outputs = {grad_y};
        request.grad_inputs = {grad_x, grad_weight, with_bias ? grad_bias.get() : nullptr};
        return request;
    }

    splat_device device_;
    Floats x_values = normal_fill(35, 5);
    Floats weight_values = normal_fill(21, 6);
    Floats bias_values = normal_fill(3, 7);
    Floats grad_y_values = normal_fill(15, 8);
    ref::LinearInput<double> in;
    Tensor x = upload(device_, {5, 7}, x_values, "x");
    Tensor weight = upload(device_, {3, 7}, weight_values, "weight");
    Tensor bias = upload(device_, {3}, bias_values, "bias");
    Tensor y = make_tensor(device_, {5, 3}, "y");
    Tensor grad_y = upload(device_, {5, 3}, grad_y_values, "grad_y");
    Tensor grad_x = make_tensor(device_, {5, 7}, "grad_x");
    Tensor grad_weight = make_tensor(device_, {3, 7}, "grad_weight");
    Tensor grad_bias = make_tensor(device_, {3}, "grad_bias");
};

TEST(ApiOp, LinearMatchesFloat64) {
    Linear linear(shared_device());
    for (const bool with_bias : {true, false}) {
        const Op op = make_op(shared_device(), linear.request(with_bias));
        ASSERT_DONE(splat_op_forward(op));
        ASSERT_DONE(splat_op_backward(op));
        if (!with_bias) linear.in.bias.clear();
        const auto backward = ref::linear_backward(linear.in, to_double(linear.grad_y_values));
        expect_match("linear", "y", linear.y, ref::linear_forward(linear.in));
        expect_match("linear", "grad_x", linear.grad_x, backward.grad_x);
        expect_match("linear", "grad_weight", linear.grad_weight, backward.grad_weight);
        if (with_bias) expect_match("linear", "grad_bias", linear.grad_bias, backward.grad_bias);
    }
}

TEST(ApiOp, AccumulateAddsToParameterGradientsOnly) {
    const GroupNorm norm(shared_device());
    const Op once = make_op(shared_device(), norm.request());
    ASSERT_DONE(splat_op_forward(once));
    ASSERT_DONE(splat_op_backward(once));
    const Floats grad_x = download(norm.grad_x);
    const Floats grad_beta = download(norm.grad_beta);
    const Floats start(8, 100.0F);
    write(norm.grad_beta, start);
    const Op adding = make_op(shared_device(), norm.request(SPLAT_OP_ACCUMULATE));
    ASSERT_DONE(splat_op_forward(adding));
    for (int pass = 1; pass <= 2; ++pass) {
        ASSERT_DONE(splat_op_backward(adding));
        const Floats sum = download(norm.grad_beta);
        for (std::size_t c = 0; c < sum.size(); ++c)
            EXPECT_NEAR(sum[c], 100.0F + static_cast<float>(pass) * grad_beta[c], 1e-4F);
        EXPECT_EQ(download(norm.grad_x), grad_x);
    }
}

TEST(ApiOp, GradientsNotWantedAreLeftOut) {
    const GroupNorm norm(shared_device());
    OpRequest request = norm.request();
    request.grad_inputs = {nullptr, nullptr, norm.grad_beta};
    const Op op = make_op(shared_device(), request);
    ASSERT_DONE(splat_op_forward(op));
    ASSERT_DONE(splat_op_backward(op));
    EXPECT_EQ(download(norm.grad_gamma), Floats(8, 100.0F));
    EXPECT_NE(download(norm.grad_beta), Floats(8, 100.0F));
    EXPECT_EQ(download(norm.grad_x), Floats(240, 0.0F));
}

TEST(ApiOp, ContentsMayChangeBetweenRuns) {
    const Linear linear(shared_device());
    const Op op = make_op(shared_device(), linear.request());
    ASSERT_DONE(splat_op_forward(op));
    const Floats first = download(linear.y);
    const Floats zeros(35);
    write(linear.x, zeros);
    ASSERT_DONE(splat_op_forward(op));
    EXPECT_NE(download(linear.y), first);
    ASSERT_DONE(splat_tensor_write(linear.x, linear.x_values.data(), 35 * 4, nullptr));
    ASSERT_DONE(splat_op_forward(op));
    EXPECT_TRUE(bit_equal(download(linear.y), first, subject("y")));
}

TEST(ApiOp, BackwardNeedsForwardAndGradients) {
    const Linear linear(shared_device());
    const Op op = make_op(shared_device(), linear.request());
    EXPECT_REFUSED(splat_op_backward(op), kState, "first forward");
    OpRequest request = linear.request();
    request.grad_outputs.clear();
    request.grad_inputs.clear();
    const Op forward_only = make_op(shared_device(), request);
    ASSERT_DONE(splat_op_forward(forward_only));
    EXPECT_REFUSED(splat_op_backward(forward_only), kState, "grad_outputs");
    EXPECT_EQ(download(linear.grad_x), Floats(35, 0.0F));
}

TEST(ApiOp, WaitsForNoMappedTensor) {
    const Linear linear(shared_device());
    const Op op = make_op(shared_device(), linear.request());
    for (splat_tensor tensor : {linear.x.get(), linear.y.get(), linear.grad_weight.get()}) {
        mapped(tensor, SPLAT_ACCESS_READ);
        EXPECT_REFUSED(splat_op_forward(op), kState, "unmap");
        EXPECT_REFUSED(splat_op_backward(op), kState, "unmap");
        ASSERT_DONE(splat_tensor_unmap(tensor));
    }
    EXPECT_DONE(splat_op_forward(op));
    EXPECT_DONE(splat_op_backward(op));
}

}  // namespace
}  // namespace splat::test
