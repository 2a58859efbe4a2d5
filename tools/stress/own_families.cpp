#include "stress/own_families.h"

#include <cmath>
#include <limits>

#include "bench/ops/op_bench.h"
#include "ref/group_norm_ref.h"
#include "ref/images/resize2d_ref.h"
#include "ref/layer_norm_ref.h"
#include "ref/linear_ref.h"
#include "vkrun/cli/text.h"

namespace vkrun::stress {
namespace {

using Dims = std::vector<std::size_t>;

/// Shapes of one operator with their own values.
OpCase made(const char* op, Json attributes, std::vector<CaseTensor> inputs,
            std::vector<CaseTensor> outputs) {
    return {op, "", std::move(attributes), std::move(inputs), std::move(outputs)};
}

CaseTensor uniform(const char* name, const Dims& dims, std::uint64_t seed) {
    return filled(name, dims, seed, 0, 1);
}

CaseTensor constant(CaseTensor tensor) {
    tensor.constant = true;
    return tensor;
}

CaseTensor filled_with(const char* name, const Dims& dims, float value) {
    CaseTensor tensor = filled(name, dims, 1, 0, 0);
    for (float& element : tensor.values) element = value;
    return tensor;
}

OpCase group_norm(const Dims& x, std::size_t groups, bool silu) {
    return example_case("group_norm", splat::ref::group_norm_example(x, groups, silu));
}

OpCase linear(std::size_t rows, std::size_t in, std::size_t out) {
    return example_case("linear", splat::ref::linear_example(rows, in, out));
}

/// Numbers where exponentials overflow, vanish, or leave nothing of a sum.
void add_activation(std::vector<OpStress>& families, const std::string& op) {
    OpCase edges = bench::bench_cases(op, true).front();
    if (op == "clamp") edges.attributes = {{"least", -1e3}, {"most", 1e19}};
    const float values[] = {0.0F,   -0.0F,  1e-30F, -1e-30F, 16.0F,  -16.0F, 17.5F,  -17.5F,
                            87.0F,  -87.0F, 88.5F,  -88.5F,  89.0F,  -89.0F, 103.0F, -103.0F,
                            104.5F, 1e3F,   -1e3F,  -104.5F, 1e10F,  -1e10F, 1e19F,  -1e19F,
                            3e37F,  -3e37F, 3e38F,  -3e38F,  3.4e38F};
    std::vector<float>& x = edges.inputs[0].values;
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = i < std::size(values) ? values[i] : -3.4e38F;
    families.push_back({op + "/edges", "where exp overflows or vanishes, up to 3.4e38", edges});
    for (float& value : x) value = -std::numeric_limits<float>::infinity();
    families.push_back({op + "/minus_infinity", "-inf, whose result is the limit", edges});
}

/// The second set has more weights than are kept.
void add_attention(std::vector<OpStress>& families, bool quick) {
    const auto attention = [&](const Dims& dims, double deviation) {
        return made(
            "attention", {{"heads", 2}},
            {filled("q", dims, 1, 0, deviation), uniform("k", dims, 2), uniform("v", dims, 3)},
            {uniform("y", dims, 4)});
    };
    const auto add = [&](const std::string& name, const Dims& dims, std::vector<int> exponents) {
        for (const int exponent : exponents)
            families.push_back({format("attention/%s_1e%d", name.c_str(), exponent),
                                format("scores up to about 1e%d", exponent),
                                attention(dims, std::pow(10, exponent) / 3)});
        families.push_back(
            {"attention/" + name + "_equal", "all scores equal", attention(dims, 0)});
        OpCase one = attention(dims, 1);
        const std::size_t keys = dims[2] * dims[3];
        for (std::size_t i = 0; i < one.inputs[1].values.size(); i += keys)
            one.inputs[1].values[i] *= 1e4F;
        families.push_back(
            {"attention/" + name + "_dominant", "one key outweighs all others", one});
    };
    add("softmax", {1, 16, 5, 13},
        quick ? std::vector<int>{2, 4} : std::vector<int>{1, 2, 3, 4, 6, 30});
    if (!quick) add("blocks", {1, 8, 1, 1451}, {2, 4});
}

void add_group_norm(std::vector<OpStress>& families, bool quick) {
    const auto add = [&](const std::string& name, const std::string& input, const OpCase& op_case) {
        families.push_back({"group_norm/" + name, input, op_case});
    };
    OpCase flat = group_norm({1, 8, 5, 6}, 2, false);
    flat.inputs[0] = filled_with("x", {1, 8, 5, 6}, 1234.5F);
    add("flat", "every element 1234.5: no deviation at all", flat);
    OpCase outlier = group_norm({1, 8, 5, 6}, 2, false);
    outlier.inputs[0].values[0] = 1e6F;
    add("outlier", "one element of 1e6 among normal ones", outlier);
    add("one", "groups of one element", group_norm({2, 4, 1, 1}, 4, false));
    OpCase silu = group_norm({1, 8, 5, 6}, 2, true);
    for (float& gamma : silu.inputs[1].values) gamma *= 100;
    add("silu_1e2", "SiLU of values up to about 300", silu);
    for (const int exponent : quick ? std::vector<int>{4} : std::vector<int>{2, 3, 4, 5, 6}) {
        const auto side = static_cast<std::size_t>(std::lround(std::sqrt(std::pow(10, exponent))));
        add(format("sum_1e%d", exponent), format("groups of about 1e%d elements", exponent),
            group_norm({1, 2, side, side}, 2, false));
    }
}

void add_layer_norm(std::vector<OpStress>& families) {
    const auto norm = [](const Dims& x) {
        return example_case("layer_norm", splat::ref::layer_norm_example(x).front());
    };
    OpCase flat = norm({1, 9, 5, 6});
    flat.inputs[0] = filled_with("x", {1, 9, 5, 6}, 1234.5F);
    families.push_back({"layer_norm/flat", "every element 1234.5: no deviation at all", flat});
    OpCase outlier = norm({1, 9, 5, 6});
    outlier.inputs[0].values[0] = 1e6F;
    families.push_back({"layer_norm/outlier", "one element of 1e6 among normal ones", outlier});
    families.push_back({"layer_norm/one", "pixels of one channel", norm({2, 1, 3, 4})});
    families.push_back({"layer_norm/wide", "pixels of 4096 channels", norm({1, 4096, 2, 3})});
}

void add_resize2d(std::vector<OpStress>& families) {
    const auto add = [&](const char* name, const char* input, const splat::ref::OpExample& of) {
        families.push_back({std::string("resize2d/") + name, input, example_case("resize2d", of)});
    };
    using splat::ref::resize2d_example;
    add("cubic", "cubic, 5/3 and 4/3 of the size",
        resize2d_example({1, 5, 9, 12}, 15, 16, R"(, "filter": 1)"));
    add("cubic_antialias", "cubic, to a fifth and a seventh of the size",
        resize2d_example({1, 5, 35, 36}, 7, 5, R"(, "filter": 1, "antialias": true)"));
    add("antialias", "linear, to a sixth and a seventh of the size",
        resize2d_example({1, 5, 35, 36}, 5, 6, R"(, "antialias": true)"));
    add("wide", "a line of 4000 pixels", resize2d_example({1, 2, 1, 3001}, 1, 4003));
}

/// Sums of 10^2 to 10^7 terms.
void add_sums(std::vector<OpStress>& families, const std::string& op, bool quick) {
    const auto loss = [&](std::size_t terms) {
        const Dims dims{1, 4, terms / 20, 5};
        CaseTensor grad = filled_with("loss", {1}, 1);
        return made(op.c_str(), Json::object(),
                    {filled("a", dims, 1, 0.5, 0.25), constant(filled("b", dims, 2, 0.5, 0.25))},
                    {grad});
    };
    for (const int exponent : quick ? std::vector<int>{2, 5} : std::vector<int>{2, 3, 4, 5, 6, 7}) {
        const auto terms = static_cast<std::size_t>(std::lround(std::pow(10, exponent)));
        if (op == "linear" && exponent > 6) continue;  // rows are padded to four numbers
        families.push_back({op + format("/sum_1e%d", exponent),
                            format("sums of 1e%d terms", exponent),
                            op == "linear" ? linear(terms, 1, 2) : loss(terms)});
    }
    if (op != "linear") return;
    families.push_back({"linear/inner_1e4", "rows of 1e4 terms", linear(3, 10000, 4)});
    OpCase alternate = linear(3, 1000, 4);
    for (std::size_t i = 0; i < alternate.inputs[0].values.size(); ++i)
        alternate.inputs[0].values[i] = i % 2 == 0 ? 1e4F : -1e4F;
    families.push_back({"linear/alternating", "terms of 1e4 and -1e4 in turn", alternate});
}

void add_images(std::vector<OpStress>& families, const std::string& op) {
    const Dims dims{1, 3, 16, 21};
    const auto images = [&](CaseTensor a, CaseTensor b) {
        return made(op.c_str(), Json::object(), {std::move(a), constant(std::move(b))},
                    {filled_with("loss", {1}, 1)});
    };
    const auto add = [&](const char* name, const char* input, OpCase op_case) {
        families.push_back({op + "/" + name, input, std::move(op_case)});
    };
    const CaseTensor noise = filled("a", dims, 1, 0.5, 0.25);
    add("identical", "the same image twice", images(noise, noise));
    const CaseTensor white = filled("a", dims, 1, 1, 0);
    add("white", "two white images", images(white, white));
    add("bright", "bright and almost flat: mean 1, deviation 1e-3",
        images(filled("a", dims, 1, 1, 1e-3), filled("b", dims, 2, 1, 1e-3)));
    CaseTensor close = filled("a", dims, 1, 0.98, 1e-3);
    const std::vector<float> change = filled("", dims, 2, 0, 1e-4).values;
    const CaseTensor before = close;
    for (std::size_t i = 0; i < change.size(); ++i) close.values[i] += change[i];
    add("bright_close", "as bright, and 1e-4 between the images", images(before, close));
    add("almost_identical", "the same image, but 1e-6", images(noise, [&] {
            CaseTensor other = noise;
            for (std::size_t i = 0; i < other.values.size(); i += 3) other.values[i] *= 1.000001F;
            return other;
        }()));
    CaseTensor board = noise;
    for (std::size_t i = 0; i < board.values.size(); ++i)
        board.values[i] = (i % 21 + i / 21) % 2 == 0 ? 1.0F : 0.0F;
    add("checkerboard", "0 and 1 in turn, and its negative", images(board, [&] {
            CaseTensor other = board;
            for (float& value : other.values) value = 1 - value;
            return other;
        }()));
}

void add_conv2d(std::vector<OpStress>& families) {
    for (const int winograd : {0, 2, 4})
        for (const auto& [mean, replicate] :
             {std::pair(0.0, false), {100.0, false}, {100.0, true}}) {
            OpCase op_case =
                made("conv2d", {{"scale", 1}, {"winograd", winograd}, {"replicate", replicate}},
                     {filled("x", {1, 32, 12, 12}, 1, mean, 1),
                      filled("weight", {16, 32, 3, 3}, 2, 0, 0.06), uniform("bias", {16}, 3),
                      uniform("residual", {1, 16, 12, 12}, 4)},
                     {uniform("y", {1, 16, 12, 12}, 5)});
            const char* border = replicate ? "_replicate" : "";
            families.push_back({format("conv2d/winograd%d_mean_%g%s", winograd, mean, border),
                                format("%s, mean %g, deviation 1%s",
                                       winograd == 0   ? "direct"
                                       : winograd == 2 ? "F(2x2)"
                                                       : "F(4x4)",
                                       mean, replicate ? ", border replicated" : ""),
                                op_case});
        }
}

void add_head(std::vector<OpStress>& families) {
    OpCase zero = bench::bench_cases("gaussian_head", true).front();
    CaseTensor& raw = zero.inputs[0];
    const auto pixels = static_cast<std::size_t>(raw.dims[2] * raw.dims[3]);
    const auto channels = static_cast<std::size_t>(raw.dims[1]);
    for (std::size_t i = 0; i < raw.values.size(); ++i) {  // depth 1, offset 3, opacity 1, scale 3
        const std::size_t channel = i / pixels % channels;
        if (channel == 0 || channel == 4) raw.values[i] = i % 2 == 0 ? 50.0F : -50.0F;
        if (channel >= 5 && channel < 8) raw.values[i] = i % 2 == 0 ? 80.0F : -80.0F;
    }
    families.push_back(
        {"gaussian_head/limits", "logits of 50 and -50, scales exp(80) and exp(-80)", zero});
}

}  // namespace

std::vector<OpStress> own_families(const std::string& op, bool quick) {
    std::vector<OpStress> families;
    if (op == "attention") add_attention(families, quick);
    if (op == "conv2d") add_conv2d(families);
    if (op == "group_norm") add_group_norm(families, quick);
    if (op == "gaussian_head") add_head(families);
    if (op == "layer_norm") add_layer_norm(families);
    if (op == "resize2d") add_resize2d(families);
    if (op == "l1" || op == "l2" || op == "linear") add_sums(families, op, quick);
    if (op == "ssim") add_images(families, op);
    const OpCase usual = bench::bench_cases(op, true).front();
    if (usual.inputs.size() == 1 && usual.outputs.size() == 1 &&
        usual.inputs[0].dims == usual.outputs[0].dims)
        add_activation(families, op);
    return families;
}

}  // namespace vkrun::stress
