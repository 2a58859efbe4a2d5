#include "second_golden/layer_files.h"

namespace splat::golden {
namespace {

/// [N, C, H, W] of an image and the channels of the result.
struct ConvCase {
    const char* name;
    Dims x;
    std::size_t out;
    std::size_t kernel;  ///< 0 = no convolution
    Values filter;       ///< filter of the resampling by two; empty = none
    bool up = false;
};

void put_conv(Arrays& arrays, Numbers& numbers, const ConvCase& c) {
    Case made(arrays, numbers, c.name);
    Id x = made.input("x", c.x);
    Layers layers = made.layers();
    if (!c.filter.empty()) x = layers.resample(x, c.up, c.filter);
    if (c.kernel != 0) x = layers.conv("", x, c.out, c.kernel);
    if (c.filter.empty() || c.filter == Values{1, 1})
        made.put_config(
            {c.x[1], c.out, c.kernel, c.up ? 1U : 0U, c.filter.empty() || c.up ? 0U : 1U});
    made.finish(x);
}

const Values kBox = {1, 1};

}  // namespace

Arrays conv_file() {
    Arrays arrays;
    Numbers numbers(1);
    for (const ConvCase& c :
         {ConvCase{"c3", {3, 5, 7, 9}, 13, 3, {}}, ConvCase{"c1", {1, 9, 5, 3}, 7, 1, {}},
          ConvCase{"c3wide", {1, 37, 11, 5}, 3, 3, {}},
          ConvCase{"c3up", {1, 5, 3, 7}, 6, 3, kBox, true},
          ConvCase{"c3dn", {3, 7, 6, 10}, 11, 3, kBox},
          ConvCase{"c1up", {3, 3, 5, 1}, 17, 1, kBox, true},
          ConvCase{"c1dn", {1, 13, 10, 2}, 5, 1, kBox},
          ConvCase{"c0up", {3, 7, 5, 3}, 7, 0, kBox, true},
          ConvCase{"c0dn", {1, 9, 14, 6}, 9, 0, kBox},
          ConvCase{"f1331up", {1, 9, 5, 3}, 4, 3, {1, 3, 3, 1}, true},
          ConvCase{"f1221dn", {3, 2, 10, 6}, 7, 1, {1, 2, 2, 1}}})
        put_conv(arrays, numbers, c);
    return arrays;
}

namespace {

void put_group_norm(Arrays& arrays, Numbers& numbers, const char* name, const Dims& dims,
                    std::size_t groups, double eps) {
    Case made(arrays, numbers, name);
    const Id x = made.input("x", dims);
    made.put_config({dims[1], groups});
    made.put("eps", test::npy_f64({1}, {eps}));
    made.finish(made.layers().norm("", x, groups, eps, false));
}

void put_attention(Arrays& arrays, Numbers& numbers) {
    Case made(arrays, numbers, "att");
    const Id q = made.input("q", {3, 12, 15});
    const Id k = made.input("k", {3, 12, 22});
    const Id v = made.input("v", {3, 12, 22});
    made.finish(made.layers().attention(q, k, v));
}

void put_cross_attention(Arrays& arrays, Numbers& numbers) {
    Case made(arrays, numbers, "xatt");
    const Id q = made.input("q", {1, 40, 5, 3});
    const Id kv = made.input("kv", {1, 40, 3, 6});
    made.finish(made.layers().cross_attention(q, kv, Layers::groups_of(40), 3));
}

void put_embedding(Arrays& arrays, Numbers& numbers) {
    constexpr std::size_t kDimension = 14;
    const Dims dims = {5, 3};
    Tape tape;
    const Id x = tape.leaf(dims, numbers.normal(15));
    const Dims wide = {5, 3 * kDimension};
    const Id y = tape.op("positional_embedding", {x},
                         {{"dimension", kDimension}, {"swap_halves", 0}}, {wide})[0];
    arrays["pe.x"] = test::npy_f32(dims, tape.values(x));
    arrays["pe.y"] = test::npy_f32(wide, tape.values(y));
    arrays["pe.cfg"] = test::npy_i32({kDimension, 10000});
}

}  // namespace

Arrays norm_file() {
    Arrays arrays;
    Numbers numbers(2);
    put_group_norm(arrays, numbers, "gn0", {3, 12, 5, 3}, 3, 1e-6);
    put_group_norm(arrays, numbers, "gn1", {1, 40, 7, 2}, 10, 1e-5);
    put_group_norm(arrays, numbers, "gn2", {3, 30, 1, 9}, 5, 1e-3);
    {
        Case made(arrays, numbers, "lin");
        made.finish(made.layers().linear("", made.input("x", {7, 19}), 23));
    }
    {
        Case made(arrays, numbers, "silu");
        const Dims dims = {3, 57};
        made.finish(made.tape().op("silu", {made.input("x", dims)}, {}, {dims})[0]);
    }
    put_attention(arrays, numbers);
    put_cross_attention(arrays, numbers);
    put_embedding(arrays, numbers);
    return arrays;
}

namespace {

struct BlockCase {
    const char* name;
    Dims x;
    BlockSpec spec;
    std::size_t embedding = 0;  ///< length; 0 = none
    double dropout = 0;         ///< rate of the mask before conv1
};

void put_block(Arrays& arrays, Numbers& numbers, const BlockCase& c) {
    Case made(arrays, numbers, c.name);
    const Id x = made.input("x", c.x);
    BlockSpec spec = c.spec;
    spec.in = c.x[1];
    if (c.embedding != 0) spec.emb = made.input("emb", {c.x[0], c.embedding});
    if (c.dropout == 0) {
        made.put_config({spec.in, spec.out, c.embedding, spec.up ? 1U : 0U, spec.down ? 1U : 0U,
                         spec.attention ? 1U : 0U, spec.views, Layers::groups_of(spec.in),
                         Layers::groups_of(spec.out)});
    } else {
        const Dims dims = {c.x[0], spec.out, c.x[2], c.x[3]};
        spec.mask = numbers.mask(elements_of(dims), c.dropout);
        made.put("mask", test::npy_f32(dims, spec.mask));
    }
    made.finish(made.layers().block("", x, spec));
}

}  // namespace

Arrays block_file() {
    Arrays arrays;
    Numbers numbers(3);
    const auto spec = [](std::size_t out, bool up, bool down, bool attention,
                         std::size_t views = 1) {
        return BlockSpec{0, out, up, down, attention, views};
    };
    for (const BlockCase& c :
         {BlockCase{"same", {3, 20, 5, 7}, spec(20, false, false, false)},
          BlockCase{"narrow", {1, 36, 9, 3}, spec(12, false, false, false)},
          BlockCase{"att", {1, 12, 7, 5}, spec(28, false, false, true)},
          BlockCase{"up", {1, 28, 3, 5}, spec(8, true, false, false)},
          BlockCase{"dn", {3, 8, 10, 6}, spec(28, false, true, false)},
          BlockCase{"film", {1, 20, 5, 3}, spec(12, false, false, false), 14},
          BlockCase{"filmatt", {3, 12, 3, 5}, spec(12, false, false, true), 6},
          BlockCase{"filmup", {1, 12, 3, 3}, spec(20, true, false, false), 10},
          BlockCase{"filmdn", {1, 20, 6, 10}, spec(20, false, true, false), 26},
          BlockCase{"att3v", {3, 20, 5, 3}, spec(12, false, false, true, 3)},
          BlockCase{"drop", {3, 12, 7, 3}, spec(36, false, false, false), 0, 0.25}})
        put_block(arrays, numbers, c);
    return arrays;
}

namespace {

/// Weights with adapters have no gradient; nothing else is frozen.
bool is_adapted(const std::string& name) {
    for (const char* layer : {"conv0.", "conv1.", "qkv.", "proj.", ""})
        if (name == std::string(layer) + "weight") return true;
    return false;
}

Layers adapted_layers(Case& made, std::size_t rank, double scaling) {
    made.frozen = is_adapted;
    made.put("scaling", test::npy_f32({1}, {scaling}));
    Layers layers = made.layers();
    layers.rank = rank;
    layers.scaling = scaling;
    return layers;
}

void put_merged(Arrays& arrays, const std::string& name) {
    arrays[name + ".merged_y"] = arrays.at(name + ".y");
    arrays[name + ".merged_w"] = arrays[name + ".unmerged_w"] = arrays.at(name + ".p.weight");
}

void put_adapted_conv(Arrays& arrays, Numbers& numbers, const ConvCase& c, std::size_t rank,
                      double scaling) {
    Case made(arrays, numbers, c.name);
    const Id x = made.input("x", c.x);
    made.finish(adapted_layers(made, rank, scaling).conv("", x, c.out, c.kernel, true));
    put_merged(arrays, c.name);
}

}  // namespace

Arrays lora_file() {
    Arrays arrays;
    Numbers numbers(4);
    {
        Case made(arrays, numbers, "lin");
        const Id x = made.input("x", {7, 10});
        made.finish(adapted_layers(made, 3, 0.75).linear("", x, 13, true));
        put_merged(arrays, "lin");
    }
    {
        Case made(arrays, numbers, "lindrop");
        const Id x = made.input("x", {3, 22});
        const Values mask = numbers.mask(66, 0.5);
        made.put("mask", test::npy_f32({3, 22}, mask));
        made.finish(adapted_layers(made, 1, 2).masked_linear("", x, 5, mask));
    }
    put_adapted_conv(arrays, numbers, {"c3", {1, 7, 5, 9}, 11, 3, {}}, 7, 0.5);
    put_adapted_conv(arrays, numbers, {"c1", {3, 9, 3, 7}, 5, 1, {}}, 2, 1.25);
    put_conv(arrays, numbers, {"c3up", {3, 5, 3, 1}, 9, 3, kBox, true});
    put_conv(arrays, numbers, {"c3dn", {1, 7, 10, 6}, 3, 3, kBox});
    {
        Case made(arrays, numbers, "block");
        const Id x = made.input("x", {3, 20, 3, 5});
        made.finish(
            adapted_layers(made, 6, 0.5).block("", x, {.in = 20, .out = 12, .attention = true}));
    }
    return arrays;
}

}  // namespace splat::golden
