#include "io/scene_file.h"
#include "io/scene_formats.h"

#include <algorithm>
#include <cmath>

#include "io/bytes.h"
#include "io/number_type.h"
#include "io/reader.h"
#include "scene/arrays.h"
#include "scene/sh.h"

namespace splat::io {
namespace {

using scene::Gaussians;

constexpr std::size_t kKsplatHeaderBytes = 4096;
constexpr std::size_t kSectionHeaderBytes = 1024;
constexpr std::size_t kBucketBytes = 12;  ///< the centre as 3 x float32
constexpr double kUsualBand = 1.5;        ///< ends of level 2, where the header has 0
constexpr std::uint32_t kUsualRange = 32767;
constexpr std::uint32_t kKsplatMaxDegree = 2;

/// What a level of compression stores a Gaussian in, in this order; colour and opacity are 4 bytes.
struct KsplatLevel {
    std::size_t mean_bytes, scale_bytes, rotation_bytes, band_bytes;
};
constexpr KsplatLevel kKsplatLevels[] = {{12, 12, 16, 4}, {6, 6, 8, 2}, {6, 6, 8, 1}};
constexpr std::size_t kColorBytes = 4;

struct KsplatHeader {
    std::uint32_t sections = 0;
    std::uint32_t count = 0;
    std::uint16_t level = 0;
    double least_band = 0, most_band = 0;  ///< what bytes 0 and 255 of level 2 stand for
};

struct Section {
    std::uint32_t count = 0;        ///< Gaussians
    std::uint32_t room = 0;         ///< rows of data, of which the first `count` hold Gaussians
    std::uint32_t bucket_size = 0;  ///< Gaussians of a full bucket
    std::uint32_t buckets = 0;
    double block_size = 0;  ///< edge of a bucket's cube
    std::uint32_t bucket_bytes = 0;
    std::uint32_t range = 0;  ///< steps of half of block_size
    std::uint32_t full_buckets = 0;
    std::uint32_t partial_buckets = 0;  ///< they follow the full ones
    std::uint32_t degree = 0;
    Bytes partial_counts;
    Bytes centers;
    Bytes rows;
};

std::uint32_t u32_at(Bytes bytes, std::size_t place) {
    return number<std::uint32_t>(bytes.data() + place);
}

std::size_t rest_of(std::uint32_t degree) {
    return 3 * (std::size_t{scene::sh_coefficients(degree)} - 1);
}

std::size_t row_bytes(const KsplatLevel& level, std::uint32_t degree) {
    return level.mean_bytes + level.scale_bytes + level.rotation_bytes + kColorBytes +
           level.band_bytes * rest_of(degree);
}

Result<KsplatHeader> read_ksplat_header(Reader& reader) {
    SPLAT_ASSIGN(const Bytes bytes, reader.take(kKsplatHeaderBytes, "header"));
    const int major = std::to_integer<int>(bytes[0]), minor = std::to_integer<int>(bytes[1]);
    if (major != 0 || minor < 1)
        return unsupported("ksplat: version %d.%d, expected 0.1", major, minor);
    KsplatHeader header;
    header.sections = u32_at(bytes, 4);
    header.count = u32_at(bytes, 16);
    header.level = number<std::uint16_t>(bytes.data() + 20);
    header.least_band = static_cast<double>(number<float>(bytes.data() + 36));
    header.most_band = static_cast<double>(number<float>(bytes.data() + 40));
    if (header.level >= std::size(kKsplatLevels))
        return damaged("ksplat: compression level %u, expected 0 to 2", header.level);
    if (header.least_band == 0) header.least_band = -kUsualBand;
    if (header.most_band == 0) header.most_band = kUsualBand;
    if (header.level == 2 && !(std::isfinite(header.least_band) && std::isfinite(header.most_band)))
        return damaged("ksplat: harmonics from %g to %g at byte 36, expected numbers",
                       header.least_band, header.most_band);
    return header;
}

/// A header of a section. Errors: kFormat for counts that contradict each other.
Result<Section> read_section_header(Reader& reader, const KsplatHeader& header, std::size_t index) {
    SPLAT_ASSIGN(const Bytes bytes, reader.take(kSectionHeaderBytes, "section header"));
    Section s;
    s.count = u32_at(bytes, 0);
    s.room = u32_at(bytes, 4);
    s.bucket_size = u32_at(bytes, 8);
    s.buckets = u32_at(bytes, 12);
    s.block_size = static_cast<double>(number<float>(bytes.data() + 16));
    s.bucket_bytes = number<std::uint16_t>(bytes.data() + 20);
    s.range = u32_at(bytes, 24);
    s.full_buckets = u32_at(bytes, 32);
    s.partial_buckets = u32_at(bytes, 36);
    s.degree = number<std::uint16_t>(bytes.data() + 40);
    if (s.range == 0) s.range = kUsualRange;
    const auto bad = [index](const std::string& problem) {
        return damaged("ksplat: section %zu: %s", index, problem.c_str());
    };
    if (s.degree > kKsplatMaxDegree)
        return bad(format("SH degree %u, expected 0 to %u", s.degree, kKsplatMaxDegree));
    if (s.count > s.room) return bad(format("%u Gaussians in a section for %u", s.count, s.room));
    if (header.level == 0) return s;
    if (s.buckets > 0 && s.bucket_bytes != kBucketBytes)
        return bad(format("buckets of %u bytes, expected %zu", s.bucket_bytes, kBucketBytes));
    if (std::uint64_t{s.full_buckets} + s.partial_buckets > s.buckets)
        return bad(format("%u full and %u other buckets, but %u in all", s.full_buckets,
                          s.partial_buckets, s.buckets));
    if (s.count > 0 && !(s.block_size > 0 && std::isfinite(s.block_size)))
        return bad(format("blocks of size %g, expected more than 0", s.block_size));
    return s;
}

/// The parts of a section: counts of partial buckets, centres of all, rows of Gaussians.
Status find_data(Reader& reader, const KsplatHeader& header, std::size_t index, Section& s) {
    SPLAT_SET(s.partial_counts,
              reader.take(std::uint64_t{s.partial_buckets} * sizeof(std::uint32_t),
                          "counts of partial buckets"));
    SPLAT_SET(s.centers,
              reader.take(std::uint64_t{s.buckets} * s.bucket_bytes, "centres of buckets"));
    SPLAT_SET(s.rows,
              reader.take(std::uint64_t{s.room} * row_bytes(kKsplatLevels[header.level], s.degree),
                          "Gaussians"));
    if (header.level == 0) return {};
    std::uint64_t held = std::uint64_t{s.full_buckets} * s.bucket_size;
    for (std::size_t i = 0; i < s.partial_buckets; ++i) held += u32_at(s.partial_counts, 4 * i);
    if (held < s.count)
        return damaged("ksplat: section %zu: buckets for %llu Gaussians, expected %u", index,
                       llu(held), s.count);
    return {};
}

/// The buckets of a section, in the order of its Gaussians.
class Buckets {
  public:
    explicit Buckets(const Section& section) : section_(section), left_(size()) {}

    /// Centre of the bucket of the next Gaussian. find_data() has checked that there is one.
    const std::byte* next() {
        while (left_ == 0) {
            ++index_;
            left_ = size();
        }
        --left_;
        return section_.centers.data() + index_ * kBucketBytes;
    }

  private:
    [[nodiscard]] std::uint64_t size() const {
        if (index_ < section_.full_buckets) return section_.bucket_size;
        const std::size_t partial = index_ - section_.full_buckets;
        return partial < section_.partial_buckets ? u32_at(section_.partial_counts, 4 * partial)
                                                  : 0;
    }

    const Section& section_;
    std::size_t index_ = 0;
    std::uint64_t left_;
};

/// Number `i` of float32 or, compressed, of float16.
double real_at(const std::byte* at, std::size_t i, bool half) {
    return static_cast<double>(half ? from_half(number<std::uint16_t>(at + 2 * i))
                                    : number<float>(at + 4 * i));
}

double band_at(const std::byte* at, std::size_t i, const KsplatHeader& header) {
    if (header.level < 2) return real_at(at, i, header.level == 1);
    return header.least_band +
           std::to_integer<int>(at[i]) / 255.0 * (header.most_band - header.least_band);
}

/// Bands follow each other, each one channel-major.
void decode_bands(const std::byte* at, const KsplatHeader& header, const Section& s, float* sh) {
    for (std::size_t band = 1, first = 0; band <= s.degree; ++band) {
        const std::size_t width = 2 * band + 1;
        for (std::size_t channel = 0; channel < 3; ++channel)
            for (std::size_t k = 0; k < width; ++k)
                sh[(band * band + k) * 3 + channel] =
                    static_cast<float>(band_at(at, first + channel * width + k, header));
        first += 3 * width;
    }
}

/// Row `row` of a section as Gaussian i; `center` is that of its bucket.
void decode_row(const KsplatHeader& header, const Section& s, std::size_t row,
                const std::byte* center, Gaussians& g, std::size_t i) {
    const KsplatLevel& level = kKsplatLevels[header.level];
    const bool half = header.level > 0;
    const std::byte* const mean = s.rows.data() + row * row_bytes(level, s.degree);
    const std::byte* const scale = mean + level.mean_bytes;
    const std::byte* const rotation = scale + level.scale_bytes;
    const std::byte* const color = rotation + level.rotation_bytes;
    float* const sh = &g.sh[i * 3 * scene::sh_coefficients(g.sh_degree)];
    for (std::size_t k = 0; k < 3; ++k) {
        double place = 0;
        if (half) {
            const double steps = number<std::uint16_t>(mean + 2 * k) - static_cast<double>(s.range);
            place = steps * (s.block_size / 2 / s.range) + real_at(center, k, false);
        } else {
            place = real_at(mean, k, false);
        }
        g.means[i * 3 + k] = static_cast<float>(place);
        g.log_scales[i * 3 + k] = static_cast<float>(std::log(real_at(scale, k, half)));
        sh[k] = static_cast<float>((std::to_integer<int>(color[k]) / 255.0 - 0.5) / scene::kSh0);
    }
    for (std::size_t k = 0; k < 4; ++k)
        g.rotations[i * 4 + k] = static_cast<float>(real_at(rotation, k, half));
    g.opacity_logits[i] = opacity_logit(std::to_integer<std::uint8_t>(color[3]));
    decode_bands(color + kColorBytes, header, s, sh);
}

Result<std::vector<Section>> read_sections(Reader& reader, const KsplatHeader& header) {
    SPLAT_TRY(reader.need(header.sections, kSectionHeaderBytes, "section headers"));
    std::vector<Section> sections;
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < header.sections; ++i) {
        SPLAT_ASSIGN(const Section section, read_section_header(reader, header, i));
        count += section.count;
        sections.push_back(section);
    }
    if (count != header.count)
        return damaged("ksplat: %u Gaussians, but its %u sections hold %llu", header.count,
                       header.sections, llu(count));
    for (std::size_t i = 0; i < sections.size(); ++i)
        SPLAT_TRY(find_data(reader, header, i, sections[i]));
    return sections;
}

}  // namespace

Result<LoadedScene> read_ksplat(Bytes file, const LoadOptions& options) {
    Reader reader(file, "ksplat");
    SPLAT_ASSIGN(const KsplatHeader header, read_ksplat_header(reader));
    SPLAT_ASSIGN(const std::vector<Section> sections, read_sections(reader, header));
    LoadReport report;
    report.version = 1;
    if (reader.left() > 0) {
        report.left_out = format("%zu bytes after the last section", reader.left());
        if (!options.lenient)
            return damaged(
                "ksplat: %s, expected none: the headers count too few sections, or something was "
                "appended to the file; a lenient reader leaves them out",
                report.left_out.c_str());
    }
    std::uint32_t degree = 0;
    for (const Section& section : sections)
        if (section.count > 0) degree = std::max(degree, section.degree);
    DecodeBudget budget(file.size(), options.limits);
    SPLAT_TRY(check_count(header.count, degree, options, budget, "ksplat"));
    Gaussians gaussians = scene::make_gaussians(header.count, degree);
    std::size_t i = 0;
    for (const Section& section : sections) {
        Buckets buckets(section);
        for (std::size_t row = 0; row < section.count; ++row)
            decode_row(header, section, row, header.level > 0 ? buckets.next() : nullptr, gaussians,
                       i++);
    }
    return finish_load(std::move(gaussians), std::move(report), scene::Frame::kRdf, options);
}

extern const SceneFormat kKsplatFormat = {.id = 5,
                                          .name = "ksplat",
                                          .extension = ".ksplat",
                                          .holds = "three levels of compression, to SH degree 2",
                                          .read = read_ksplat,
                                          .max_sh_degree = kKsplatMaxDegree};

}  // namespace splat::io
