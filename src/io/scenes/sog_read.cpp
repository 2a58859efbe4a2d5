#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "core/os/path.h"
#include "io/folder.h"
#include "io/photo/photo.h"
#include "io/reader.h"
#include "io/scene_formats.h"
#include "io/scenes/sog_meta.h"
#include "io/zip.h"
#include "scene/arrays.h"

namespace splat::io {
namespace {

using scene::Gaussians;

constexpr std::string_view kZipMark = "PK\x03\x04";
constexpr const char* kSogMeta = "meta.json";

/// meta.json and the images that it names.
struct SogFiles {
    SogMeta meta;
    std::array<Buffer, kSogImages> images;
    std::uint64_t bytes = 0;  ///< size of all files on the disk
    std::size_t others = 0;   ///< files of the archive that meta.json does not name
};

Result<SogFiles> files_of_archive(Bytes file, const LoadOptions& options) {
    const MemorySource source(file);
    SPLAT_ASSIGN(const Zip zip, Zip::open(source, "sog", options.limits));
    DecodeBudget budget(file.size(), options.limits);
    const auto read = [&](const std::string& name) -> Result<Buffer> {
        const ZipEntry* const entry = zip.find(name);
        if (entry == nullptr)
            return damaged("sog: the archive has no '%s'; it is damaged, or of another format",
                           shown(name, 80).c_str());
        SPLAT_TRY(budget.take(entry->bytes, 1, "sog: " + shown(name, 80)));
        Buffer bytes;
        SPLAT_TRY(zip.read(*entry, bytes));
        return bytes;
    };
    SogFiles files;
    SPLAT_ASSIGN(const Buffer text, read(kSogMeta));
    SPLAT_ASSIGN(files.meta, parse_sog_meta(text));
    std::size_t named = 1;
    for (std::size_t i = 0; i < kSogImages; ++i) {
        if (files.meta.files[i].empty()) continue;
        SPLAT_ASSIGN(files.images[i], read(files.meta.files[i]));
        ++named;
    }
    files.bytes = file.size();
    files.others = zip.entries().size() - std::min(named, zip.entries().size());
    return files;
}

Result<SogFiles> files_of_folder(Bytes text, const LoadOptions& options) {
    SogFiles files;
    SPLAT_ASSIGN(files.meta, parse_sog_meta(text));
    if (!options.folder)
        return unsupported(
            "sog: meta.json names images beside it, which memory does not have; read it by its "
            "path");
    files.bytes = text.size();
    for (std::size_t i = 0; i < kSogImages; ++i) {
        if (files.meta.files[i].empty()) continue;
        const auto path = os::path_of(*options.folder) / files.meta.files[i];
        SPLAT_TRY(check_no_links(*options.folder, files.meta.files[i], "sog"));
        auto read = read_file(os::text_of(path));
        if (read.status().code() == Code::kNotFound)
            return damaged("sog: %s: the image is missing", read.status().message().c_str());
        SPLAT_ASSIGN(files.images[i], std::move(read));
        files.bytes += files.images[i].size();
    }
    return files;
}

/// Decodes the images one after the other.
class SogDecoder {
  public:
    SogDecoder(SogFiles files, const LoadOptions& options)
        : files_(std::move(files)),
          meta_(files_.meta),
          options_(options),
          budget_(files_.bytes, options.limits) {}

    Result<LoadedScene> run() {
        for (const Buffer& image : files_.images)
            SPLAT_TRY(budget_.take(image.size(), 1, "sog: images"));
        std::uint32_t degree = 0;
        if (meta_.has_harmonics()) {
            SPLAT_TRY(read_palette());
            degree = meta_.degree;
        }
        SPLAT_TRY(check_count(meta_.count, degree, options_, budget_, "sog"));
        SPLAT_TRY(check_room());
        gaussians_ = scene::make_gaussians(meta_.count, degree);
        gaussians_.drawn_as.antialiased = meta_.antialiased;
        SPLAT_TRY(read_means());
        SPLAT_TRY(read_rotations());
        SPLAT_TRY(read_codes());
        if (degree > 0) SPLAT_TRY(read_labels());
        LoadReport report;
        report.version = meta_.version;
        report.ignored = meta_.ignored;
        if (files_.others > 0)
            report.ignored.push_back(
                format("%zu files that meta.json does not name", files_.others));
        return finish_load(std::move(gaussians_), std::move(report), scene::Frame::kRdf, options_);
    }

  private:
    [[nodiscard]] std::string name_of(SogImage which) const {
        return "sog: '" + shown(meta_.files[which], 80) + "'";
    }

    /// What an image may take beside all else; its bytes are freed after it is decoded.
    Result<Image> decode(SogImage which, bool header_only = false) {
        ImageOptions options;
        options.header_only = true;
        options.limits.besides = UINT64_MAX / 2;  // the budget of all files holds instead
        const auto named = [&](Result<Image> read) -> Result<Image> {
            if (read.ok()) return read;
            return Status(read.status().code(), name_of(which) + ": " + read.status().message());
        };
        SPLAT_ASSIGN(const Image header, named(read_webp(files_.images[which], options)));
        DecodeBudget left = budget_;
        SPLAT_TRY(left.take(std::uint64_t{header.width} * header.height, 2 * header.channels,
                            name_of(which) + ": pixels"));
        if (header_only) return header;
        options.header_only = false;
        SPLAT_ASSIGN(Image image, named(read_webp(files_.images[which], options)));
        files_.images[which] = Buffer();
        return image;
    }

    /// One pixel a Gaussian: all of these images have the size of the first one.
    Status check_room() {
        SPLAT_ASSIGN(const Image first, decode(kSogMeansLow, true));
        if (std::uint64_t{first.width} * first.height < meta_.count)
            return damaged("%s has %u x %u pixels, too few for the %llu Gaussians of meta.json",
                           name_of(kSogMeansLow).c_str(), first.width, first.height,
                           llu(meta_.count));
        for (const SogImage which :
             {kSogMeansHigh, kSogQuats, kSogScales, kSogColors, kSogLabels}) {
            if (meta_.files[which].empty()) continue;
            SPLAT_ASSIGN(const Image image, decode(which, true));
            if (image.width != first.width || image.height != first.height)
                return damaged("%s has %u x %u pixels, expected %u x %u as %s has",
                               name_of(which).c_str(), image.width, image.height, first.width,
                               first.height, name_of(kSogMeansLow).c_str() + 5);
        }
        return {};
    }

    static std::size_t at(const Image& image, std::size_t pixel, std::size_t channel) {
        if (channel == 3 && image.channels == 3) return 255;
        return image.samples[pixel * image.channels + channel];
    }

    Status read_means() {
        for (const SogImage which : {kSogMeansLow, kSogMeansHigh}) {
            SPLAT_ASSIGN(const Image image, decode(which));
            for (std::size_t i = 0; i < gaussians_.means.size(); ++i)
                gaussians_.means[i] += static_cast<float>(at(image, i / 3, i % 3)) *
                                       (which == kSogMeansLow ? 1.0F : 256.0F);
        }
        for (std::size_t i = 0; i < gaussians_.means.size(); ++i) {
            const double low = meta_.mins[i % 3], high = meta_.maxs[i % 3];
            const double span = low == high ? 1 : high - low;
            const double place = low + span * static_cast<double>(gaussians_.means[i]) / 65535;
            const double size = std::min(std::expm1(std::abs(place)),
                                         static_cast<double>(std::numeric_limits<float>::max()));
            gaussians_.means[i] = static_cast<float>(std::copysign(size, place));
        }
        return {};
    }

    /// Three components in the colours; alpha tells which one, the largest, is left out.
    Status read_rotations() {
        SPLAT_ASSIGN(const Image image, decode(kSogQuats));
        for (std::size_t i = 0; i < gaussians_.count(); ++i) {
            const std::size_t alpha = at(image, i, 3);
            if (alpha < 252)
                return damaged("%s: pixel %zu has alpha %zu, expected 252 to 255",
                               name_of(kSogQuats).c_str(), i, alpha);
            const std::size_t largest = alpha - 252;
            double squared = 0;
            float* const wxyz = &gaussians_.rotations[i * 4];
            for (std::size_t k = 0, channel = 0; k < 4; ++k) {
                if (k == largest) continue;
                const double value =
                    (static_cast<double>(at(image, i, channel++)) / 127.5 - 1) * std::sqrt(0.5);
                squared += value * value;
                wxyz[k] = static_cast<float>(value);
            }
            wxyz[largest] = static_cast<float>(std::sqrt(std::max(0.0, 1 - squared)));
        }
        return {};
    }

    Status read_codes() {
        const std::size_t each = std::size_t{scene::sh_coefficients(gaussians_.sh_degree)} * 3;
        {
            SPLAT_ASSIGN(const Image image, decode(kSogScales));
            for (std::size_t i = 0; i < gaussians_.log_scales.size(); ++i)
                gaussians_.log_scales[i] = meta_.scales[i % 3][at(image, i / 3, i % 3)];
        }
        SPLAT_ASSIGN(const Image image, decode(kSogColors));
        for (std::size_t i = 0; i < gaussians_.count(); ++i) {
            for (std::size_t k = 0; k < 3; ++k)
                gaussians_.sh[i * each + k] = meta_.colors[k][at(image, i, k)];
            gaussians_.opacity_logits[i] = meta_.opacity_logits[at(image, i, 3)];
        }
        return {};
    }

    /// Rows of 64 entries, each with a pixel for every coefficient above the constant one.
    Status read_palette() {
        SPLAT_ASSIGN(const Image image, decode(kSogCentroids));
        for (std::uint32_t degree = 1; meta_.version == 1 && degree <= scene::kMaxShDegree;
             ++degree)
            if (image.width == kSogPaletteWidth * (scene::sh_coefficients(degree) - 1))
                meta_.degree = degree;
        const std::size_t pixels = scene::sh_coefficients(meta_.degree) - 1;
        if (pixels == 0 || image.width != kSogPaletteWidth * pixels)
            return damaged(
                "%s is %u pixels wide, expected 192, 512 or 960 for 1 to 3 bands, of which "
                "meta.json has %u",
                name_of(kSogCentroids).c_str(), image.width, meta_.degree);
        const std::uint64_t held = kSogPaletteWidth * image.height;
        if (meta_.version == 1) meta_.palette = held;
        if (meta_.palette > held)
            return damaged("%s holds %llu entries, fewer than the %llu of meta.json",
                           name_of(kSogCentroids).c_str(), llu(held), llu(meta_.palette));
        SPLAT_TRY(budget_.take(meta_.palette, pixels * 3 * sizeof(float), "sog: palette"));
        palette_.resize(meta_.palette * pixels * 3);
        for (std::size_t i = 0; i < palette_.size(); ++i)
            palette_[i] = meta_.harmonics[at(image, i / 3, i % 3)];
        return {};
    }

    Status read_labels() {
        SPLAT_ASSIGN(const Image image, decode(kSogLabels));
        const std::size_t each = std::size_t{scene::sh_coefficients(meta_.degree)} * 3;
        for (std::size_t i = 0; i < gaussians_.count(); ++i) {
            const std::size_t label = at(image, i, 0) + 256 * at(image, i, 1);
            if (label >= meta_.palette)
                return damaged("%s: pixel %zu names entry %zu of the palette, which has %llu",
                               name_of(kSogLabels).c_str(), i, label, llu(meta_.palette));
            std::copy_n(&palette_[label * (each - 3)], each - 3, &gaussians_.sh[i * each + 3]);
        }
        return {};
    }

    SogFiles files_;
    SogMeta& meta_;
    const LoadOptions& options_;
    DecodeBudget budget_;
    std::vector<float> palette_;  ///< [entries,coefficients,3]
    Gaussians gaussians_;
};

}  // namespace

Result<bool> is_sog(Bytes file) {
    const std::string_view text = as_text(file);
    if (text.starts_with(kZipMark)) return true;
    const std::size_t start = text.find_first_not_of(" \t\r\n");
    return start != std::string_view::npos && text[start] == '{' &&
           text.find("\"means\"") != std::string_view::npos &&
           text.find("\"sh0\"") != std::string_view::npos;
}

Result<LoadedScene> read_sog(Bytes file, const LoadOptions& options) {
    const bool archive = as_text(file).starts_with(kZipMark);
    SPLAT_ASSIGN(SogFiles files,
                 archive ? files_of_archive(file, options) : files_of_folder(file, options));
    return SogDecoder(std::move(files), options).run();
}

}  // namespace splat::io
