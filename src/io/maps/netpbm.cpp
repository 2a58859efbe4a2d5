#include "io/maps/netpbm.h"

#include "core/c_locale.h"
#include "io/reader.h"
#include "scene/camera_pose.h"

namespace splat::io {
namespace {

constexpr std::uint32_t kMostSample = 65535;
constexpr std::uint32_t kMostSide = 1U << 30U;  ///< greatest width or height of a header, pixels

/// The words of a header after its first two letters. One blank ends the last of them.
class NetpbmWords {
  public:
    NetpbmWords(Bytes file, std::string name) : text_(as_text(file)), name_(std::move(name)) {}

    Status bad(const std::string& problem) const {
        return damaged("%s: %s", name_.c_str(), problem.c_str());
    }

    Result<std::string_view> word(const char* what) {
        while (at_ < text_.size() && (is_blank(text_[at_]) || text_[at_] == '#'))
            at_ = text_[at_] == '#' ? std::min(text_.find('\n', at_), text_.size()) : at_ + 1;
        const std::size_t begin = at_;
        while (at_ < text_.size() && !is_blank(text_[at_]) && at_ - begin < kMostLetters) ++at_;
        if (at_ == begin || at_ == text_.size() || !is_blank(text_[at_]))
            return bad(std::string("the header has no ") + what);
        return text_.substr(begin, at_ - begin);
    }

    Result<std::uint32_t> whole(const char* what, std::uint32_t most) {
        SPLAT_ASSIGN(const std::string_view text, word(what));
        const std::uint32_t value = number_in<std::uint32_t>(text).value_or(0);
        if (value >= 1 && value <= most) return value;
        return bad(format("%s is '%s', expected 1 to %u", what, shown(text).c_str(), most));
    }

    /// Where the samples begin.
    [[nodiscard]] std::size_t end() const { return at_ + 1; }

  private:
    static constexpr std::size_t kMostLetters = 32;
    static bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

    std::string_view text_;
    std::string name_;
    std::size_t at_ = 2;
};

/// What follows a header, of the expected length.
Result<Bytes> samples_of(Bytes file, std::size_t start, std::uint64_t expected,
                         const char* format_name) {
    const Bytes samples = file.subspan(std::min(start, file.size()));
    if (samples.size() == expected) return samples;
    return damaged("%s: %zu bytes of samples, expected %llu for its size", format_name,
                   samples.size(), llu(expected));
}

}  // namespace

Result<Image> read_netpbm(Bytes file, const ImageOptions& options) {
    const std::string_view text = as_text(file);
    const bool colour = text.starts_with("P6");
    const char* const name = colour ? "PPM" : "PGM";
    if (!colour && !text.starts_with("P5")) return damaged("not a PGM or PPM file");
    NetpbmWords words(file, name);
    Image image;
    SPLAT_ASSIGN(image.width, words.whole("width", kMostSide));
    SPLAT_ASSIGN(image.height, words.whole("height", kMostSide));
    SPLAT_ASSIGN(const std::uint32_t most, words.whole("greatest value", kMostSample));
    image.channels = colour ? 3 : 1;
    image.bits = most <= 255 ? 8 : 16;
    SPLAT_TRY(check_header(image, options, 0, file.size(), name));
    if (options.header_only) return image;
    const std::size_t each = image.bits / 8;
    const std::size_t count = std::size_t{image.width} * image.height * image.channels;
    SPLAT_ASSIGN(const Bytes samples, samples_of(file, words.end(), count * each, name));
    const std::uint32_t full = image.bits == 8 ? 255 : kMostSample;
    image.samples.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t sample = each == 1
                                         ? static_cast<std::uint32_t>(samples[i])
                                         : number<std::uint16_t>(&samples[2 * i], std::endian::big);
        if (sample > most)
            return words.bad(
                format("sample %zu is %u, above the greatest value %u", i, sample, most));
        image.samples[i] = static_cast<std::uint16_t>((sample * full + most / 2) / most);
    }
    return image;
}

Result<NumberImage> read_pfm(Bytes file, NumberPart part) {
    const std::string_view text = as_text(file);
    if (!text.starts_with("PF") && !text.starts_with("Pf")) return damaged("not a PFM file");
    NetpbmWords words(file, "PFM");
    NumberImage image;
    image.channels = text[1] == 'F' ? 3 : 1;
    SPLAT_ASSIGN(image.width, words.whole("width", scene::kMaxImageSide));
    SPLAT_ASSIGN(image.height, words.whole("height", scene::kMaxImageSide));
    SPLAT_ASSIGN(const std::string_view scale, words.word("scale"));
    const auto value = decimal_number(std::string(scale));
    if (!value || !(std::abs(*value) > 0))
        return words.bad("the scale is '" + shown(scale) +
                         "', expected a number whose sign gives the order of bytes");
    if (part == NumberPart::kHeader) return image;
    const std::size_t row = std::size_t{image.width} * image.channels;
    SPLAT_ASSIGN(const Bytes samples,
                 samples_of(file, words.end(), row * image.height * sizeof(float), "PFM"));
    if (part == NumberPart::kSize) return image;
    const std::endian order = *value < 0 ? std::endian::little : std::endian::big;
    image.values.reserve(row * image.height);
    for (std::size_t y = image.height; y-- > 0;)
        for (std::size_t i = y * row; i < (y + 1) * row; ++i)
            image.values.push_back(number<float>(&samples[i * sizeof(float)], order));
    return image;
}

}  // namespace splat::io
