#include "second_golden/layers.h"

#include <algorithm>
#include <cmath>

namespace splat::golden {
namespace {

constexpr double kEps = 1e-6;
constexpr auto kNone = Tape::kNone;

}  // namespace

std::size_t Layers::groups_of(std::size_t channels) {
    return std::clamp<std::size_t>(channels / 4, 1, 32);
}

Id Layers::one(const char* op, const std::vector<Id>& inputs, const Dims& dims,
               const std::map<std::string, double>& attributes) {
    return tape_.op(op, inputs, attributes, {dims})[0];
}

Id Layers::norm(const std::string& name, Id x, std::size_t groups, double eps, bool silu) {
    const std::size_t channels = tape_.dims(x)[1];
    const Id gamma = parameter_(name + "weight", {channels}, Role::kScale);
    const Id beta = parameter_(name + "bias", {channels}, Role::kBias);
    return one("group_norm", {x, gamma, beta}, tape_.dims(x),
               {{"groups", static_cast<double>(groups)}, {"eps", eps}, {"silu", silu ? 1 : 0}});
}

/// W, with adapters W + scaling * B A.
Id Layers::adapted_weight(const std::string& name, const Dims& shape, bool adapted) {
    const Id weight = parameter_(name + "weight", shape, Role::kWeight);
    if (!adapted || rank == 0) return weight;
    const std::size_t columns = elements_of(shape) / shape[0];
    const Id a = parameter_(name + "lora_A", {rank, columns}, Role::kWeight);
    const Id b = parameter_(name + "lora_B", {shape[0], rank}, Role::kWeight);
    std::vector<std::size_t> transposed;
    for (std::size_t i = 0; i < rank * columns; ++i)
        transposed.push_back(i % rank * columns + i / rank);
    const Id product = one("linear", {b, tape_.gathered(a, {columns, rank}, transposed), kNone},
                           {shape[0], columns});
    return tape_.sum(weight, tape_.reshaped(product, shape), scaling);
}

Id Layers::conv(const std::string& name, Id x, std::size_t out, std::size_t kernel, bool adapted) {
    const Dims in = tape_.dims(x);
    const Id weight = adapted_weight(name, {out, in[1], kernel, kernel}, adapted);
    const Id bias = parameter_(name + "bias", {out}, Role::kBias);
    return one("conv2d", {x, weight, bias, kNone}, {in[0], out, in[2], in[3]},
               {{"scale", 1}, {"replicate", 0}});
}

Id Layers::linear(const std::string& name, Id x, std::size_t out, bool adapted) {
    const Dims in = tape_.dims(x);
    const Id weight = adapted_weight(name, {out, in[1]}, adapted);
    const Id bias = parameter_(name + "bias", {out}, Role::kBias);
    return one("linear", {x, weight, bias}, {in[0], out});
}

Id Layers::masked_linear(const std::string& name, Id x, std::size_t out, const Values& mask) {
    const Dims in = tape_.dims(x);
    const Id plain = linear(name, x, out);
    const Id a = parameter_(name + "lora_A", {rank, in[1]}, Role::kWeight);
    const Id b = parameter_(name + "lora_B", {out, rank}, Role::kWeight);
    const Id narrow = one("linear", {tape_.times(x, mask), a, kNone}, {in[0], rank});
    return tape_.sum(plain, one("linear", {narrow, b, kNone}, {in[0], out}), scaling);
}

Id Layers::resample(Id x, bool up, const Values& filter) {
    const Dims in = tape_.dims(x);
    const auto size = [up](std::size_t from) { return up ? 2 * from : from / 2; };
    return one("resample2d", {x, tape_.leaf({filter.size()}, filter)},
               {in[0], in[1], size(in[2]), size(in[3])},
               {{"up", up ? 1 : 0}, {"down", up ? 0 : 1}});
}

Id Layers::attention(Id q, Id k, Id v) {
    return one("attention", {q, k, v}, tape_.dims(q), {{"heads", 1}});
}

Id Layers::every(Id x, std::size_t of, std::size_t part) {
    Dims dims = tape_.dims(x);
    const std::size_t pixels = elements_of(dims) / (dims[0] * dims[1]);
    std::vector<std::size_t> index;
    for (std::size_t i = 0; i < elements_of(dims); ++i)
        if (i / pixels % of == part) index.push_back(i);
    dims[1] /= of;
    return tape_.gathered(x, dims, index);
}

Id Layers::joined(Id x, std::size_t views) {
    const Dims in = tape_.dims(x);
    const std::size_t pixels = in[2] * in[3];
    std::vector<std::size_t> index;
    for (std::size_t object = 0; object < in[0] / views; ++object)
        for (std::size_t c = 0; c < in[1]; ++c)
            for (std::size_t view = 0; view < views; ++view)
                for (std::size_t p = 0; p < pixels; ++p)
                    index.push_back(((object * views + view) * in[1] + c) * pixels + p);
    return tape_.gathered(x, {in[0] / views, in[1], views * in[2], in[3]}, index);
}

Id Layers::parted(Id x, std::size_t views) {
    const Dims in = tape_.dims(x);
    const std::size_t pixels = in[2] / views * in[3];
    std::vector<std::size_t> index;
    for (std::size_t image = 0; image < in[0] * views; ++image)
        for (std::size_t c = 0; c < in[1]; ++c)
            for (std::size_t p = 0; p < pixels; ++p)
                index.push_back(((image / views * in[1] + c) * views + image % views) * pixels + p);
    return tape_.gathered(x, {in[0] * views, in[1], in[2] / views, in[3]}, index);
}

/// (a + b) sqrt(1/2).
Id Layers::scaled_sum(Id a, Id b) {
    const Id sum = tape_.sum(a, b, 1);
    return tape_.times(sum, Values(elements_of(tape_.dims(sum)), std::sqrt(0.5)));
}

/// Attention over the pixels of all views, without convolutions across their borders: 1x1 only.
Id Layers::self_attention(const std::string& name, Id x, std::size_t views) {
    const Id image = joined(x, views);
    const std::size_t channels = tape_.dims(image)[1];
    const Id normed = norm(name + "norm2.", image, groups_of(channels), kEps, false);
    const Id qkv = conv(name + "qkv.", normed, 3 * channels, 1, true);
    const Id mixed = attention(every(qkv, 3, 0), every(qkv, 3, 1), every(qkv, 3, 2));
    return parted(scaled_sum(conv(name + "proj.", mixed, channels, 1, true), image), views);
}

Id Layers::block(const std::string& name, Id x, const BlockSpec& spec) {
    const bool resamples = spec.up || spec.down;
    Id original = x;
    x = norm(name + "norm0.", x, groups_of(spec.in), kEps, true);
    if (resamples) {
        x = resample(x, spec.up);
        original = resample(original, spec.up);
    }
    x = conv(name + "conv0.", x, spec.out, 3, !resamples);
    const Id gamma = parameter_(name + "norm1.weight", {spec.out}, Role::kScale);
    const Id beta = parameter_(name + "norm1.bias", {spec.out}, Role::kBias);
    const auto activated = [&](Id from) {
        return one(
            "group_norm", {from, gamma, beta}, tape_.dims(from),
            {{"groups", static_cast<double>(groups_of(spec.out))}, {"eps", kEps}, {"silu", 1}});
    };
    if (spec.emb != kNone) {
        const Id shift = linear(name + "affine.", spec.emb, spec.out);
        x = activated(one("film", {x, shift}, tape_.dims(x)));
    }
    x = activated(x);
    if (!spec.mask.empty()) x = tape_.times(x, spec.mask);
    x = conv(name + "conv1.", x, spec.out, 3, true);
    if (resamples || spec.in != spec.out) original = conv(name + "skip.", original, spec.out, 1);
    x = scaled_sum(x, original);
    return spec.attention ? self_attention(name, x, spec.views) : x;
}

Id Layers::cross_attention(Id q, Id kv, std::size_t groups, std::size_t kernel) {
    const std::size_t channels = tape_.dims(q)[1];
    const Id gamma = parameter_("norm.weight", {channels}, Role::kScale);
    const Id beta = parameter_("norm.bias", {channels}, Role::kBias);
    const auto normed = [&](Id x) {
        return one("group_norm", {x, gamma, beta}, tape_.dims(x),
                   {{"groups", static_cast<double>(groups)}, {"eps", 1e-5}, {"silu", 0}});
    };
    const Id asked = conv("q_proj.", normed(q), channels, 1);
    const Id both = conv("kv_proj.", normed(kv), 2 * channels, 1);
    const Id answer = attention(asked, every(both, 2, 0), every(both, 2, 1));
    return tape_.sum(q, conv("out_proj.", answer, channels, kernel), 1);
}

Id Layers::network(Id x, const Network& net) {
    const std::size_t size = tape_.dims(x)[2];
    const auto level_name = [&](const char* part, std::size_t r, const std::string& what) {
        const std::string side = std::to_string(r);
        return "network_with_offset.encoder." + std::string(part) + "." + side + "x" + side + "_" +
               what + ".";
    };
    const auto attends = [&](std::size_t r) {
        return std::find(net.attention.begin(), net.attention.end(), r) != net.attention.end();
    };
    const auto residual = [&](const std::string& name, std::size_t out, bool up, bool down,
                              bool attention) {
        BlockSpec spec{tape_.dims(x)[1], out, up, down, attention};
        spec.views = net.views;
        x = block(name, x, spec);
    };
    std::vector<Id> skips;
    for (std::size_t level = 0; level < net.mult.size(); ++level) {
        const std::size_t r = size >> level;
        if (level == 0) {
            x = conv(level_name("enc", r, "conv"), x, net.base, 3);
        } else {
            residual(level_name("enc", r, "down"), tape_.dims(x)[1], false, true, false);
        }
        skips.push_back(x);
        for (std::size_t i = 0; i < net.blocks; ++i) {
            residual(level_name("enc", r, "block" + std::to_string(i)), net.base * net.mult[level],
                     false, false, attends(r));
            skips.push_back(x);
        }
    }
    for (std::size_t level = net.mult.size(); level-- > 0;) {
        const std::size_t r = size >> level;
        const std::size_t channels = tape_.dims(x)[1];
        if (level + 1 == net.mult.size()) {
            residual(level_name("dec", r, "in0"), channels, false, false, true);
            residual(level_name("dec", r, "in1"), channels, false, false, false);
        } else {
            residual(level_name("dec", r, "up"), channels, true, false, false);
        }
        for (std::size_t i = 0; i <= net.blocks; ++i) {
            Dims dims = tape_.dims(x);
            dims[1] += tape_.dims(skips.back())[1];
            x = one("concat", {x, skips.back()}, dims);
            skips.pop_back();
            residual(level_name("dec", r, "block" + std::to_string(i)), net.base * net.mult[level],
                     false, false, i == net.blocks && attends(r));
        }
    }
    x = norm(level_name("dec", size, "aux_norm"), x, groups_of(tape_.dims(x)[1]), kEps, true);
    x = conv(level_name("dec", size, "aux_conv"), x, net.out, 3);
    return conv("network_with_offset.out.", x, net.out, 1);
}

}  // namespace splat::golden
