#include "mesh_views/look.h"

#include <numbers>

#include "scene/srgb.h"

namespace splat::mesh_views {
namespace {

std::array<float, 3> random_color(Random& random) {
    std::array<float, 3> color{};
    for (float& channel : color) channel = static_cast<float>(random.uniform());
    return color;
}

}  // namespace

std::array<float, 3> Look::at(std::uint32_t x, std::uint32_t y, std::uint32_t size) const {
    if (from == to) return from;
    // The corners of the image lie within the gradient, whatever its direction.
    const double reach = size * std::numbers::sqrt2;
    const double place = ((x + 0.5 - size / 2.0) * across + (y + 0.5 - size / 2.0) * down) / reach;
    const auto part = static_cast<float>(place + 0.5);
    std::array<float, 3> color{};
    for (std::size_t k = 0; k < 3; ++k) color[k] = from[k] + (to[k] - from[k]) * part;
    return color;
}

Look look_of(const ViewsDesc& desc, std::uint32_t view) {
    Random random = random_of(desc, Chance::kLook, view);
    Look look;
    look.gain = std::exp2(random.between(-desc.exposure, desc.exposure));
    const double angle = random.between(0, 2 * std::numbers::pi);
    look.across = std::cos(angle);
    look.down = std::sin(angle);
    switch (desc.background) {
        case Background::kWhite:
            look.from.fill(1);
            break;
        case Background::kBlack:
            break;
        case Background::kGray:
            look.from.fill(0.5F);
            break;
        case Background::kPlain:
        case Background::kGradient:
            look.from = random_color(random);
            break;
    }
    look.to = desc.background == Background::kGradient ? random_color(random) : look.from;
    return look;
}

io::Image over_background(std::span<const float> color, std::span<const float> alpha,
                          std::uint32_t size, const Look& look) {
    std::vector<float> mixed(color.begin(), color.end());
    for (std::size_t i = 0; i < alpha.size(); ++i) {
        if (alpha[i] >= 1 && look.gain == 1) continue;
        const auto behind = look.at(static_cast<std::uint32_t>(i % size),
                                    static_cast<std::uint32_t>(i / size), size);
        for (std::size_t k = 0; k < 3; ++k) {
            float& value = mixed[3 * i + k];
            const float own = static_cast<float>(look.gain) * scene::linear_of_srgb(value);
            const float through = (1 - alpha[i]) * scene::linear_of_srgb(behind[k]);
            value = alpha[i] > 0 ? scene::srgb_of_linear(own + through) : behind[k];
        }
    }
    return io::image_from_floats(mixed, size, size, 3);
}

}  // namespace splat::mesh_views
