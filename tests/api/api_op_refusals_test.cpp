// What splat_op_create refuses, with which code and text.
#include "api/api_calls.h"

namespace splat::test {
namespace {

/// A valid linear and a valid group_norm. Each test makes one thing invalid.
class ApiOpRefuses : public testing::Test {
  protected:
    void expect(const OpRequest& request, splat_result code, const std::string& part) {
        expect(request.desc(), code, part);
    }

    void expect(const splat_op_desc& desc, splat_result code, const std::string& part) {
        Output<splat_op> op;
        const auto before = got(splat_device_get_memory, shared_device());
        EXPECT_REFUSED(splat_op_create(shared_device(), &desc, op.out()), code, part);
        EXPECT_TRUE(op.untouched());
        const auto after = got(splat_device_get_memory, shared_device());
        EXPECT_EQ(after.live_bytes, before.live_bytes)
            << "a refused operator leaves nothing behind";
    }

    /// With one tensor replaced.
    void expect_with(OpRequest request, std::vector<splat_tensor> OpRequest::*tensors,
                     std::size_t index, splat_tensor tensor, splat_result code, const char* part) {
        (request.*tensors)[index] = tensor;
        expect(request, code, part);
    }

    [[nodiscard]] OpRequest linear() const {
        OpRequest request("linear", {x, weight, bias}, {y});
        request.grad_outputs = {grad_y};
        request.grad_inputs = {grad_x, nullptr, nullptr};
        return request;
    }

    [[nodiscard]] OpRequest norm(const char* attributes = nullptr) const {
        OpRequest request("group_norm", {image, channels, channels}, {out_image});
        request.attributes = attributes;
        return request;
    }

    Tensor x = make_tensor(shared_device(), {5, 7});
    Tensor weight = make_tensor(shared_device(), {3, 7});
    Tensor bias = make_tensor(shared_device(), {3});
    Tensor y = make_tensor(shared_device(), {5, 3});
    Tensor grad_y = make_tensor(shared_device(), {5, 3});
    Tensor grad_x = make_tensor(shared_device(), {5, 7});
    Tensor image = make_tensor(shared_device(), {2, 6, 4, 4});
    Tensor out_image = make_tensor(shared_device(), {2, 6, 4, 4});
    Tensor channels = make_tensor(shared_device(), {6});
    Tensor odd = make_tensor(shared_device(), {4, 9});
    Tensor scalar = make_tensor(shared_device(), {});
};

TEST_F(ApiOpRefuses, NothingThatIsRight) {
    make_op(shared_device(), linear());
    make_op(shared_device(), norm());
    make_op(shared_device(), norm("{}"));
}

TEST_F(ApiOpRefuses, UnknownTypes) {
    OpRequest request = linear();
    for (const char* type : {"conv9d", "", "LINEAR", "linear "}) {
        request.type = type;
        expect(request, kArgument, "group_norm, l1, l2, layer_norm, linear");
    }
    request.type = nullptr;
    expect(request, kArgument, "type is NULL");
}

TEST_F(ApiOpRefuses, GradientsOfWhatIsNotThere) {
    OpRequest request("linear", {x, weight, nullptr}, {y});
    request.grad_outputs = {grad_y};
    for (const Tensor* gradient : {&bias, &scalar}) {
        request.grad_inputs = {grad_x, nullptr, *gradient};
        expect(request, kArgument, "'grad_bias' is given, but 'bias' is not");
    }
}

TEST_F(ApiOpRefuses, Attributes) {
    struct Row {
        const char* attributes;
        const char* part;
    };
    for (const Row& row : {
             Row{R"({"group": 2})", "'group'; there are: groups eps silu"},
             Row{R"({"groups": 2.5})", "'groups' is 2.5, expected type integer"},
             Row{R"({"groups": "2"})", "'groups' is a string"},
             Row{R"({"groups": null})", "'groups' is null"},
             Row{R"({"groups": [2]})", "'groups' is an array"},
             Row{R"({"groups": {}})", "'groups' is an object"},
             Row{R"({"groups": true})", "'groups' is true, expected type integer"},
             Row{R"({"groups": 0})", "groups is 0, expected 1 to 6"},
             Row{R"({"groups": -1})", "groups is -1"},
             Row{R"({"groups": 7})", "groups is 7"},
             Row{R"({"groups": 99999999999999999999})", "'groups'"},
             Row{R"({"groups": 18446744073709551615})", "groups"},
             Row{R"({"eps": "x"})", "'eps' is a string"},
             Row{R"({"eps": 0})", "eps is 0"},
             Row{R"({"eps": -1e-6})", "eps is -1e-06"},
             Row{R"({"eps": 1e-60})", "eps"},
             Row{R"({"eps": 1e60})", "eps"},
             Row{R"({"eps": 1e600})", "attributes"},
             Row{R"({"silu": 1})", "'silu' is 1, expected type boolean"},
             Row{"[]", "expected a JSON object"},
             Row{"7", "expected a JSON object"},
             Row{"", "not valid JSON"},
             Row{"{", "not valid JSON"},
             Row{R"({"groups": 2} x)", "not valid JSON"},
             Row{"{\"gr\xFF\": 2}", "not valid JSON"},
         })
        expect(norm(row.attributes), kArgument, row.part);
    expect(norm(R"({"groups": 4})"), kShape, "6 channels");
    OpRequest request = linear();
    request.attributes = R"({"groups": 2})";
    expect(request, kArgument, "there are: none");
    const std::string deep(1'000'000, '[');
    expect(norm(deep.c_str()), kArgument, "expected a JSON object");
    const std::string large = "{}" + std::string(17 << 20, ' ');
    expect(norm(large.c_str()), kArgument, "bytes of JSON, expected at most");
}

TEST_F(ApiOpRefuses, Counts) {
    const OpRequest request = linear();
    const auto refuse = [&](auto splat_op_desc::*member, auto value, const std::string& part) {
        splat_op_desc desc = request.desc();
        desc.*member = value;
        expect(desc, kArgument, part);
    };
    for (const std::uint32_t count : {0U, 2U, 4U, UINT32_MAX}) {
        const std::string is = "put_count is " + std::to_string(count);
        refuse(&splat_op_desc::input_count, count, "in" + is + ", expected 3");
        refuse(&splat_op_desc::output_count, count, "out" + is + ", expected 1");
    }
    refuse(&splat_op_desc::inputs, nullptr, "input");
    refuse(&splat_op_desc::outputs, nullptr, "output");
    refuse(&splat_op_desc::grad_inputs, nullptr, "together");
    refuse(&splat_op_desc::grad_outputs, nullptr, "together");
}

TEST_F(ApiOpRefuses, Shapes) {
    struct Row {
        std::vector<splat_tensor> inputs;
        splat_tensor output;
        std::vector<const char*> parts;
    };
    const std::vector<Row> rows = {
        {{odd, weight, bias}, y, {"'weight'", "[3, 7]", "[3, 9]"}},
        {{x, odd, bias}, y, {"'weight'", "[4, 9]", "[4, 7]"}},
        {{x, bias, bias}, y, {"'weight'", "[3]", "[out, in]"}},
        {{image, weight, bias}, y, {"'x'", "[2, 6, 4, 4]", "[rows, in]"}},
        {{bias, weight, bias}, y, {"'x'", "[3]", "[rows, in]"}},
        {{x, weight, channels}, y, {"'bias'", "[6]", "[3]"}},
        {{x, weight, bias}, odd, {"'y'", "[4, 9]", "[5, 3]"}},
        {{x, weight, bias}, scalar, {"'y'", "[]", "[5, 3]"}},
        {{scalar, weight, bias}, y, {"'x'", "[]"}},
        {{x, weight, scalar}, y, {"'bias'", "[]"}},
    };
    for (const Row& row : rows) {
        const OpRequest request("linear", row.inputs, {row.output});
        for (const char* part : row.parts) expect(request, kShape, part);
    }
    expect_with(linear(), &OpRequest::grad_outputs, 0, odd, kShape,
                "'grad_y' has shape [4, 9], expected [5, 3]");
    expect_with(linear(), &OpRequest::grad_inputs, 0, odd, kShape,
                "'grad_x' has shape [4, 9], expected [5, 7]");
    expect_with(norm(), &OpRequest::inputs, 1, bias, kShape, "'gamma' has shape [3], expected [6]");
    expect_with(norm(), &OpRequest::inputs, 0, channels, kShape, "'x'");
}

TEST_F(ApiOpRefuses, OtherTypesAndDevices) {
    const Tensor whole = make_tensor(shared_device(), {5, 7}, "whole", SPLAT_DTYPE_I32);
    expect_with(linear(), &OpRequest::inputs, 0, whole, kArgument, "'x' has dtype 2");
    expect_with(linear(), &OpRequest::grad_inputs, 0, whole, kArgument, "'grad_x' has dtype 2");
    const Device other = open_device();
    expect_with(linear(), &OpRequest::inputs, 1, make_tensor(other, {3, 7}), kArgument,
                "'weight' is on another device");
}

TEST_F(ApiOpRefuses, HandlesThatAreNone) {
    const splat_tensor stale = make_tensor(shared_device(), {5, 7}).destroy();
    for (const splat_tensor bad :
         {splat_tensor{nullptr}, stale, reinterpret_cast<splat_tensor>(shared_device())}) {
        expect_with(linear(), &OpRequest::inputs, 0, bad, kHandle, "'x'");
        expect_with(linear(), &OpRequest::outputs, 0, bad, kHandle, "'y'");
        expect_with(linear(), &OpRequest::grad_outputs, 0, bad, kHandle, "'grad_y'");
    }
    expect_with(linear(), &OpRequest::grad_inputs, 1, stale, kHandle, "'grad_weight'");
}

TEST_F(ApiOpRefuses, ResultsInOnePlace) {
    // A caller's mistake is never reported as a defect of the library.
    OpRequest request = norm();
    request.grad_outputs = {out_image};
    request.grad_inputs = {nullptr, channels, channels};
    expect(request, kArgument, "grad_");
    const Tensor square = make_tensor(shared_device(), {3, 3});
    request = OpRequest("linear", {weight, weight, nullptr}, {square});
    request.grad_outputs = {square};
    request.grad_inputs = {grad_x, grad_x, nullptr};
    expect(request, kArgument, "same tensor");
}

}  // namespace
}  // namespace splat::test
