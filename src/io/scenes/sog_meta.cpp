#include "io/scenes/sog_meta.h"

#include <algorithm>
#include <cmath>

#include "core/json_tree.h"
#include "core/json_writer.h"
#include "core/path_name.h"
#include "core/shown.h"
#include "io/reader.h"
#include "scene/gaussians.h"

namespace splat::io {
namespace {

constexpr double kMaxLogMean = 88.723;  ///< a little above the logarithm of the largest float32
constexpr double kMaxCode = 1e38;

/// Reads members, and names them in errors.
class SogMetaReader {
  public:
    explicit SogMetaReader(const JsonTree& root) : root_(root) {}

    Result<SogMeta> run() {
        if (!root_.is_object()) return damaged("sog: meta.json is not an object");
        if (const JsonTree* const version = root_.find("version"); version != nullptr) {
            if (version->count() != 2)
                return unsupported(
                    "sog: 'version' of meta.json is not 2, nor missing as in version 1");
        } else {
            meta_.version = 1;
        }
        SPLAT_TRY(read_count());
        SPLAT_TRY(check_members(
            root_, "",
            {"version", "asset", "count", "antialias", "means", "scales", "quats", "sh0", "shN"}));
        if (const JsonTree* const antialias = root_.find("antialias"); antialias != nullptr) {
            const bool* const flag = std::get_if<bool>(&antialias->value);
            if (flag == nullptr) return bad("antialias", "true or false");
            meta_.antialiased = *flag;
        }
        SPLAT_TRY(files("means", {kSogMeansLow, kSogMeansHigh}));
        SPLAT_TRY(numbers("means", "mins", kMaxLogMean, meta_.mins));
        SPLAT_TRY(numbers("means", "maxs", kMaxLogMean, meta_.maxs));
        SPLAT_TRY(files("quats", {kSogQuats}));
        SPLAT_TRY(files("scales", {kSogScales}));
        SPLAT_TRY(files("sh0", {kSogColors}));
        if (root_.find("shN") != nullptr) SPLAT_TRY(files("shN", {kSogCentroids, kSogLabels}));
        SPLAT_TRY(meta_.version == 1 ? ranges() : codebooks());
        return std::move(meta_);
    }

  private:
    static Status bad(const std::string& member, const char* expected) {
        return damaged("sog: '%s' of meta.json is missing or damaged, expected %s", member.c_str(),
                       expected);
    }

    Status read_count() {
        const JsonTree& count = meta_.version == 1 && !root_["means"]["shape"].items().empty()
                                    ? root_["means"]["shape"].items().front()
                                    : root_["count"];
        if (!count.count()) return bad(meta_.version == 1 ? "means.shape" : "count", "a count");
        meta_.count = *count.count();
        return {};
    }

    Status check_members(const JsonTree& tree, const std::string& prefix,
                         std::initializer_list<std::string_view> known) {
        const auto* const object = std::get_if<JsonTree::Object>(&tree.value);
        if (object == nullptr) return bad(prefix, "an object");
        for (const JsonTree::Member& member : *object)
            if (std::ranges::find(known, member.name) == known.end() && meta_.ignored.size() < 100)
                meta_.ignored.push_back("member " + prefix + (prefix.empty() ? "" : ".") +
                                        shown(member.name, 40));
        return {};
    }

    Status files(const char* section, std::initializer_list<SogImage> images) {
        const JsonTree& tree = root_[section];
        SPLAT_TRY(check_members(tree, section,
                                {"files", "mins", "maxs", "codebook", "count", "bands", "shape",
                                 "dtype", "encoding", "quantization"}));
        const auto& names = tree["files"].items();
        if (names.size() != images.size())
            return bad(std::string(section) + ".files",
                       images.size() == 1 ? "the name of an image" : "the names of two images");
        for (std::size_t i = 0; i < names.size(); ++i) {
            const std::string* const name = names[i].text();
            if (name == nullptr || name->empty())
                return bad(std::string(section) + ".files", "names");
            if (!is_name_in_folder(*name))
                return damaged("sog: %s.files names '%s', expected a file beside meta.json",
                               section, shown(*name, 80).c_str());
            meta_.files[*(images.begin() + i)] = *name;
        }
        return {};
    }

    template <class T, std::size_t N>
    Status numbers(const char* section, const char* name, double most, std::array<T, N>& to) {
        const std::string member = std::string(section) + "." + name;
        const JsonTree& tree = root_[section][name];
        if (tree.items().size() != N)
            return damaged("sog: '%s' of meta.json has %zu numbers, expected %zu", member.c_str(),
                           tree.items().size(), N);
        for (std::size_t i = 0; i < N; ++i) {
            const auto number = tree.items()[i].number();
            if (!number || !(std::abs(*number) <= most))
                return damaged("sog: '%s' %zu of meta.json is not a number within +-%g",
                               member.c_str(), i, most);
            to[i] = static_cast<T>(*number);
        }
        return {};
    }

    Status codebooks() {
        SPLAT_TRY(numbers("scales", "codebook", kMaxCode, meta_.scales[0]));
        SPLAT_TRY(numbers("sh0", "codebook", kMaxCode, meta_.colors[0]));
        meta_.scales.fill(meta_.scales[0]);
        meta_.colors.fill(meta_.colors[0]);
        for (std::size_t i = 0; i < meta_.opacity_logits.size(); ++i)
            meta_.opacity_logits[i] = opacity_logit(static_cast<std::uint8_t>(i));
        if (!meta_.has_harmonics()) return {};
        SPLAT_TRY(numbers("shN", "codebook", kMaxCode, meta_.harmonics));
        const auto count = root_["shN"]["count"].count();
        const auto bands = root_["shN"]["bands"].count();
        if (!count || *count == 0 || *count > 65536) return bad("shN.count", "1 to 65536");
        if (!bands || *bands == 0 || *bands > scene::kMaxShDegree)
            return bad("shN.bands", "1 to 3");
        meta_.palette = *count;
        meta_.degree = static_cast<std::uint32_t>(*bands);
        return {};
    }

    /// Version 1: bytes are 256 steps from a least to a greatest value.
    static void fill(Codebook& codebook, double low, double high) {
        for (std::size_t i = 0; i < codebook.size(); ++i)
            codebook[i] = static_cast<float>(low + (high - low) * static_cast<double>(i) / 255);
    }

    Status ranges() {
        std::array<double, 3> low{}, high{};
        std::array<double, 4> low4{}, high4{};
        SPLAT_TRY(numbers("scales", "mins", kMaxCode, low));
        SPLAT_TRY(numbers("scales", "maxs", kMaxCode, high));
        SPLAT_TRY(numbers("sh0", "mins", kMaxCode, low4));
        SPLAT_TRY(numbers("sh0", "maxs", kMaxCode, high4));
        for (std::size_t k = 0; k < 3; ++k) {
            fill(meta_.scales[k], low[k], high[k]);
            fill(meta_.colors[k], low4[k], high4[k]);
        }
        fill(meta_.opacity_logits, low4[3], high4[3]);
        if (!meta_.has_harmonics()) return {};
        const auto least = root_["shN"]["mins"].number(), most = root_["shN"]["maxs"].number();
        if (!least || !most || !(std::abs(*least) <= kMaxCode) || !(std::abs(*most) <= kMaxCode))
            return bad("shN.mins, maxs", "a number each");
        fill(meta_.harmonics, *least, *most);
        return {};
    }

    const JsonTree& root_;
    SogMeta meta_;
};

}  // namespace

Result<SogMeta> parse_sog_meta(Bytes text) {
    SPLAT_ASSIGN(const JsonTree root, from_file(parse_json_tree(as_text(text), "sog: meta.json")));
    return SogMetaReader(root).run();
}

std::string write_sog_meta(const SogMeta& meta) {
    JsonWriter json(JsonWriter::Style::kCompact);
    const auto files = [&](std::initializer_list<SogImage> images) {
        json.key("files").begin_array();
        for (const SogImage image : images) json.value(meta.files[image]);
        json.end().end();
    };
    json.begin_object().member("version", 2).member("count", meta.count);
    if (meta.antialiased) json.member("antialias", true);
    json.key("asset").begin_object().member("generator", "libsplat").end();
    json.key("means").begin_object().key("mins").list(meta.mins).key("maxs").list(meta.maxs);
    files({kSogMeansLow, kSogMeansHigh});
    json.key("scales").begin_object().key("codebook").list(meta.scales[0]);
    files({kSogScales});
    json.key("quats").begin_object();
    files({kSogQuats});
    json.key("sh0").begin_object().key("codebook").list(meta.colors[0]);
    files({kSogColors});
    if (meta.has_harmonics()) {
        json.key("shN").begin_object().member("count", meta.palette).member("bands", meta.degree);
        json.key("codebook").list(meta.harmonics);
        files({kSogCentroids, kSogLabels});
    }
    return json.end().text();
}

}  // namespace splat::io
