#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "ref/attention_ref.h"
#include "ref/conv2d_ref.h"
#include "ref/dropout_ref.h"
#include "ref/film_ref.h"
#include "ref/fourier_embedding_ref.h"
#include "ref/gaussian_head_ref.h"
#include "ref/group_norm_ref.h"
#include "ref/linear_ref.h"
#include "ref/losses/edge_loss_ref.h"
#include "ref/losses/feature_distance_ref.h"
#include "ref/losses/ssim_ref.h"
#include "ref/max_pool2d_ref.h"
#include "ref/positional_embedding_ref.h"
#include "ref/resample2d_ref.h"

/// Tensors and attributes as the op table orders and names them, and from them the inputs of the
/// references of this folder.
namespace splat::ref {

using Values = std::vector<double>;

/// Row-major; without dimensions where an optional input is absent.
struct OpTensor {
    std::vector<std::size_t> dims;
    Values values;

    [[nodiscard]] std::size_t dim(std::size_t axis) const { return dims.at(axis); }
    /// Elements per channel of [N, C, ...].
    [[nodiscard]] std::size_t pixels() const { return values.size() / (dim(0) * dim(1)); }
};

/// Tensors in the order of the row's ports.
struct OpArguments {
    std::vector<OpTensor> inputs;
    std::map<std::string, double>
        attributes;  ///< by name, booleans as 0 and 1; every one of the row

    [[nodiscard]] const Values& values(std::size_t i) const { return inputs.at(i).values; }
    [[nodiscard]] double attribute(const char* name) const { return attributes.at(name); }
    /// Value as the library holds it.
    [[nodiscard]] double single(const char* name) const {
        return static_cast<double>(static_cast<float>(attribute(name)));
    }
    [[nodiscard]] std::size_t count(const char* name) const {
        return static_cast<std::size_t>(attribute(name));
    }
    [[nodiscard]] bool flag(const char* name) const { return attribute(name) != 0; }
};

namespace every {

inline AttentionInput<double> attention(const OpArguments& in) {
    return {in.inputs[0].dim(0),   in.inputs[0].dim(1), in.count("heads"), in.inputs[0].pixels(),
            in.inputs[1].pixels(), in.values(0),        in.values(1),      in.values(2)};
}

inline Conv2dInput<double> conv2d(const OpArguments& in) {
    const OpTensor& x = in.inputs[0];
    const OpTensor& weight = in.inputs[1];
    return {{x.dim(0), x.dim(1), x.dim(2), x.dim(3), weight.dim(0), weight.dim(2)},
            in.single("scale"),
            x.values,
            weight.values,
            in.values(2),
            in.values(3)};
}

inline Summed<double> dropout(const OpArguments& in, const Values& values) {
    std::array<std::uint32_t, 4> counter{};
    for (std::size_t i = 0; i < 4; ++i)  // words in the bits of floats
        counter[i] = std::bit_cast<std::uint32_t>(static_cast<float>(in.values(1)[i]));
    const OpTensor& x = in.inputs[0];
    return ref::dropout({x.dim(0), x.dim(1), x.pixels()}, in.attribute("p"),
                        static_cast<std::uint32_t>(in.attribute("stream")), counter, values);
}

inline FilmInput<double> film(const OpArguments& in) {
    const OpTensor& x = in.inputs[0];
    return {x.dim(0), x.dim(1),    x.pixels(), in.inputs[1].dim(1) != x.dim(1),
            x.values, in.values(1)};
}

inline FourierShape fourier(const OpArguments& in) {
    return {in.inputs[0].dim(0), in.inputs[0].dim(1), in.inputs[1].dim(0)};
}

inline HeadLayout head_layout(const OpArguments& in) {
    HeadForm form;
    form.positions = static_cast<std::uint32_t>(in.count("positions"));
    form.offset = in.flag("offset");
    form.least = static_cast<float>(in.attribute("znear"));
    form.most = static_cast<float>(in.attribute("zfar"));
    form.scales = static_cast<std::uint32_t>(in.count("scales"));
    form.isotropic = in.flag("isotropic");
    form.sh_degree = static_cast<std::uint32_t>(in.count("sh_degree"));
    form.direct = in.flag("direct");
    form.activate = in.flag("activate");
    form.per_pixel = static_cast<std::uint32_t>(in.count("per_pixel"));
    return HeadLayout(form);
}

inline GaussianHeadInput gaussian_head(const OpArguments& in) {
    const OpTensor& x = in.inputs[0];
    return {{x.dim(0), x.pixels(), head_layout(in)},
            x.values,
            in.values(1),
            in.values(2),
            in.values(3),
            in.values(4),
            in.values(5)};
}

inline GroupNormInput<double> group_norm(const OpArguments& in) {
    const OpTensor& x = in.inputs[0];
    return {{x.dim(0), x.dim(1), x.pixels(), in.count("groups")},
            in.single("eps"),
            in.flag("silu"),
            x.values,
            in.values(1),
            in.values(2)};
}

inline LinearInput<double> linear(const OpArguments& in) {
    return {{in.inputs[0].dim(0), in.inputs[0].dim(1), in.inputs[1].dim(0)},
            in.values(0),
            in.values(1),
            in.values(2)};
}

inline FeatureShape features(const OpArguments& in) {
    return {in.inputs[0].dim(0), in.inputs[0].dim(1), in.inputs[0].pixels()};
}

inline PoolShape pool(const OpArguments& in) {
    const OpTensor& x = in.inputs[0];
    return {x.dim(0) * x.dim(1), x.dim(2), x.dim(3)};
}

inline EmbeddingShape embedding(const OpArguments& in) {
    return {in.inputs[0].dim(0), in.inputs[0].dim(1), in.count("dimension"),
            in.flag("swap_halves")};
}

inline EdgeLossInput edge_loss(const OpArguments& in) {
    const OpTensor& a = in.inputs[0];
    return {a.dim(0),          a.dim(1), a.dim(2),     a.dim(3),
            in.flag("scharr"), a.values, in.values(1), in.values(2)};
}

/// `from` is the small image if `up`, else the large one. The backward pass of up is down.
inline Summed<double> resample2d(const OpArguments& in, const Values& from, bool up) {
    const OpTensor& x = in.inputs[0];
    const std::size_t divisor = in.flag("up") ? 1 : 2;
    const ResampleShape small{x.dim(0) * x.dim(1), x.dim(2) / divisor, x.dim(3) / divisor};
    const Values filter = in.values(1).empty() ? Values{1, 1} : in.values(1);
    const double gain = in.flag("up") ? 4 : 1;
    return up ? resample2d_up(small, filter, gain, from)
              : resample2d_down(small, filter, gain, from);
}

inline SsimInput ssim(const OpArguments& in) {
    const OpTensor& a = in.inputs[0];
    return {a.dim(0) * a.dim(1), a.dim(2), a.dim(3), a.values, in.values(1)};
}

}  // namespace every

}  // namespace splat::ref
