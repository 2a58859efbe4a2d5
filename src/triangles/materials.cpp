#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "core/checked_math.h"
#include "params/triangles/triangle_params.h"
#include "scene/srgb.h"
#include "triangles/mesh_on_device.h"

namespace splat::triangles {
namespace {

using Texel = std::array<std::uint8_t, 4>;
static_assert(scene::kNone == params::kNoTriangle);
static_assert(static_cast<int>(scene::Wrap::kMirror) == 2 &&
              static_cast<int>(scene::AlphaMode::kBlend) == 2);

std::array<float, params::kByteValues> linear_values() {
    std::array<float, params::kByteValues> values{};
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = scene::linear_of_srgb(static_cast<float>(i) / 255);
    return values;
}

/// What texel `at` of `count` covers of `given` texels of the level before: from `first` on, with these weights.
struct Cover {
    std::uint32_t first;
    std::array<double, 3> weights;
};

Cover cover_of(std::uint32_t at, std::uint32_t count, std::uint32_t given) {
    const double begin = static_cast<double>(at) * given / count;
    const double end = static_cast<double>(at + 1) * given / count;
    Cover cover{static_cast<std::uint32_t>(begin), {}};
    for (std::uint32_t k = 0; k < 3; ++k) {
        const double low = std::max(begin, double{1} * cover.first + k);
        const double high = std::min(end, double{1} * cover.first + k + 1);
        cover.weights[k] = std::max(high - low, 0.0) / (end - begin);
    }
    return cover;
}

std::uint8_t byte_of(double value) {
    return static_cast<std::uint8_t>(std::clamp(std::lround(255 * value), 0L, 255L));
}

/// One level of a texture.
struct Level {
    std::uint32_t width, height;
    std::vector<Texel> texels;
};

std::uint32_t half_of(std::uint32_t side) {
    return std::max(side / 2, 1U);
}

Level next_level(std::span<const Texel> from, std::uint32_t width, std::uint32_t height) {
    static const std::array<float, params::kByteValues> linear = linear_values();
    Level level{half_of(width), half_of(height), {}};
    level.texels.reserve(std::size_t{level.width} * level.height);
    for (std::uint32_t y = 0; y < level.height; ++y) {
        const Cover rows = cover_of(y, level.height, height);
        for (std::uint32_t x = 0; x < level.width; ++x) {
            const Cover columns = cover_of(x, level.width, width);
            std::array<double, 4> sum{};
            for (std::uint32_t j = 0; j < 3; ++j)
                for (std::uint32_t i = 0; i < 3; ++i) {
                    const double weight = rows.weights[j] * columns.weights[i];
                    if (weight == 0) continue;
                    const Texel& texel =
                        from[(std::size_t{rows.first} + j) * width + columns.first + i];
                    for (std::size_t k = 0; k < 3; ++k)
                        sum[k] += weight * static_cast<double>(linear[texel[k]]);
                    sum[3] += weight * texel[3] / 255;
                }
            Texel made{};
            for (std::size_t k = 0; k < 3; ++k)
                made[k] =
                    byte_of(static_cast<double>(scene::srgb_of_linear(static_cast<float>(sum[k]))));
            made[3] = byte_of(sum[3]);
            level.texels.push_back(made);
        }
    }
    return level;
}

/// A texture from level `skip` on.
struct Kept {
    std::uint32_t skip = 0, width = 0, height = 0;

    [[nodiscard]] std::uint64_t top() const { return std::uint64_t{width} * height; }
    [[nodiscard]] std::uint32_t levels() const {
        return static_cast<std::uint32_t>(std::bit_width(std::max(width, height)));
    }
    [[nodiscard]] std::uint64_t texels() const {
        std::uint64_t sum = 0;
        for (std::uint32_t i = 0, w = width, h = height; i < levels();
             ++i, w = half_of(w), h = half_of(h))
            sum += std::uint64_t{w} * h;
        return sum;
    }
};

/// Levels that fit, without the greatest ones of the largest textures.
Result<std::vector<Kept>> kept_levels(const scene::TriangleMesh& mesh, std::uint64_t most) {
    std::vector<Kept> kept;
    std::uint64_t sum = 0;
    for (const scene::Texture& texture : mesh.textures) {
        kept.push_back({0, texture.width, texture.height});
        sum += kept.back().texels();
    }
    while (sum > most) {
        const auto largest = std::ranges::max_element(kept, {}, &Kept::top);
        if (largest == kept.end() || largest->top() == 1)
            return unsupported("%zu materials and %zu textures do not fit the device's binding",
                               mesh.materials.size(), mesh.textures.size());
        sum -= largest->top();
        largest->width = half_of(largest->width);
        largest->height = half_of(largest->height);
        ++largest->skip;
    }
    return kept;
}

void append_material(std::vector<std::uint32_t>& words, const scene::MeshMaterial& material) {
    const std::size_t first = words.size();
    words.resize(first + params::kMaterialWords);
    const auto set = [&](std::size_t at, float value) {
        words[first + at] = std::bit_cast<std::uint32_t>(value);
    };
    for (std::size_t k = 0; k < 4; ++k)
        set(k, std::isfinite(material.color[k]) ? material.color[k] : 0.0F);
    words[first + params::kMaterialTexture] = material.texture;
    words[first + params::kMaterialBits] =
        static_cast<std::uint32_t>(material.wrap_u) |
        static_cast<std::uint32_t>(material.wrap_v) << params::kWrapVBit |
        (material.nearest ? 1U << params::kNearestBit : 0U) |
        static_cast<std::uint32_t>(material.alpha) << params::kAlphaBit |
        (material.double_sided ? 1U << params::kDoubleSidedBit : 0U);
    set(params::kMaterialCutoff, material.alpha_cutoff);
    for (std::size_t k = 0; k < 6; ++k)
        set(params::kMaterialPlace + k, texture_number(material.at[k]));
}

void append_texels(std::vector<std::uint32_t>& words, std::span<const Texel> texels) {
    for (const Texel& texel : texels) words.push_back(std::bit_cast<std::uint32_t>(texel));
}

}  // namespace

Result<PackedMaterials> pack_materials(const scene::TriangleMesh& mesh, std::uint64_t most_words) {
    PackedMaterials packed;
    std::vector<std::uint32_t>& words = packed.words;
    for (const float value : linear_values()) words.push_back(std::bit_cast<std::uint32_t>(value));
    for (const scene::MeshMaterial& material : mesh.materials) append_material(words, material);
    if (mesh.materials.empty()) append_material(words, {});
    const std::uint64_t before = words.size() + params::kTextureWords * mesh.textures.size();
    SPLAT_ASSIGN(const std::vector<Kept> kept,
                 kept_levels(mesh, most_words - std::min(before, most_words)));
    packed.textures_at = static_cast<std::uint32_t>(words.size());
    words.resize(before);
    std::uint64_t all = before;
    for (const Kept& texture : kept) all += texture.texels();
    words.reserve(all);
    for (std::size_t i = 0; i < kept.size(); ++i) {
        const scene::Texture& texture = mesh.textures[i];
        if (kept[i].skip > 0) ++packed.halved;
        const std::array<std::uint32_t, params::kTextureWords> record = {
            static_cast<std::uint32_t>(words.size()), kept[i].width, kept[i].height,
            kept[i].levels()};
        std::ranges::copy(record, words.begin() + packed.textures_at +
                                      static_cast<std::ptrdiff_t>(record.size() * i));
        if (kept[i].skip == 0) append_texels(words, texture.texels);
        Level level{texture.width, texture.height, {}};
        for (std::uint32_t k = 1; level.width > 1 || level.height > 1; ++k) {
            level = next_level(k == 1 ? std::span<const Texel>(texture.texels) : level.texels,
                               level.width, level.height);
            if (k >= kept[i].skip) append_texels(words, level.texels);
        }
    }
    return packed;
}

}  // namespace splat::triangles
