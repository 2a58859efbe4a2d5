#include "io/image.h"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstring>

#include "core/checked_math.h"
#include "core/no_copy.h"
#include "io/compress.h"

namespace splat::io {
namespace {

constexpr std::size_t kSignatureBytes = 8;

/// Packed bytes that may follow those of the pixels. libpng unpacks them all, each to at most kMaxDeflateRatio.
constexpr std::size_t kMostBytesAfter = std::size_t{64} << 10U;

/// State of libpng's callbacks. libpng leaves by longjmp, so no object with a destructor is created
/// between setjmp and the end of a function below.
struct PngState {
    Bytes in;
    Buffer* out = nullptr;
    char message[160] = "";
    std::uint64_t rows = 0;       ///< rows that are still packed, in all passes
    std::size_t most = SIZE_MAX;  ///< bytes that libpng may read
};

void on_error(png_structp png, png_const_charp message) {
    auto* const state = static_cast<PngState*>(png_get_error_ptr(png));
    std::strncpy(state->message, message, sizeof state->message - 1);
    png_longjmp(png, 1);  // libpng is C: an exception must not pass through it
}

void on_warning(png_structp, png_const_charp) {}

void on_read(png_structp png, png_bytep to, std::size_t count) {
    auto* const state = static_cast<PngState*>(png_get_io_ptr(png));
    if (count > state->in.size()) png_error(png, "the file is truncated");
    if (count > state->most) png_error(png, "more than 64 KiB of data follow the last row");
    state->most -= count;
    std::memcpy(to, state->in.data(), count);
    state->in = state->in.subspan(count);
}

/// libpng has unpacked a row. With the last one it unpacks all that follows.
void on_row(png_structp png, png_row_infop, png_bytep) {
    auto* const state = static_cast<PngState*>(png_get_io_ptr(png));
    if (--state->rows == 0) state->most = kMostBytesAfter;
}

/// Rows of all passes.
std::uint64_t count_rows(png_structp png, png_infop info) {
    const png_uint_32 width = png_get_image_width(png, info);
    const png_uint_32 height = png_get_image_height(png, info);
    if (png_get_interlace_type(png, info) == PNG_INTERLACE_NONE) return height;
    std::uint64_t rows = 0;
    for (unsigned pass = 0; pass < PNG_INTERLACE_ADAM7_PASSES; ++pass)
        if (PNG_PASS_COLS(width, pass) > 0) rows += PNG_PASS_ROWS(height, pass);
    return rows;
}

void on_write(png_structp png, png_bytep from, std::size_t count) {
    auto* const state = static_cast<PngState*>(png_get_io_ptr(png));
    try {
        put_bytes(*state->out, {reinterpret_cast<const std::byte*>(from), count});
    } catch (...) {
        std::strncpy(state->message, "out of memory", sizeof state->message - 1);
    }
    if (state->message[0] != 0) png_longjmp(png, 1);
}

void on_flush(png_structp) {}

/// libpng's objects for one direction: reading `in`, or writing to `out` if there is one.
class Png : NoCopy {
  public:
    Png(Bytes in, Buffer* out) : state{in, out} {
        png_ = (out != nullptr ? png_create_write_struct : png_create_read_struct)(
            PNG_LIBPNG_VER_STRING, &state, on_error, on_warning);
        if (png_ != nullptr) info_ = png_create_info_struct(png_);
    }
    ~Png() {
        if (state.out != nullptr)
            png_destroy_write_struct(&png_, &info_);
        else
            png_destroy_read_struct(&png_, &info_, nullptr);
    }

    /// Fills all but the samples.
    bool read_header(Image& image, const ImageOptions& options) {
        // NOLINTNEXTLINE(cert-err52-cpp)
        if (info_ == nullptr || setjmp(png_jmpbuf(png_)) != 0) return false;
        png_set_read_fn(png_, &state, on_read);
        png_set_user_limits(png_, options.max_side, options.max_side);
        // No text, profile or palette of suggestions, which may be compressed, is needed.
        png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
        png_read_info(png_, info_);
        png_set_expand(png_);
        png_set_swap(png_);  // samples of 16 bits to the order of this machine
        passes_ = png_set_interlace_handling(png_);
        png_set_read_user_transform_fn(png_, on_row);
        png_read_update_info(png_, info_);
        state.rows = count_rows(png_, info_);
        image.width = png_get_image_width(png_, info_);
        image.height = png_get_image_height(png_, info_);
        image.channels = png_get_channels(png_, info_);
        image.bits = png_get_bit_depth(png_, info_);
        return true;
    }

    /// `rows` is [height, bytes of a row].
    bool read_rows(png_bytep rows, std::size_t row_bytes, std::uint32_t height) {
        // NOLINTNEXTLINE(cert-err52-cpp)
        if (setjmp(png_jmpbuf(png_)) != 0) return false;
        for (int pass = 0; pass < passes_; ++pass)
            for (std::uint32_t y = 0; y < height; ++y)
                png_read_row(png_, rows + y * row_bytes, nullptr);
        state.most = SIZE_MAX;
        png_read_end(png_, nullptr);
        return true;
    }

    bool write(const Image& image, png_const_bytep rows, std::size_t row_bytes, PngEffort effort) {
        constexpr int kTypes[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA,
                                  PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA};
        // NOLINTNEXTLINE(cert-err52-cpp)
        if (info_ == nullptr || setjmp(png_jmpbuf(png_)) != 0) return false;
        png_set_write_fn(png_, &state, on_write, on_flush);
        if (effort == PngEffort::kFast) {
            png_set_compression_level(png_, 1);
            png_set_filter(png_, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
        }
        png_set_IHDR(png_, info_, image.width, image.height, static_cast<int>(image.bits),
                     kTypes[image.channels - 1], PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                     PNG_FILTER_TYPE_DEFAULT);
        png_write_info(png_, info_);
        if (image.bits == 16) png_set_swap(png_);
        for (std::uint32_t y = 0; y < image.height; ++y) png_write_row(png_, rows + y * row_bytes);
        png_write_end(png_, nullptr);
        return true;
    }

    PngState state;

  private:
    png_structp png_ = nullptr;
    png_infop info_ = nullptr;
    int passes_ = 1;
};

std::size_t row_bytes_of(const Image& image) {
    return std::size_t{image.width} * image.channels * (image.bits / 8);
}

std::size_t count_samples(const Image& image) {
    return std::size_t{image.width} * image.height * image.channels;
}

}  // namespace

Status check_header(const Image& image, const ImageOptions& options, std::uint64_t more_bytes,
                    std::uint64_t file_bytes, const char* format) {
    const std::uint64_t samples = count_samples(image);
    if (image.width > options.max_side || image.height > options.max_side ||
        samples > options.max_samples)
        return unsupported(
            "%s: %u x %u pixels of %u channels, the limit is %u on a side, %llu samples", format,
            image.width, image.height, image.channels, options.max_side, llu(options.max_samples));
    if (options.square && image.width != image.height)
        return damaged("%s: %u x %u pixels, expected a square", format, image.width, image.height);
    const std::string what = splat::format("%s: %u x %u pixels", format, image.width, image.height);
    DecodeBudget budget(file_bytes, options.limits);
    SPLAT_TRY(budget.take(samples, sizeof image.samples[0], what));
    return budget.take(more_bytes, 1, what + " while they are decoded");
}

std::uint8_t* make_byte_samples(Image& image) {
    image.samples.resize(count_samples(image));
    return reinterpret_cast<std::uint8_t*>(image.samples.data()) + image.samples.size();
}

void spread_byte_samples(Image& image) {
    const auto* const bytes =
        reinterpret_cast<const std::uint8_t*>(image.samples.data()) + image.samples.size();
    for (std::size_t i = 0; i < image.samples.size(); ++i) image.samples[i] = bytes[i];
}

Status check_image(const Image& image) {
    if (image.channels < 1 || image.channels > 4 || (image.bits != 8 && image.bits != 16))
        return invalid("image of %u channels of %u bits, expected 1 to 4 of 8 or 16",
                       image.channels, image.bits);
    const auto pixels = std::uint64_t{image.width} * image.height;
    const auto samples = checked_mul(pixels, image.channels);
    if (pixels == 0 || !samples || *samples != image.samples.size())
        return invalid("image of %u x %u x %u with %zu samples", image.width, image.height,
                       image.channels, image.samples.size());
    const auto largest = std::ranges::max_element(image.samples);
    if (image.bits == 8 && *largest > 255)
        return invalid("image of 8 bits with the sample %u", *largest);
    return {};
}

Result<Image> read_png(Bytes file, const ImageOptions& options) {
    if (file.size() < kSignatureBytes ||
        png_sig_cmp(reinterpret_cast<png_const_bytep>(file.data()), 0, kSignatureBytes) != 0)
        return damaged("png: the file does not start like a PNG file");
    // The header comes first. libpng's own limit calls it invalid.
    constexpr std::size_t kWidthAt = 16, kHeightAt = 20, kHeaderEnd = 24;
    if (file.size() >= kHeaderEnd) {
        const auto width = number<std::uint32_t>(file.data() + kWidthAt, std::endian::big);
        const auto height = number<std::uint32_t>(file.data() + kHeightAt, std::endian::big);
        if (std::max(width, height) > options.max_side)
            return unsupported("png: %u x %u pixels, the limit is %u on a side", width, height,
                               options.max_side);
    }
    Png reader(file, nullptr);
    Image image;
    if (!reader.read_header(image, options)) return damaged("png: %s", reader.state.message);
    // One bit per pixel before packing: the image may have been expanded.
    if (std::uint64_t{image.width} * image.height / 8 / kMaxDeflateRatio > file.size())
        return damaged("png: %u x %u pixels cannot come from %zu bytes", image.width, image.height,
                       file.size());
    SPLAT_TRY(check_header(image, options, 0, file.size(), "png"));
    if (options.header_only) return image;
    std::uint8_t* const bytes = make_byte_samples(image);
    const bool deep = image.bits == 16;
    if (!reader.read_rows(deep ? reinterpret_cast<png_bytep>(image.samples.data()) : bytes,
                          row_bytes_of(image), image.height))
        return damaged("png: %s", reader.state.message);
    if (!deep) spread_byte_samples(image);
    return image;
}

Result<Buffer> write_png(const Image& image, PngEffort effort) {
    SPLAT_TRY(check_image(image));
    std::vector<std::uint8_t> bytes;
    if (image.bits == 8) bytes.assign(image.samples.begin(), image.samples.end());
    Buffer file;
    Png writer({}, &file);
    if (!writer.write(image,
                      image.bits == 8 ? bytes.data()
                                      : reinterpret_cast<png_const_bytep>(image.samples.data()),
                      row_bytes_of(image), effort))
        return invalid("png: %s", writer.state.message);
    return file;
}

Image image_from_floats(std::span<const float> values, std::uint32_t width, std::uint32_t height,
                        std::uint32_t channels, std::uint32_t bits) {
    SPLAT_ASSERT(values.size() == std::size_t{width} * height * channels);
    const double most = bits == 8 ? 255 : 65535;
    Image image{width, height, channels, bits, {}};
    image.samples.reserve(values.size());
    for (const float value : values) {
        const double scaled = std::round(most * static_cast<double>(value));
        image.samples.push_back(  // NaN gives 0
            static_cast<std::uint16_t>(scaled > 0 ? std::min(scaled, most) : 0));
    }
    return image;
}

}  // namespace splat::io
