#include "core/no_copy.h"
#include "io/photo/photo.h"

#include <csetjmp>
#include <cstdio>  // jpeglib.h needs FILE
#include <utility>

#include <jpeglib.h>
// After jpeglib.h, whose types it needs.
#include <jerror.h>

namespace splat::io {
namespace {

/// State of libjpeg's callbacks. libjpeg leaves by longjmp, so no object with a destructor is created
/// between setjmp and the end of a function below.
struct JpegState {
    jpeg_error_mgr errors{};
    std::jmp_buf escape{};
    char message[JMSG_LENGTH_MAX] = "";
    jpeg_progress_mgr progress{};
    std::uint32_t max_scans = 0;
};

void on_error(j_common_ptr jpeg) {
    auto* const state = reinterpret_cast<JpegState*>(jpeg->err);
    jpeg->err->format_message(jpeg, state->message);
    std::longjmp(state->escape, 1);  // libjpeg is C: an exception must not pass through it
}

/// Warnings after which pixels are missing; the others are about skipped bytes.
void on_message(j_common_ptr jpeg, int level) {
    const int code = jpeg->err->msg_code;
    if (level < 0 &&
        (code == JWRN_JPEG_EOF || code == JWRN_HIT_MARKER || code == JWRN_HUFF_BAD_CODE))
        on_error(jpeg);
}

/// Each scan passes over the whole image, however few bytes it has.
void on_progress(j_common_ptr jpeg) {
    auto* const state = reinterpret_cast<JpegState*>(jpeg->err);
    const auto* const decoder = reinterpret_cast<j_decompress_ptr>(jpeg);
    if (static_cast<std::uint32_t>(decoder->input_scan_number) <= state->max_scans) return;
    std::snprintf(state->message, sizeof state->message, "more than %u scans, the limit",
                  state->max_scans);
    std::longjmp(state->escape, 1);
}

class JpegReader : NoCopy {
  public:
    JpegReader(Bytes file, std::uint32_t max_scans) : file_(file) {
        jpeg_.err = jpeg_std_error(&state.errors);
        state.errors.error_exit = on_error;
        state.errors.emit_message = on_message;
        state.progress.progress_monitor = on_progress;
        state.max_scans = max_scans;
    }
    ~JpegReader() { jpeg_destroy_decompress(&jpeg_); }

    /// Fills all but the samples.
    bool read_header(Image& image) {
        // NOLINTNEXTLINE(cert-err52-cpp)
        if (setjmp(state.escape) != 0) return false;
        jpeg_create_decompress(&jpeg_);
        jpeg_.progress = &state.progress;
        jpeg_mem_src(&jpeg_, reinterpret_cast<const unsigned char*>(file_.data()),
                     static_cast<unsigned long>(file_.size()));
        jpeg_read_header(&jpeg_, TRUE);
        image.width = jpeg_.image_width;
        image.height = jpeg_.image_height;
        image.channels = jpeg_.jpeg_color_space == JCS_GRAYSCALE ? 1 : 3;
        cmyk = jpeg_.num_components == 4;
        return true;
    }

    /// Bytes of the coefficients, which libjpeg keeps only for an image of several scans.
    [[nodiscard]] std::uint64_t coefficient_bytes() {
        if (jpeg_has_multiple_scans(&jpeg_) == FALSE) return 0;
        std::uint64_t blocks = 0;
        for (int i = 0; i < jpeg_.num_components; ++i)
            blocks += std::uint64_t{jpeg_.comp_info[i].width_in_blocks} *
                      jpeg_.comp_info[i].height_in_blocks;
        return blocks * sizeof(JBLOCK);
    }

    /// `rows` is [height, width x channels].
    bool read_rows(unsigned char* rows, std::size_t row_bytes, bool gray) {
        // NOLINTNEXTLINE(cert-err52-cpp)
        if (setjmp(state.escape) != 0) return false;
        jpeg_.out_color_space = gray ? JCS_GRAYSCALE : JCS_RGB;
        jpeg_start_decompress(&jpeg_);
        while (jpeg_.output_scanline < jpeg_.output_height) {
            unsigned char* row = rows + jpeg_.output_scanline * row_bytes;
            jpeg_read_scanlines(&jpeg_, &row, 1);
        }
        jpeg_finish_decompress(&jpeg_);
        return true;
    }

    JpegState state;
    bool cmyk = false;

  private:
    Bytes file_;
    jpeg_decompress_struct jpeg_{};
};

Status bad(const char* message) {
    return damaged("jpeg: %s", message);
}

}  // namespace

Result<Image> read_jpeg(Bytes file, const ImageOptions& options) {
    if (file.size() < 3 || file[0] != std::byte{0xFF} || file[1] != std::byte{0xD8})
        return bad("the file does not start like a JPEG file");
    JpegReader reader(file, options.limits.max_jpeg_scans);
    Image image;
    if (!reader.read_header(image)) return bad(reader.state.message);
    if (reader.cmyk) return unsupported("jpeg: four channels (CMYK), expected gray or RGB");
    const std::uint64_t pixels = std::uint64_t{image.width} * image.height;
    // Every block of 8 x 8 pixels takes at least one bit.
    if (pixels / 512 > file.size())
        return damaged("jpeg: %u x %u pixels cannot come from %zu bytes", image.width, image.height,
                       file.size());
    const Exif exif = exif_of(file, image.width, image.height);
    const bool turned = options.upright && exif.orientation != 1;
    const std::uint64_t copy = turned ? pixels * image.channels * sizeof image.samples[0] : 0;
    SPLAT_TRY(check_header(image, options, reader.coefficient_bytes() + copy, file.size(), "jpeg"));
    image.focal = exif.focal;
    if (options.header_only) {
        if (options.upright && exif.orientation >= 5) std::swap(image.width, image.height);
        return image;
    }
    const std::size_t row_bytes = std::size_t{image.width} * image.channels;
    if (!reader.read_rows(make_byte_samples(image), row_bytes, image.channels == 1))
        return bad(reader.state.message);
    spread_byte_samples(image);
    return options.upright ? upright(std::move(image), exif.orientation) : std::move(image);
}

}  // namespace splat::io
