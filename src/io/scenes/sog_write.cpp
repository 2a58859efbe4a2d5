#include <algorithm>
#include <bit>
#include <cmath>

#include "io/photo/photo.h"
#include "io/scene_file.h"
#include "io/scene_formats.h"
#include "io/scenes/sog_leaf.h"
#include "io/scenes/sog_meta.h"
#include "io/scenes/sog_palette.h"
#include "io/zip.h"
#include "scene/arrays.h"
#include "scene/select.h"

namespace splat::io {
namespace {

using scene::Gaussians;

constexpr std::size_t kMaxPalette = 65536;
constexpr std::size_t kFinestPalette = 1024;  ///< up to so many Gaussians each has its own entry
constexpr float kMaxSogColor = 1e6F;          ///< sums of squares of more could leave float32
constexpr std::uint32_t kMaxSogSide = 16380;
/// A leaf of the palette's tree has at least one entry, and the palette at most kMaxPalette.
constexpr std::size_t kMostWithHarmonics = kMaxPalette * kMaxLeafRows;

struct SogPixels {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<std::uint8_t> rgba;

    SogPixels() = default;
    SogPixels(std::uint32_t columns, std::uint32_t rows)
        : width(columns), height(rows), rgba(std::size_t{4} * columns * rows) {}

    void make_opaque() {
        for (std::size_t i = 3; i < rgba.size(); i += 4) rgba[i] = 255;
    }
};

Status check_held(const Gaussians& g) {
    if (g.count() > std::size_t{kMaxSogSide} * kMaxSogSide)
        return unsupported("sog: %zu Gaussians, an image has room for %u x %u", g.count(),
                           kMaxSogSide, kMaxSogSide);
    if (g.sh_degree > 0 && g.count() > kMostWithHarmonics)
        return unsupported(
            "sog: %zu Gaussians, with harmonics at most %zu: write SH degree 0, or .spz", g.count(),
            kMostWithHarmonics);
    const std::size_t each = std::size_t{scene::sh_coefficients(g.sh_degree)} * 3;
    SPLAT_TRY(check_numbers(g, "sog"));
    for (std::size_t i = 0; i < g.count(); ++i)
        for (std::size_t k = i * each; k < (i + 1) * each; ++k)
            if (std::abs(g.sh[k]) > kMaxSogColor)
                return invalid(
                    "sog: Gaussian %zu has a colour coefficient of %g, expected up to 1e6; "
                    "remove it, or write .ply",
                    i, static_cast<double>(g.sh[k]));
    return {};
}

/// Fills the images of a scene, and what meta.json says of them.
class SogEncoder {
  public:
    SogEncoder(const Gaussians& gaussians, std::size_t threads) : g_(gaussians), threads_(threads) {
        // Sides are multiples of 4, as other writers have them.
        const auto side = std::sqrt(static_cast<double>(g_.count()));
        width_ = std::max(4U, static_cast<std::uint32_t>(std::ceil(side / 4)) * 4);
        height_ = std::max<std::uint32_t>(
            4, static_cast<std::uint32_t>((g_.count() + width_ * 4 - 1) / (width_ * 4)) * 4);
        meta_.count = g_.count();
        meta_.antialiased = g_.drawn_as.antialiased;
        for (std::size_t i = 0; i < (g_.sh_degree > 0 ? kSogImages : kSogCentroids); ++i) {
            meta_.files[i] = kSogNames[i];
            if (i != kSogCentroids) pixels_[i] = SogPixels(width_, height_);
        }
    }

    Result<Buffer> run() {
        put_means();
        put_rotations();
        put_codes();
        if (g_.sh_degree > 0) put_harmonics();
        std::array<Buffer, kSogImages> files;
        SPLAT_TRY(parallel_for(kSogImages, threads_, [&](std::size_t i) -> Status {
            if (meta_.files[i].empty()) return {};
            SPLAT_SET(files[i], write_webp(pixels_[i].rgba, pixels_[i].width, pixels_[i].height));
            return {};
        }));
        std::vector<ZipMember> members(1);
        members[0].name = "meta.json";
        put_text(members[0].head, write_sog_meta(meta_));
        for (std::size_t i = 0; i < kSogImages; ++i)
            if (!meta_.files[i].empty())
                members.push_back({meta_.files[i], std::move(files[i]), {}});
        SPLAT_ASSIGN(const FilePieces archive, write_zip(std::move(members)));
        return archive.joined();
    }

  private:
    /// The pixel of Gaussian i; pixels beyond the last one stay 0.
    std::uint8_t* pixel(SogImage which, std::size_t i) {
        return pixels_[which].rgba.data() + 4 * i;
    }

    static double compressed(float mean) {
        const auto value = static_cast<double>(mean);
        return std::copysign(std::log1p(std::abs(value)), value);
    }

    void put_means() {
        for (std::size_t k = 0; k < 3; ++k) {
            for (std::size_t i = 0; i < g_.count(); ++i) {
                const double value = compressed(g_.means[i * 3 + k]);
                meta_.mins[k] = i == 0 ? value : std::min(meta_.mins[k], value);
                meta_.maxs[k] = i == 0 ? value : std::max(meta_.maxs[k], value);
            }
            const double span = meta_.maxs[k] - meta_.mins[k];
            const double scale = span > 0 ? 65535 / span : 0;
            for (std::size_t i = 0; i < g_.count(); ++i) {
                const auto place = static_cast<std::uint32_t>(
                    std::lround((compressed(g_.means[i * 3 + k]) - meta_.mins[k]) * scale));
                pixel(kSogMeansLow, i)[k] = static_cast<std::uint8_t>(place & 255U);
                pixel(kSogMeansHigh, i)[k] = static_cast<std::uint8_t>(place >> 8U);
            }
        }
        pixels_[kSogMeansLow].make_opaque();
        pixels_[kSogMeansHigh].make_opaque();
    }

    void put_rotations() {
        for (std::size_t i = 0; i < g_.count(); ++i) {
            const float* const wxyz = &g_.rotations[i * 4];
            std::size_t largest = 0;
            for (std::size_t k = 1; k < 4; ++k)
                if (std::abs(wxyz[k]) > std::abs(wxyz[largest])) largest = k;
            const double sign = wxyz[largest] < 0 ? -1 : 1;
            std::uint8_t* to = pixel(kSogQuats, i);
            to[3] = static_cast<std::uint8_t>(252 + largest);
            for (std::size_t k = 0; k < 4; ++k)
                if (k != largest)
                    *to++ =
                        to_byte(127.5 * (1 + sign * std::sqrt(2.0) * static_cast<double>(wxyz[k])));
        }
    }

    void put_codes() {
        const std::size_t each = std::size_t{scene::sh_coefficients(g_.sh_degree)} * 3;
        std::vector<float> colors(g_.count() * 3);
        for (std::size_t i = 0; i < colors.size(); ++i) colors[i] = g_.sh[i / 3 * each + i % 3];
        meta_.scales[0] = make_codebook(g_.log_scales);
        meta_.colors[0] = make_codebook(colors);
        for (std::size_t i = 0; i < colors.size(); ++i) {
            pixel(kSogScales, i / 3)[i % 3] = nearest_code(meta_.scales[0], g_.log_scales[i]);
            pixel(kSogColors, i / 3)[i % 3] = nearest_code(meta_.colors[0], colors[i]);
        }
        for (std::size_t i = 0; i < g_.count(); ++i)
            pixel(kSogColors, i)[3] = opacity_byte(g_.opacity_logits[i]);
        pixels_[kSogScales].make_opaque();
    }

    [[nodiscard]] std::size_t palette_entries() const {
        if (g_.count() <= kFinestPalette) return kFinestPalette;
        return std::min(kMaxPalette, std::bit_floor(g_.count() / kFinestPalette) * kFinestPalette);
    }

    void put_harmonics() {
        const std::size_t each = std::size_t{scene::sh_coefficients(g_.sh_degree)} * 3;
        const std::size_t dims = each - 3;
        const float* const bands = g_.count() == 0 ? nullptr : g_.sh.data() + 3;
        VectorPalette palette =
            make_palette({bands, g_.count(), each, dims}, palette_entries(), threads_);
        if (palette.entries.empty()) palette.entries.resize(dims);  // no Gaussians
        meta_.degree = g_.sh_degree;
        meta_.palette = palette.entries.size() / dims;
        meta_.harmonics = make_codebook(palette.entries);
        SogPixels centroids(
            static_cast<std::uint32_t>(kSogPaletteWidth * dims / 3),
            static_cast<std::uint32_t>((meta_.palette + kSogPaletteWidth - 1) / kSogPaletteWidth));
        for (std::size_t i = 0; i < palette.entries.size(); ++i)
            centroids.rgba[i / 3 * 4 + i % 3] = nearest_code(meta_.harmonics, palette.entries[i]);
        centroids.make_opaque();
        pixels_[kSogCentroids] = std::move(centroids);
        for (std::size_t i = 0; i < g_.count(); ++i) {
            pixel(kSogLabels, i)[0] = static_cast<std::uint8_t>(palette.labels[i] & 255U);
            pixel(kSogLabels, i)[1] = static_cast<std::uint8_t>(palette.labels[i] >> 8U);
        }
        pixels_[kSogLabels].make_opaque();
    }

    const Gaussians& g_;
    std::size_t threads_;
    std::uint32_t width_ = 0;
    std::uint32_t height_ = 0;
    SogMeta meta_;
    std::array<SogPixels, kSogImages> pixels_;
};

}  // namespace

Status put_sog(const Gaussians& gaussians, const SaveOptions& options, ByteSink& to) {
    SPLAT_ASSIGN(Gaussians scene, prepare_save(gaussians, scene::Frame::kRdf, options));
    SPLAT_TRY(check_held(scene));
    warn_of_loss("sog", scene::normalise_rotations(scene), scene.count(),
                 "rotations have length 0");
    SPLAT_SET(scene, scene::sort_morton(scene));
    SPLAT_ASSIGN(const Buffer file, SogEncoder(scene, options.threads).run());
    return to.put(file);
}

extern const SceneFormat kSogFormat = {.id = 6,
                                       .name = "sog",
                                       .extension = ".sog",
                                       .holds = "quantised, in another order",
                                       .mark = "'PK' of an archive, or a meta.json",
                                       .detect = is_sog,
                                       .read = read_sog,
                                       .write = put_sog,
                                       .says = {.antialiased = true}};

}  // namespace splat::io
