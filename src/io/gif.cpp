#include <gif_lib.h>

#include <algorithm>
#include <array>

#include "core/no_copy.h"
#include "io/animation.h"

namespace splat::io {
namespace {

constexpr int kPaletteColors = 256;
constexpr std::array<unsigned, 3> kLevels = {6, 7, 6};
constexpr std::size_t kDither = 8;

/// Element of Bayer's 8 x 8 matrix: 0 to 63, neighbours far apart.
unsigned bayer(std::size_t x, std::size_t y) {
    unsigned value = 0;
    for (unsigned bit = 0; bit < 3; ++bit) {
        const auto xb = static_cast<unsigned>(x >> bit & 1);
        const auto yb = static_cast<unsigned>(y >> bit & 1);
        value |= ((xb ^ yb) << 1 | yb) << 2 * (2 - bit);
    }
    return value;
}

/// The level of a sample: rounded up where the remainder exceeds the threshold of the pixel.
unsigned level_of(unsigned sample, unsigned levels, unsigned threshold) {
    return (sample * (levels - 1) * 64 + 255 * threshold + 127) / (255 * 64);
}

std::array<GifColorType, kPaletteColors> palette_of(std::uint32_t channels) {
    std::array<GifColorType, kPaletteColors> palette{};
    for (unsigned i = 0; i < palette.size(); ++i) {
        const auto gray = static_cast<GifByteType>(i);
        palette[i] = {gray, gray, gray};
        if (channels == 1) continue;
        const unsigned at[] = {i / (kLevels[1] * kLevels[2]), i / kLevels[2] % kLevels[1],
                               i % kLevels[2]};
        const auto byte = [&](std::size_t c) {
            return static_cast<GifByteType>(std::min(at[c] * 255 / (kLevels[c] - 1), 255U));
        };
        palette[i] = {byte(0), byte(1), byte(2)};
    }
    return palette;
}

void index_row(const Image& image, std::size_t y, std::vector<GifByteType>& row) {
    for (std::size_t x = 0; x < image.width; ++x) {
        const std::uint16_t* const sample = &image.samples[(y * image.width + x) * image.channels];
        unsigned index = sample[0];
        if (image.channels == 3) {
            const unsigned threshold = bayer(x % kDither, y % kDither);
            index = 0;
            for (std::size_t c = 0; c < 3; ++c)
                index = index * kLevels[c] + level_of(sample[c], kLevels[c], threshold);
        }
        row[x] = static_cast<GifByteType>(index);
    }
}

/// GifTarget of giflib's callback. giflib is C: no exception may pass through it.
struct GifTarget {
    Buffer file;
    bool out_of_memory = false;
};

int append(GifFileType* gif, const GifByteType* bytes, int count) {
    auto* const target = static_cast<GifTarget*>(gif->UserData);
    try {
        put_bytes(target->file, std::as_bytes(std::span(bytes, static_cast<std::size_t>(count))));
        return count;
    } catch (...) {
        target->out_of_memory = true;
        return 0;
    }
}

/// giflib's objects.
class Encoder : NoCopy {
  public:
    explicit Encoder(GifTarget& target) : gif_(EGifOpen(&target, append, &error_)) {}
    ~Encoder() { static_cast<void>(close()); }

    [[nodiscard]] bool open() const { return gif_ != nullptr; }

    bool begin(const Image& frame, const AnimationOptions& options) {
        const auto palette = palette_of(frame.channels);
        ColorMapObject* const map = GifMakeMapObject(kPaletteColors, palette.data());
        if (map == nullptr) return false;
        EGifSetGifVersion(gif_, true);
        const bool done = EGifPutScreenDesc(gif_, static_cast<int>(frame.width),
                                            static_cast<int>(frame.height), 8, 0, map) == GIF_OK;
        GifFreeMapObject(map);
        return done && put_loop(options);
    }

    bool add(const Image& frame, const AnimationOptions& options) {
        GraphicsControlBlock control{};
        control.DisposalMode = DISPOSE_DO_NOT;
        control.TransparentColor = NO_TRANSPARENT_COLOR;
        control.DelayTime = static_cast<int>(std::max((options.milliseconds + 5) / 10, 2U));
        std::array<GifByteType, 4> bytes{};
        EGifGCBToExtension(&control, bytes.data());
        if (EGifPutExtension(gif_, GRAPHICS_EXT_FUNC_CODE, 4, bytes.data()) != GIF_OK) return false;
        if (EGifPutImageDesc(gif_, 0, 0, static_cast<int>(frame.width),
                             static_cast<int>(frame.height), false, nullptr) != GIF_OK)
            return false;
        std::vector<GifByteType> row(frame.width);
        for (std::size_t y = 0; y < frame.height; ++y) {
            index_row(frame, y, row);
            if (EGifPutLine(gif_, row.data(), static_cast<int>(row.size())) != GIF_OK) return false;
        }
        return true;
    }

    bool close() {
        if (gif_ == nullptr) return false;
        const bool done = EGifCloseFile(gif_, &error_) == GIF_OK;
        gif_ = nullptr;
        return done;
    }

  private:
    /// Netscape's extension: how often to play, 0 for ever.
    bool put_loop(const AnimationOptions& options) {
        const std::uint32_t repeats = std::min(options.repeats, 65535U);
        const GifByteType count[] = {1, static_cast<GifByteType>(repeats & 255),
                                     static_cast<GifByteType>(repeats >> 8)};
        return EGifPutExtensionLeader(gif_, APPLICATION_EXT_FUNC_CODE) == GIF_OK &&
               EGifPutExtensionBlock(gif_, 11, "NETSCAPE2.0") == GIF_OK &&
               EGifPutExtensionBlock(gif_, sizeof count, count) == GIF_OK &&
               EGifPutExtensionTrailer(gif_) == GIF_OK;
    }

    int error_ = 0;
    GifFileType* gif_;
};

Status failure(const GifTarget& target) {
    if (target.out_of_memory) throw std::bad_alloc();
    return error(Code::kOutOfHostMemory, "gif: out of memory");
}

}  // namespace

Result<Buffer> write_gif(const std::vector<Image>& frames, const AnimationOptions& options) {
    SPLAT_TRY(check_frames(frames, options));
    const Image& first = frames[0];
    if (first.channels % 2 == 0)
        return unsupported("gif: %u channels, expected 1 or 3, as it has no alpha", first.channels);
    if (first.width > kMaxGifSide || first.height > kMaxGifSide)
        return unsupported("gif: %u x %u pixels, expected sides of at most %u", first.width,
                           first.height, kMaxGifSide);
    GifTarget target;
    Encoder encoder(target);
    if (!encoder.open() || !encoder.begin(first, options)) return failure(target);
    for (const Image& frame : frames)
        if (!encoder.add(frame, options)) return failure(target);
    if (!encoder.close()) return failure(target);
    return std::move(target.file);
}

}  // namespace splat::io
