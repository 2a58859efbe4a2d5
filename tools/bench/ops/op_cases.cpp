// What vkrun bench ops measures: for each operator the shapes of networks, and a small one.

#include <bit>
#include <cmath>

#include "bench/ops/op_bench.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/text.h"

namespace vkrun::bench {
namespace {

using Dims = std::vector<std::size_t>;

OpCase conv2d_case(std::size_t kernel, std::size_t in, std::size_t size, std::size_t out,
                   int winograd, bool plain) {
    OpCase result;
    result.op = "conv2d";
    result.title = format("[1,%zu,%zu,%zu] -> %zu%s", in, size, size, out,
                          kernel == 1     ? " 1x1"
                          : winograd == 0 ? ""
                          : winograd == 2 ? " F(2x2)"
                                          : " F(4x4)");
    result.attributes["scale"] = 1;
    result.attributes["winograd"] = winograd;
    const double deviation =
        1 / std::sqrt(static_cast<double>(kernel * kernel * in));  // y is of order 1
    result.inputs = {filled("x", {1, in, size, size}, 1, 0, 1),
                     filled("weight", {out, in, kernel, kernel}, 2, 0, deviation),
                     filled("bias", {out}, 3, 0, 0.25),
                     filled("residual", {1, out, size, size}, 4, 0, 1)};
    result.outputs = {filled("y", {1, out, size, size}, 5, 0, 1)};
    result.plain = plain;
    return result;
}

OpCase attention_case(std::size_t N, std::size_t C, std::size_t H, std::size_t W) {
    OpCase result;
    result.op = "attention";
    result.title = format("[%zu,%zu,%zu,%zu]", N, C, H, W);
    result.attributes["heads"] = 1;
    result.inputs = {filled("q", {N, C, H, W}, 1, 0, 1), filled("k", {N, C, H, W}, 2, 0, 1),
                     filled("v", {N, C, H, W}, 3, 0, 1)};
    result.outputs = {filled("y", {N, C, H, W}, 4, 0, 1)};
    return result;
}

OpCase loss_case(const std::string& op, std::size_t N, std::size_t H, std::size_t W) {
    OpCase result;
    result.op = op;
    result.title = format("[%zu,3,%zu,%zu]", N, H, W);
    result.attributes = Json::object();
    result.inputs = {filled("a", {N, 3, H, W}, 1, 0.5, 0.25),
                     filled("b", {N, 3, H, W}, 2, 0.5, 0.25)};
    result.inputs[1].constant = true;
    result.outputs = {filled("loss", {1}, 3, 1, 0.1)};
    return result;
}

OpCase edge_loss_case(std::size_t N, std::size_t H, std::size_t W) {
    OpCase result = loss_case("edge_loss", N, H, W);
    result.inputs.push_back({"weight", {}, {}});
    result.inputs[2].constant = true;
    return result;
}

OpCase gaussian_head_case(std::size_t N, std::size_t H, std::size_t W) {
    OpCase result;
    result.op = "gaussian_head";
    result.title = format("[%zu,24,%zu,%zu]", N, H, W);
    result.attributes["views"] = 1;
    result.attributes["znear"] = 0.8;
    result.attributes["zfar"] = 1.8;
    result.attributes["sh_degree"] = 1;
    result.inputs = {filled("net_out", {N, 24, H, W}, 1, 0, 1), filled("rays", {3, H, W}, 2, 0, 1),
                     filled("view_to_world", {N, 4, 4}, 3, 0, 0.5),
                     filled("quaternion", {N, 4}, 4, 0.5, 0.25)};
    for (const char* absent : {"focal", "origin"}) result.inputs.push_back({absent, {}, {}});
    // The last column of a pose gives w = 1.
    std::vector<float>& poses = result.inputs[2].values;
    for (std::size_t i = 3; i < poses.size(); i += 4) poses[i] = i % 16 == 15 ? 1.0F : 0.0F;
    for (std::size_t i = 1; i < result.inputs.size(); ++i) result.inputs[i].constant = true;
    const std::size_t M = H * W;
    result.outputs = {filled("means", {N, M, 3}, 5, 0, 1), filled("opacities", {N, M, 1}, 6, 0, 1),
                      filled("scales", {N, M, 3}, 7, 0, 1), filled("rotations", {N, M, 4}, 8, 0, 1),
                      filled("sh", {N, M, 4, 3}, 9, 0, 1)};
    return result;
}

CaseTensor constant(CaseTensor tensor) {
    tensor.constant = true;
    return tensor;
}

std::string dims_text(const Dims& dims) {
    std::string text;
    for (const std::size_t size : dims) {
        text += text.empty() ? '[' : ',';
        text += std::to_string(size);
    }
    return text + "]";
}

/// From x to y, or to several outputs of one shape.
OpCase simple_case(const char* op, const Json& attributes, const Dims& x, const Dims& y,
                   const std::vector<const char*>& outputs = {"y"}) {
    OpCase result;
    result.op = op;
    result.title = dims_text(x);
    for (const auto& [name, value] : attributes.items())
        result.title += " " + name + "=" + value.dump();
    result.attributes = attributes;
    result.inputs = {filled("x", x, 1, 0, 1)};
    for (const char* output : outputs)
        result.outputs.push_back(filled(output, y, 10 + result.outputs.size(), 0, 1));
    return result;
}

OpCase add_case(const Dims& dims) {
    OpCase result = simple_case("add", {{"scale", 0.5}}, dims, dims);
    result.inputs = {filled("a", dims, 1, 0, 1), filled("b", dims, 2, 0, 1)};
    return result;
}

OpCase concat_case(const Dims& a, const Dims& b) {
    OpCase result = simple_case("concat", Json::object(), a, {a[0], a[1] + b[1], a[2], a[3]});
    result.title += " " + dims_text(b);
    result.inputs = {filled("a", a, 1, 0, 1), filled("b", b, 2, 0, 1)};
    return result;
}

OpCase dropout_case(const Dims& dims) {
    OpCase result = simple_case("dropout", {{"p", 0.1}}, dims, dims);
    CaseTensor counter = constant(filled("counter", {4}, 2, 0, 0));
    for (std::uint32_t i = 0; i < 4; ++i)  // words in the bits of floats
        counter.values[i] = std::bit_cast<float>(i + 1);
    result.inputs.push_back(counter);
    return result;
}

OpCase feature_distance_case(const Dims& dims) {
    OpCase result = simple_case("feature_distance", Json::object(), dims, {dims[0], 1});
    result.inputs = {filled("a", dims, 1, 0, 1), constant(filled("b", dims, 2, 0, 1)),
                     constant(filled("weight", {dims[1]}, 3, 1, 0.1))};
    return result;
}

OpCase film_case(const Dims& dims) {
    OpCase result = simple_case("film", Json::object(), dims, dims);
    result.inputs.push_back(filled("modulation", {dims[0], 2 * dims[1]}, 2, 0, 1));
    return result;
}

OpCase fourier_case(std::size_t rows, std::size_t features, std::size_t waves) {
    OpCase result = simple_case("fourier_embedding", Json::object(), {rows, features},
                                {rows, features * 2 * waves});
    result.title += format(" of %zu", waves);
    result.inputs.push_back(constant(filled("frequencies", {waves}, 2, 0, 16)));
    return result;
}

OpCase positional_case(std::size_t rows, std::size_t features, std::size_t dimension) {
    return simple_case("positional_embedding", {{"dimension", dimension}}, {rows, features},
                       {rows, features * dimension});
}

OpCase resample_case(const Dims& x, bool up) {
    const Dims y = {x[0], x[1], up ? 2 * x[2] : x[2] / 2, up ? 2 * x[3] : x[3] / 2};
    OpCase result = simple_case("resample2d", {{up ? "up" : "down", true}}, x, y);
    result.inputs.push_back(constant({"filter", {}, {}}));
    return result;
}

OpCase split_case(const Dims& part) {
    return simple_case("split3", Json::object(), {part[0], 3 * part[1], part[2], part[3]}, part,
                       {"a", "b", "c"});
}

OpCase pool_case(const Dims& x) {
    return simple_case("max_pool2d", Json::object(), x, {x[0], x[1], x[2] / 2, x[3] / 2});
}

/// The sizes of the network. Plain kernels, which take seconds, run once per size. The 1x1 cases are two of
/// attention and a skip; the last two are an adapter of rank 4.
std::vector<OpCase> conv2d_cases(bool quick) {
    if (quick) return {conv2d_case(3, 17, 9, 12, 2, true)};
    struct Size {
        std::size_t in, image, out;
    };
    std::vector<OpCase> cases;
    for (const Size& size : {Size{128, 128, 128}, Size{256, 64, 256}, Size{256, 32, 256},
                             Size{512, 32, 256}, Size{512, 16, 256}, Size{256, 16, 256}})
        for (const int winograd : {0, 2, 4})
            cases.push_back(conv2d_case(3, size.in, size.image, size.out, winograd, winograd == 0));
    for (const Size& size : {Size{256, 16, 768}, Size{256, 16, 256}, Size{512, 32, 256}})
        cases.push_back(conv2d_case(1, size.in, size.image, size.out, 0, true));
    cases.push_back(conv2d_case(3, 256, 32, 4, 0, true));
    cases.push_back(conv2d_case(1, 4, 32, 256, 0, true));
    return cases;
}

std::vector<OpCase> linear_cases(bool quick) {
    if (quick) return {linear_case(17, 32, 24)};
    // FiLM of a batch of 4, two layers on the pixels of 32x32 and 64x64 images, and an odd one.
    return {linear_case(4, 512, 512), linear_case(1024, 256, 768), linear_case(4096, 256, 256),
            linear_case(257, 130, 129)};
}

std::vector<OpCase> group_norm_cases(bool quick) {
    if (quick) return {group_norm_case(1, 32, 8, 8, 4, true)};
    std::vector<OpCase> cases;
    for (const bool silu : {false, true}) {
        cases.push_back(group_norm_case(1, 128, 128, 128, 32, silu));
        cases.push_back(group_norm_case(1, 256, 32, 32, 32, silu));
        cases.push_back(group_norm_case(8, 256, 16, 16, 32, silu));
        cases.push_back(group_norm_case(1, 512, 16, 16, 32, silu));
    }
    return cases;
}

/// Sizes of a middle level of the network and of its largest.
template <class Make>
std::vector<OpCase> image_cases(bool quick, const Make& make) {
    if (quick) return {make(Dims{2, 6, 8, 10})};
    return {make(Dims{1, 256, 32, 32}), make(Dims{1, 128, 128, 128})};
}

struct OpCases {
    const char* op;
    std::vector<OpCase> (*cases)(bool quick);
};

/// One row per operator of splat_op_list, without the activations.
constexpr OpCases kCases[] = {
    {"add", [](bool quick) { return image_cases(quick, add_case); }},
    {"attention",
     [](bool quick) -> std::vector<OpCase> {
         if (quick) return {attention_case(1, 8, 5, 7)};
         return {attention_case(1, 256, 16, 16), attention_case(1, 256, 32, 16)};
     }},
    {"concat",
     [](bool quick) {
         return image_cases(quick, [](const Dims& dims) { return concat_case(dims, dims); });
     }},
    {"conv2d", conv2d_cases},
    {"dropout", [](bool quick) { return image_cases(quick, dropout_case); }},
    {"edge_loss",
     [](bool quick) -> std::vector<OpCase> {
         return {quick ? edge_loss_case(2, 9, 13) : edge_loss_case(4, 128, 128)};
     }},
    {"feature_distance",
     [](bool quick) -> std::vector<OpCase> {
         if (quick) return {feature_distance_case({2, 6, 5, 7})};
         return {feature_distance_case({1, 64, 128, 128}), feature_distance_case({1, 512, 8, 8})};
     }},
    {"film", [](bool quick) { return image_cases(quick, film_case); }},
    {"fourier_embedding",
     [](bool quick) -> std::vector<OpCase> {
         return {quick ? fourier_case(3, 2, 5) : fourier_case(64, 1, 128)};
     }},
    {"gaussian_head",
     [](bool quick) -> std::vector<OpCase> {
         return {quick ? gaussian_head_case(2, 5, 7) : gaussian_head_case(1, 128, 128)};
     }},
    {"group_norm", group_norm_cases},
    {"l1",
     [](bool quick) -> std::vector<OpCase> {
         return {quick ? loss_case("l1", 2, 9, 13) : loss_case("l1", 4, 128, 128)};
     }},
    {"l2",
     [](bool quick) -> std::vector<OpCase> {
         return {quick ? loss_case("l2", 2, 9, 13) : loss_case("l2", 4, 128, 128)};
     }},
    {"linear", linear_cases},
    {"max_pool2d",
     [](bool quick) -> std::vector<OpCase> {
         return {quick ? pool_case({2, 6, 8, 10}) : pool_case({1, 64, 128, 128})};
     }},
    {"positional_embedding",
     [](bool quick) -> std::vector<OpCase> {
         return {quick ? positional_case(3, 6, 10) : positional_case(64, 6, 10)};
     }},
    {"resample2d",
     [](bool quick) -> std::vector<OpCase> {
         if (quick) return {resample_case({2, 6, 8, 10}, true)};
         return {resample_case({1, 256, 32, 32}, true), resample_case({1, 128, 128, 128}, false)};
     }},
    {"split3",
     [](bool quick) -> std::vector<OpCase> {
         return {split_case(quick ? Dims{2, 6, 5, 7} : Dims{1, 256, 16, 16})};
     }},
    {"ssim",
     [](bool quick) -> std::vector<OpCase> {
         return {quick ? loss_case("ssim", 2, 9, 13) : loss_case("ssim", 4, 128, 128)};
     }},
};

/// Cases of an operator that maps each element of x by itself: without flags, and with each of
/// them.
std::vector<OpCase> activation_cases(const Json& op, bool quick) {
    const std::string name = op.at("name");
    std::vector<Json> forms = {Json::object()};
    for (const Json& flag : quick ? Json::array() : op.at("attributes"))
        forms.push_back({{flag.at("name").get<std::string>(), true}});
    std::vector<OpCase> cases;
    for (const Json& form : forms)
        for (OpCase& op_case : image_cases(quick, [&](const Dims& dims) {
                 return simple_case(name.c_str(), form, dims, dims);
             }))
            cases.push_back(std::move(op_case));
    return cases;
}

}  // namespace

std::vector<std::string> bench_ops() {
    std::vector<std::string> names;
    for (const Json& op : library_json(splat_op_list))
        names.push_back(op.at("name").get<std::string>());
    return names;
}

std::vector<OpCase> bench_cases(const std::string& op, bool quick) {
    for (const OpCases& row : kCases)
        if (op == row.op) return row.cases(quick);
    for (const Json& row : library_json(splat_op_list))
        if (row.at("name") == op && row.at("inputs") == Json{"x"} && row.at("outputs") == Json{"y"})
            return activation_cases(row, quick);
    throw Failure(kFailed, "operator '" + op + "' has no case to measure");
}

}  // namespace vkrun::bench
