#include "data/panoptic/mask_tokens.h"

#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/hash.h"
#include "core/os/path.h"
#include "core/path_name.h"
#include "core/rng.h"
#include "data/dataset.h"
#include "data/folder.h"
#include "io/photo/image_file.h"
#include "io/weights_file.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostNumbers = std::uint64_t{1} << 29U;

Status check(const MaskTokensDesc& desc) {
    if (desc.dimension < kTokenExtras + 4 || desc.dimension > kMostTokenDimension ||
        desc.dimension % 2 != 0)
        return invalid("dimension is %u, expected an even number from %u to %u", desc.dimension,
                       kTokenExtras + 4, kMostTokenDimension);
    if (desc.pooled && desc.dimension % 12 != 0)
        return invalid(
            "dimension is %u, expected a multiple of 12 for vectors of views: they have 6 "
            "cam_embd.dimension numbers",
            desc.dimension);
    if (desc.tokens < 1 || desc.tokens > 65536)
        return invalid("tokens is %u, expected 1 to 65536", desc.tokens);
    return {};
}

/// The splits of a data set, opened; of one without splits what it has.
Result<std::vector<std::unique_ptr<Dataset>>> splits_of(const MaskTokensDesc& desc) {
    std::vector<std::unique_ptr<Dataset>> found;
    DatasetDesc wanted;
    wanted.path = desc.data;
    wanted.format = desc.format;
    wanted.category = desc.category;
    bool lacks = false;
    for (const char* split : {"train", "val", "test"}) {
        lacks = false;
        wanted.split = split;
        wanted.lacks_split = &lacks;
        auto opened = Dataset::open(wanted);
        if (opened.ok())
            found.push_back(std::move(opened.value()));
        else if (!lacks)
            return opened.status();
    }
    if (!found.empty()) return found;
    wanted.split = "train";
    wanted.lacks_split = nullptr;
    SPLAT_ASSIGN(std::unique_ptr<Dataset> whole, Dataset::open(wanted));
    found.push_back(std::move(whole));
    return found;
}

/// Writes one data set after the other.
class Writer {
  public:
    Writer(const MaskTokensDesc& desc, MaskNames names) : desc_(desc), names_(std::move(names)) {}

    Status add(const Dataset& dataset) {
        const DatasetIndex& index = dataset.index();
        for (std::uint32_t object = 0; object < index.names.size(); ++object) {
            const std::string start = index.has_splits ? index.split + "/" : std::string();
            SPLAT_TRY(add(dataset.reader(), object, start + index.names[object],
                          start + PathName(index.names[object]).text()));
        }
        return {};
    }

    Result<MaskTokens> finish() {
        counts_.classes = static_cast<std::uint32_t>(classes_.size());
        SPLAT_TRY(io::save_weights(file_, desc_.out));
        return counts_;
    }

  private:
    Status add(const DatasetReader& reader, std::uint32_t object, const std::string& name,
               const std::string& place) {
        const std::uint32_t views = reader.index().views_of[object];
        const fs::path folder = os::path_of(desc_.masks) / os::path_of(place);
        SPLAT_ASSIGN(const std::vector<std::string> stems, stems_in(folder, ".png"));
        if (stems.empty())
            return not_found(
                "'%s' has no masks (.png), expected one for each of the %u views of "
                "object '%s'",
                os::text_of(folder).c_str(), views, name.c_str());
        if (stems.size() != views)
            return damaged("'%s' has %zu masks, expected one for each of the %u views",
                           os::text_of(folder).c_str(), stems.size(), views);
        std::vector<float> values;
        for (std::uint32_t view = 0; view < views; ++view) {
            const std::string file = place + "/" + stems[view] + ".png";
            SPLAT_TRY(io::in_file(add_view(reader, object, view, file, values),
                                  os::text_of(os::path_of(desc_.masks) / os::path_of(file))));
        }
        ++counts_.objects;
        counts_.views += views;
        std::vector<std::int64_t> dims(desc_.pooled ? 2 : 3, desc_.tokens);
        dims[0] = views;
        dims[1] = desc_.dimension;
        return file_.tensors.add({.name = name, .dims = std::move(dims), .values = values});
    }

    Status add_view(const DatasetReader& reader, std::uint32_t object, std::uint32_t view,
                    const std::string& file, std::vector<float>& values) {
        SPLAT_ASSIGN(const io::Image mask,
                     io::load_image(os::text_of(os::path_of(desc_.masks) / os::path_of(file))));
        SPLAT_ASSIGN(const std::uint32_t side, reader.width(object, view, MapKind::kRgb));
        if (mask.width != side || mask.height != side)
            return damaged("%u x %u pixels, expected %u x %u as the picture of view %u", mask.width,
                           mask.height, side, side, view);
        SPLAT_ASSIGN(const std::vector<Segment> segments, names_.segments(mask, file));
        for (const Segment& segment : segments) classes_.insert(segment.name);
        counts_.segments += segments.size();
        if (!desc_.pooled && segments.size() > desc_.tokens)
            counts_.dropped += segments.size() - desc_.tokens;
        const std::vector<float> made = tokens_of(segments, mask.width, mask.height, desc_);
        numbers_ += made.size();
        if (numbers_ > kMostNumbers)
            return unsupported(
                "with it the tokens have more than %llu numbers (2 GiB), expected "
                "fewer views, tokens or numbers of a token",
                llu(kMostNumbers));
        values.insert(values.end(), made.begin(), made.end());
        return {};
    }

    const MaskTokensDesc& desc_;
    MaskNames names_;
    io::WeightsFile file_;
    MaskTokens counts_;
    std::uint64_t numbers_ = 0;
    std::set<std::string> classes_;
};

}  // namespace

std::vector<float> token_of(const Segment& segment, std::uint32_t instance, std::uint32_t width,
                            std::uint32_t height, std::uint32_t dimension) {
    std::vector<float> token;
    Hash hash;
    hash.add(segment.name);
    Random random(hash.value(), 0, 0, 0);
    while (token.size() + kTokenExtras < dimension) {
        const double angle = 2 * std::numbers::pi * random.uniform();
        token.push_back(static_cast<float>(std::sin(angle)));
        token.push_back(static_cast<float>(std::cos(angle)));
    }
    const double across = width, down = height;
    for (const double value :
         {std::sin(instance), std::cos(instance), (segment.left + segment.width / 2.0) / across,
          (segment.top + segment.height / 2.0) / down, segment.width / across,
          segment.height / down, static_cast<double>(segment.area) / (across * down), 1.0})
        token.push_back(static_cast<float>(value));
    return token;
}

std::vector<float> tokens_of(std::span<const Segment> segments, std::uint32_t width,
                             std::uint32_t height, const MaskTokensDesc& desc) {
    const std::size_t columns = desc.pooled ? 1 : desc.tokens;
    std::vector<float> made(columns * desc.dimension);
    std::map<std::string, std::uint32_t> instances;
    for (std::size_t i = 0; i < segments.size(); ++i) {
        if (!desc.pooled && i == columns) break;
        const std::vector<float> token =
            token_of(segments[i], instances[segments[i].name]++, width, height, desc.dimension);
        const float share = token[desc.dimension - 2];
        for (std::size_t d = 0; d < token.size(); ++d) {
            if (desc.pooled)
                made[d] += share * token[d];
            else
                made[d * columns + i] = token[d];
        }
    }
    return made;
}

Result<MaskTokens> write_mask_tokens(const MaskTokensDesc& desc) {
    SPLAT_TRY(check(desc));
    SPLAT_ASSIGN(MaskNames names, MaskNames::load(desc.names));
    SPLAT_ASSIGN(const std::vector<std::unique_ptr<Dataset>> splits, splits_of(desc));
    Writer writer(desc, std::move(names));
    for (const auto& split : splits) SPLAT_TRY(writer.add(*split));
    return writer.finish();
}

}  // namespace splat::data
