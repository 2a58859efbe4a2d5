// WebP against libwebp: lossless images of many looks, alpha of lossy ones, damaged streams, streams without a file.
#include <gtest/gtest.h>

#include <random>

#include <webp/decode.h>
#include <webp/encode.h>

#include "io/photo/photo.h"
#include "io/sample_webp.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

enum class Look { kFlat, kNoise, kSmooth, kPatches, kColors };

/// [height,width,4]. Of kColors there are `colors`.
std::vector<std::uint8_t> picture(Look look, int width, int height, std::uint32_t colors) {
    std::mt19937 random(static_cast<unsigned>(width * 31 + height));
    std::vector<std::uint8_t> rgba;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const std::uint32_t noise = static_cast<std::uint32_t>(random());
            const std::uint32_t smooth =
                static_cast<std::uint32_t>(x + 2 * y) * 0x010203U + (noise & 0x030303U);
            const int patch = (x / 24 + y / 20) % 3;
            const std::uint32_t color = noise % colors * 0x3B9D5FU;
            const std::uint32_t pixel = look == Look::kFlat     ? 0x336699U
                                        : look == Look::kNoise  ? noise
                                        : look == Look::kSmooth ? smooth
                                        : look == Look::kColors ? color
                                        : patch == 0            ? smooth
                                        : patch == 1            ? color
                                                                : noise & 0xF0F0F0U;
            for (const unsigned shift : {0U, 8U, 16U})
                rgba.push_back(static_cast<std::uint8_t>(pixel >> shift));
            const int alpha = look == Look::kFlat     ? 128
                              : look == Look::kSmooth ? 3 * x
                                                      : static_cast<int>(noise >> 24U);
            rgba.push_back(static_cast<std::uint8_t>(alpha));
        }
    return rgba;
}

Buffer encode(const std::vector<std::uint8_t>& rgba, int width, int height, bool alpha,
              const WebPConfig& config, std::uint32_t* features = nullptr) {
    WebPPicture image;
    WebPAuxStats stats{};
    EXPECT_NE(WebPPictureInit(&image), 0);
    image.use_argb = config.lossless;
    image.width = width;
    image.height = height;
    image.stats = &stats;
    WebPMemoryWriter writer;
    WebPMemoryWriterInit(&writer);
    image.writer = WebPMemoryWrite;
    image.custom_ptr = &writer;
    EXPECT_NE(
        (alpha ? WebPPictureImportRGBA : WebPPictureImportRGBX)(&image, rgba.data(), 4 * width), 0);
    EXPECT_NE(WebPEncode(&config, &image), 0);
    if (features != nullptr) *features |= stats.lossless_features;
    WebPPictureFree(&image);
    const auto* const first = reinterpret_cast<const std::byte*>(writer.mem);
    const Buffer file(first, first + writer.size);
    WebPMemoryWriterClear(&writer);
    return file;
}

WebPConfig lossless_config(int method, float quality) {
    WebPConfig config;
    EXPECT_NE(WebPConfigInit(&config), 0);
    config.lossless = 1;
    config.exact = 1;
    config.method = method;
    config.quality = quality;
    return config;
}

/// The content of a chunk that is there.
Bytes chunk_of(const Buffer& file, std::string_view tag) {
    const std::size_t at = as_text(file).find(tag);
    EXPECT_NE(at, std::string_view::npos) << tag;
    return Bytes(file).subspan(at + 8, number<std::uint32_t>(&file[at + 4]));
}

/// libwebp itself; false for more than 300 pixels on a side.
bool decodes(const Buffer& file) {
    WebPBitstreamFeatures features;
    const auto* const data = reinterpret_cast<const std::uint8_t*>(file.data());
    if (WebPGetFeatures(data, file.size(), &features) != VP8_STATUS_OK) return false;
    if (features.width > 300 || features.height > 300 || features.has_animation != 0) return false;
    std::vector<std::uint8_t> rgba(static_cast<std::size_t>(4 * features.width * features.height));
    return WebPDecodeRGBAInto(data, file.size(), rgba.data(), rgba.size(), 4 * features.width) !=
           nullptr;
}

TEST(Webp, KeepsLosslessPixels) {
    std::uint32_t features = 0;
    const std::pair<Look, std::uint32_t> looks[] = {
        {Look::kFlat, 1},    {Look::kNoise, 1},   {Look::kSmooth, 1},  {Look::kPatches, 7},
        {Look::kColors, 2},  {Look::kColors, 3},  {Look::kColors, 4},  {Look::kColors, 5},
        {Look::kColors, 16}, {Look::kColors, 17}, {Look::kColors, 200}};
    for (const auto& [look, colors] : looks)
        for (const auto& [width, height] : {std::pair(1, 1), {7, 5}, {91, 73}}) {
            std::vector<std::uint8_t> rgba = picture(look, width, height, colors);
            if (look == Look::kColors)
                for (std::size_t i = 3; i < rgba.size(); i += 4)
                    rgba[i] = rgba[i - 1] < 128 ? 255 : 254;
            for (const auto& [method, quality] :
                 {std::pair(0, 0.F), {2, 40.F}, {4, 75.F}, {6, 100.F}}) {
                SCOPED_TRACE(testing::Message()
                             << "look " << static_cast<int>(look) << " of " << colors << " colors, "
                             << width << " x " << height << ", method " << method);
                const auto image = need(read_webp(encode(
                    rgba, width, height, true, lossless_config(method, quality), &features)));
                if (image.channels == 4) {
                    EXPECT_EQ(image.samples, std::vector<std::uint16_t>(rgba.begin(), rgba.end()));
                }
            }
        }
    EXPECT_EQ(features, 15U) << "each transform occurs";
}

TEST(Webp, ReadsAlphaOfLossyFiles) {
    for (const Look look : {Look::kFlat, Look::kNoise, Look::kSmooth})
        for (const auto& [width, height] : {std::pair(7, 5), {61, 43}})
            for (const int filter : {0, 1, 2})
                for (const int method : {0, 4}) {
                    WebPConfig config = lossless_config(method, 60);
                    config.lossless = 0;
                    config.alpha_filtering = filter;
                    config.alpha_quality = filter == 1 ? 30 : 100;
                    const Buffer file =
                        encode(picture(look, width, height, 1), width, height, true, config);
                    EXPECT_OK(read_webp(file));
                }
}

/// The budget holds the samples.
TEST(Webp, TakesTheBudgetOfItsSamples) {
    constexpr std::uint32_t kWidth = 12, kHeight = 20;
    constexpr std::uint64_t kPixels = std::uint64_t{kWidth} * kHeight;
    const auto status = [](const Buffer& file, std::uint64_t budget) {
        return read_webp(file, {.limits = {.times_file = 0, .besides = budget}}).status();
    };
    WebPConfig lossy = lossless_config(4, 50);
    lossy.lossless = 0;
    const auto rgba = picture(Look::kNoise, kWidth, kHeight, 1);
    const std::pair<Buffer, std::uint64_t> files[] = {
        {test::sample_webp_groups(kWidth / 4, kHeight / 4), kPixels * 3 * 2},
        {encode(rgba, kWidth, kHeight, true, lossy), kPixels * 4 * 2},
        {encode(rgba, kWidth, kHeight, false, lossy), kPixels * 3 * 2}};
    for (const auto& [file, bytes] : files) {
        EXPECT_OK(status(file, bytes));
        EXPECT_ERROR(status(file, bytes - 1), Code::kFormat, "are too many");
    }
}

/// A mask of two colours, and one in the alpha of a lossy image: few bytes for many pixels.
TEST(Webp, MasksOfManyPixelsAreRead) {
    for (const auto& [side, alpha] : {std::pair(3000, false), {2800, true}}) {
        std::vector<std::uint8_t> rgba(std::size_t{4} * side * side);
        for (std::size_t i = 0; i < rgba.size(); ++i) {
            const std::size_t row = i / 4 / side, column = i / 4 % side;
            const bool inside = row / 500 % 2 == column / 700 % 2;
            rgba[i] = alpha && i % 4 < 3 ? 100 : inside || (!alpha && i % 4 == 3) ? 255 : 0;
        }
        WebPConfig config = lossless_config(0, 50);
        config.lossless = alpha ? 0 : 1;
        const Buffer file = encode(rgba, side, side, alpha, config);
        EXPECT_LT(file.size(), 400'000U);
        const auto image = need(read_webp(file));
        const std::size_t channels = image.channels;
        ASSERT_EQ(channels, alpha ? 4U : 3U);
        for (std::size_t i = 0; i < rgba.size() / 4; ++i)
            ASSERT_EQ(image.samples[channels * (i + 1) - 1], rgba[4 * i + (alpha ? 3 : 2)]);
    }
}

/// libwebp reads zeros behind a stream of fewer than 8 bytes.
TEST(Webp, ShortStreamsEndInZeros) {
    constexpr std::uint32_t kWidth = 12, kHeight = 20;
    test::BitWriter alpha;
    alpha.put(1, 8);
    alpha.put(0, 1);
    alpha.put(1, 1);  // a cache of 2^3 colours
    alpha.put(3, 4);
    alpha.put(0, 1);
    for (int code = 0; code < 5; ++code) alpha.put(1, code < 4 ? 4 : 1);
    ASSERT_EQ(alpha.count(), 4 * 8U);
    WebPConfig lossy = lossless_config(4, 50);
    lossy.lossless = 0;
    const std::vector<std::uint8_t> gray(std::size_t{4} * kWidth * kHeight, 100);
    const Buffer file = test::with_webp_alpha(encode(gray, kWidth, kHeight, false, lossy), kWidth,
                                              kHeight, alpha.bytes());
    EXPECT_TRUE(decodes(file));
    EXPECT_OK(read_webp(file));
}

/// Nothing is refused but what libwebp refuses. Returns whether it is read.
bool expect_same_answer(const Buffer& file) {
    const Status status = read_webp(file, {.max_side = 300}).status();
    EXPECT_EQ(status.ok(), decodes(file)) << status.message();
    return status.ok();
}

TEST(Webp, DamagedStreamsAreReadAsLibwebpDoes) {
    const Buffer patches =
        encode(picture(Look::kPatches, 67, 50, 7), 67, 50, true, lossless_config(6, 100));
    std::vector<std::uint8_t> few = picture(Look::kColors, 40, 31, 12);
    const Buffer packed = encode(few, 40, 31, false, lossless_config(4, 80));
    WebPConfig lossy = lossless_config(4, 50);
    lossy.lossless = 0;
    const Buffer alpha = encode(picture(Look::kSmooth, 50, 41, 1), 50, 41, true, lossy);
    const Buffer files[] = {patches, packed, alpha, test::sample_webp_groups(6, 7)};
    std::mt19937 random(3);
    for (const Buffer& file : files) {
        ASSERT_TRUE(expect_same_answer(file));
        const std::string_view tag =
            as_text(file).find("ALPH") == std::string_view::npos ? "VP8L" : "ALPH";
        const Bytes stream = chunk_of(file, tag);
        const auto first = static_cast<std::size_t>(stream.data() - file.data());
        int read = 0;
        for (int i = 0; i < 2000; ++i) {
            Buffer damaged = file;
            // Most of them before the pixels.
            const std::size_t reach =
                i % 4 == 0 ? stream.size() : std::min<std::size_t>(stream.size(), 120);
            for (int n = 0; n <= i % 2; ++n)
                damaged[first + random() % reach] ^= static_cast<std::byte>(1U << random() % 8);
            read += expect_same_answer(damaged) ? 1 : 0;
        }
        EXPECT_GT(read, 20);
        EXPECT_LT(read, 1950);
        if (tag != "VP8L") continue;
        for (std::size_t size = 0; size < stream.size(); size += 1 + stream.size() / 2000)
            expect_same_answer(test::sample_webp({{"VP8L", stream.first(size)}}));
    }
}

/// libwebp takes anything but a known first chunk for a bit stream without a container.
TEST(Webp, BareStreamsAreNoFiles) {
    test::BitWriter stream;
    test::put_vp8l_header(stream, 8, 8);
    test::put_vp8l_groups(stream, 2, 2);
    Buffer riff;
    put_text(riff, "RIFF");
    put(riff, static_cast<std::uint32_t>(4 + stream.bytes().size()));
    put_text(riff, "WEBP");
    put_bytes(riff, stream.bytes());
    // The first bytes could be the header of a chunk, which ends before a harmless one.
    test::BitWriter hidden;
    test::put_vp8l_header(hidden, 8, 8);
    hidden.put(5, 3);  // green is subtracted
    hidden.put(0, 3);
    for (int code = 0; code < 2; ++code) hidden.put(1, 4);
    for (int code = 2; code < 5; ++code) hidden.put_single(0);
    Buffer two;
    put_text(two, "RIFF");
    put(two, std::uint32_t{0});
    put_text(two, "WEBP");
    put_bytes(two, hidden.bytes());
    const std::size_t next = 20 + number<std::uint32_t>(&two[16]);
    ASSERT_LT(next, 30U << 20U);
    two.resize(next);
    put_bytes(two, Bytes(test::sample_webp({{"VP8L", stream.bytes()}})).subspan(12));
    const auto size = static_cast<std::uint32_t>(two.size() - 8);
    std::memcpy(&two[4], &size, sizeof size);
    for (const Buffer& file : {stream.bytes(), riff, two}) {
        EXPECT_TRUE(decodes(file));
        EXPECT_ERROR(read_webp(file), Code::kFormat, "has no image");
    }
}

}  // namespace
}  // namespace splat::io
