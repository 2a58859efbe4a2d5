// What precedes the pixels of lossless WebP, against what libwebp's encoder tells of it, and on damaged streams.
#include <gtest/gtest.h>

#include <random>

#include <webp/decode.h>
#include <webp/encode.h>

#include "io/photo/webp.h"
#include "io/photo/webp_lossless.h"
#include "io/sample_webp.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

constexpr std::uint64_t kHeaderBits = 40;

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

struct Encoded {
    Buffer file;
    WebPAuxStats stats{};
};

Encoded encode(const std::vector<std::uint8_t>& rgba, int width, int height, bool alpha,
               const WebPConfig& config) {
    Encoded encoded;
    WebPPicture image;
    EXPECT_NE(WebPPictureInit(&image), 0);
    image.use_argb = config.lossless;
    image.width = width;
    image.height = height;
    image.stats = &encoded.stats;
    WebPMemoryWriter writer;
    WebPMemoryWriterInit(&writer);
    image.writer = WebPMemoryWrite;
    image.custom_ptr = &writer;
    EXPECT_NE(
        (alpha ? WebPPictureImportRGBA : WebPPictureImportRGBX)(&image, rgba.data(), 4 * width), 0);
    EXPECT_NE(WebPEncode(&config, &image), 0);
    WebPPictureFree(&image);
    const auto* const first = reinterpret_cast<const std::byte*>(writer.mem);
    encoded.file.assign(first, first + writer.size);
    WebPMemoryWriterClear(&writer);
    return encoded;
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

Result<LosslessHead> head_of(Bytes stream, std::uint64_t skip_bits, int width, int height,
                             const DecodeLimits& limits = DecodeLimits()) {
    DecodeBudget budget(stream.size(), limits);
    return read_lossless_head(stream, skip_bits, static_cast<std::uint32_t>(width),
                              static_cast<std::uint32_t>(height), budget);
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

/// What was met in all files of a test.
struct Met {
    std::uint32_t features = 0, most_groups = 0, most_cache_bits = 0, narrowest = 0;
};

void expect_agreement(const std::vector<std::uint8_t>& rgba, int width, int height,
                      const WebPConfig& config, Met& met) {
    const Encoded encoded = encode(rgba, width, height, true, config);
    const auto head = head_of(chunk_of(encoded.file, "VP8L"), kHeaderBits, width, height);
    ASSERT_OK(head.status());
    // The encoder counts whole bytes from behind the header of 5 bytes to the end of the prefix codes.
    const WebPAuxStats& stats = encoded.stats;
    EXPECT_EQ((head.value().bits + 7) / 8,
              5U + static_cast<std::uint32_t>(stats.lossless_hdr_size));
    EXPECT_EQ(head.value().cache_bits, static_cast<std::uint32_t>(stats.cache_bits));
    const int colors = (stats.lossless_features & 8U) != 0 ? stats.palette_size : 256;
    const int pixels = colors <= 2 ? 8 : colors <= 4 ? 4 : colors <= 16 ? 2 : 1;  // packed into one
    EXPECT_EQ(head.value().width, static_cast<std::uint32_t>((width + pixels - 1) / pixels));
    met.features |= stats.lossless_features;
    met.most_groups = std::max(met.most_groups, head.value().groups);
    met.most_cache_bits = std::max(met.most_cache_bits, head.value().cache_bits);
    met.narrowest = std::max(met.narrowest, static_cast<std::uint32_t>(width) / head.value().width);
    const auto image = read_webp(encoded.file);
    ASSERT_OK(image.status());
    if (image.value().channels == 4) {
        EXPECT_EQ(image.value().samples, std::vector<std::uint16_t>(rgba.begin(), rgba.end()));
    }
}

TEST(WebpLossless, HeadEndsWhereTheEncoderSays) {
    Met met;
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
                expect_agreement(rgba, width, height, lossless_config(method, quality), met);
            }
        }
    EXPECT_EQ(met.features, 15U);  // each transform
    EXPECT_GE(met.most_groups, 4U);
    EXPECT_GE(met.most_cache_bits, 5U);
    EXPECT_GE(met.narrowest, 7U);
}

TEST(WebpLossless, AlphaOfLossyFiles) {
    int of_bytes = 0;
    int others = 0;
    for (const auto& [look, colors] :
         {std::pair<Look, std::uint32_t>{Look::kFlat, 1}, {Look::kNoise, 1}, {Look::kSmooth, 1}})
        for (const auto& [width, height] : {std::pair(7, 5), {61, 43}})
            for (const int filter : {0, 1, 2})
                for (const int method : {0, 4}) {
                    WebPConfig config = lossless_config(method, 60);
                    config.lossless = 0;
                    config.alpha_filtering = filter;
                    config.alpha_quality = filter == 1 ? 30 : 100;
                    const Encoded encoded =
                        encode(picture(look, width, height, colors), width, height, true, config);
                    EXPECT_OK(read_webp(encoded.file).status());
                    const Bytes stream = chunk_of(encoded.file, "ALPH");
                    if ((std::to_integer<unsigned>(stream[0]) & 3U) == 0) continue;
                    const auto head = head_of(stream, 8, width, height);
                    ASSERT_OK(head.status());
                    EXPECT_TRUE(head.value().only_green || !head.value().only_palette);
                    ++(head.value().only_palette ? of_bytes : others);
                }
    EXPECT_GE(of_bytes, 5);
    EXPECT_GE(others, 1);
}

TEST(WebpLossless, GroupsAreCounted) {
    constexpr std::uint64_t kGroupBytes = 12'440;
    constexpr std::uint64_t kBlockBytes = 4;  ///< bytes per pixel of the entropy image
    const std::pair<std::uint32_t, std::uint32_t> sizes[] = {{1, 1},   {3, 5},   {16, 16},
                                                             {17, 60}, {64, 80}, {256, 256}};
    for (const auto& [columns, rows] : sizes) {
        SCOPED_TRACE(testing::Message() << columns << " x " << rows);
        test::BitWriter stream;
        test::put_vp8l_header(stream, 4 * columns, 4 * rows);
        test::put_vp8l_groups(stream, columns, rows);
        const std::uint64_t count = std::uint64_t{columns} * rows;
        const int width = static_cast<int>(4 * columns);
        const int height = static_cast<int>(4 * rows);
        const auto head = [&](std::uint64_t budget) {
            return head_of(stream.bytes(), kHeaderBits, width, height,
                           {.times_file = 0, .besides = budget});
        };
        const std::uint64_t bytes = (kGroupBytes + kBlockBytes) * count;
        ASSERT_OK(head(bytes).status());
        EXPECT_EQ(head(bytes).value().groups, count);
        EXPECT_EQ(head(bytes).value().bits, stream.count());
        EXPECT_ERROR(head(bytes - 1).status(), Code::kFormat, "webp: groups of prefix codes");
        EXPECT_ERROR(head(kBlockBytes * count - 1).status(), Code::kFormat, "webp: blocks");
        EXPECT_EQ(read_webp(test::sample_webp({{"VP8L", stream.bytes()}})).ok(), columns < 256);
    }
}

constexpr std::uint32_t kWidth = 12;  ///< size of the files below
constexpr std::uint32_t kHeight = 20;

Buffer lossy_with_alpha(const test::BitWriter& alpha) {
    WebPConfig config = lossless_config(4, 50);
    config.lossless = 0;
    const std::vector<std::uint8_t> gray(std::size_t{4} * kWidth * kHeight, 100);
    const Encoded lossy = encode(gray, kWidth, kHeight, false, config);
    return test::with_webp_alpha(lossy.file, kWidth, kHeight, alpha.bytes());
}

/// The budget of `bytes` is enough, and no byte less.
void expect_takes(const Buffer& file, std::uint64_t bytes) {
    const auto status = [&](std::uint64_t budget) {
        return read_webp(file, {.limits = {.times_file = 0, .besides = budget}}).status();
    };
    EXPECT_OK(status(bytes));
    EXPECT_ERROR(status(bytes - 1), Code::kFormat, "are too many");
}

TEST(WebpLossless, BudgetIsWhatLibwebpTakes) {
    constexpr std::uint64_t kGroup = 12'440;
    constexpr std::uint64_t kPixels = std::uint64_t{kWidth} * kHeight;
    constexpr std::uint64_t kRows = 17 * kWidth;
    constexpr std::uint64_t kBlocks = 15;
    constexpr std::uint64_t kAlphaSamples = kPixels * (4 * 2 + 1);  // with the plane of alpha
    expect_takes(test::sample_webp_groups(kWidth / 4, kHeight / 4),
                 kPixels * 3 * 2 + kBlocks * (kGroup + 4) + 4 * (kPixels + kRows));
    test::BitWriter groups;
    groups.put(1, 8);  // compressed, no filter
    test::put_vp8l_groups(groups, kWidth / 4, kHeight / 4);
    expect_takes(lossy_with_alpha(groups),
                 kAlphaSamples + kBlocks * (kGroup + 4) + 4 * (kPixels + kRows));
    // A palette of two colours; libwebp decodes bytes if red, blue and alpha take no bits and there is no cache.
    for (const auto& [red_bits, cache_bits] : {std::pair(0U, 0U), {1U, 0U}, {0U, 3U}}) {
        test::BitWriter palette;
        palette.put(1, 8);
        palette.put(1, 1);
        palette.put(3, 2);
        palette.put(2 - 1, 8);
        palette.put(0, 1);
        for (int code = 0; code < 5; ++code) palette.put_single(0);
        palette.put(0, 1);  // no other transform
        palette.put(cache_bits > 0 ? 1 : 0, 1);
        if (cache_bits > 0) palette.put(cache_bits, 4);
        palette.put(0, 1);  // no entropy image
        for (int code = 0; code < 5; ++code) {
            if (code != 1 || red_bits == 0) {
                palette.put_single(0);
                continue;
            }
            palette.put(3, 2);  // two symbols: 0, and 1 of 8 bits
            palette.put(0, 2);
            palette.put(1, 8);
        }
        palette.put(0, 24);
        palette.put(0, 24);
        const std::uint64_t packed = (kWidth + 7) / 8 * kHeight;
        const bool bytes = red_bits + cache_bits == 0;
        const std::uint64_t cache = cache_bits > 0 ? 4U << cache_bits : 0;
        expect_takes(lossy_with_alpha(palette), kAlphaSamples + kGroup + cache + 2 * 4 +
                                                    (bytes ? packed : 4 * (packed + kRows)));
    }
}

/// libwebp reads zeros behind a stream of fewer than 8 bytes.
TEST(WebpLossless, ShortStreamsEndInZeros) {
    test::BitWriter alpha;
    alpha.put(1, 8);
    alpha.put(0, 1);
    alpha.put(1, 1);  // a cache of 2^3 colours
    alpha.put(3, 4);
    alpha.put(0, 1);
    for (int code = 0; code < 5; ++code) alpha.put(1, code < 4 ? 4 : 1);
    ASSERT_EQ(alpha.count(), 4 * 8U);
    const Buffer file = lossy_with_alpha(alpha);
    EXPECT_TRUE(decodes(file));
    EXPECT_OK(read_webp(file).status());
}

/// An entropy image with a colour cache and a copy, which libwebp's encoder does not write.
TEST(WebpLossless, EntropyImageWithCache) {
    test::BitWriter stream;
    test::put_vp8l_header(stream, 16, 8);
    stream.put(0, 1);  // no transform
    stream.put(1, 1);  // a cache of 2 colours
    stream.put(1, 4);
    stream.put(1, 1);  // an entropy image of 4 x 2 pixels
    stream.put(0, 3);
    stream.put(1, 1);  // a cache of 4 colours
    stream.put(2, 4);
    // Green has the symbols 2, 256 (a copy of one pixel), and 280 to 283 (of the cache): lengths 2, 2, 3, 3, 3, 3.
    stream.put(0, 1);
    stream.put(12 - 4, 4);  // 17, 18, 0, 1, 2, 3, 4, 5, 16, 6, 7, 8
    for (const std::uint32_t length : {0U, 2U, 2U, 0U, 2U, 2U}) stream.put(length, 3);
    for (int i = 0; i < 6; ++i) stream.put(0, 3);
    stream.put(
        0,
        1);  // all lengths follow. Codes: 00 is 0, 01 is 2, 10 is 3, 11 is 18, the highest bit first
    const auto put_code = [&](std::uint32_t code, std::uint32_t count) {
        for (std::uint32_t i = count; i-- > 0;) stream.put(code >> i & 1U, 1);
    };
    const auto zeros = [&](std::uint32_t count) {
        put_code(3, 2);
        stream.put(count - 11, 7);
    };
    put_code(0, 2);
    put_code(0, 2);
    put_code(1, 2);  // 2
    zeros(138);
    zeros(256 - 3 - 138);
    put_code(1, 2);  // 256
    zeros(23);
    for (int i = 0; i < 4; ++i) put_code(2, 2);
    stream.put_single(0);                                       // red
    for (int code = 2; code < 4; ++code) stream.put_single(0);  // blue and alpha
    stream.put_single(1);                                       // a distance of 2: the left pixel
    put_code(0, 2);                                             // group 2
    for (std::uint32_t i = 0; i < 4; ++i) put_code(4 + i, 3);   // cached
    for (int i = 0; i < 3; ++i) put_code(1, 2);                 // copies
    for (int code = 0; code < 3 * 5; ++code) stream.put(1, 4);
    const auto head = head_of(stream.bytes(), kHeaderBits, 16, 8);
    ASSERT_OK(head.status());
    EXPECT_EQ(head.value().groups, 3U);
    EXPECT_EQ(head.value().cache_bits, 1U);
    EXPECT_EQ(head.value().bits, stream.count());
    EXPECT_OK(read_webp(test::sample_webp({{"VP8L", stream.bytes()}})).status());
}

/// Nothing is refused but what libwebp refuses, and what takes too much. Returns whether it is read.
bool expect_same_answer(const Buffer& file) {
    const Status status = read_webp(file, {.max_side = 300}).status();
    const bool counts = status.message().find("are too many") != std::string::npos;
    EXPECT_EQ(status.ok(), decodes(file) && !counts) << status.message();
    return status.ok();
}

TEST(WebpLossless, DamagedStreamsAreReadAsLibwebpDoes) {
    const Encoded patches =
        encode(picture(Look::kPatches, 67, 50, 7), 67, 50, true, lossless_config(6, 100));
    std::vector<std::uint8_t> few = picture(Look::kColors, 40, 31, 12);
    const Encoded packed = encode(few, 40, 31, false, lossless_config(4, 80));
    WebPConfig lossy = lossless_config(4, 50);
    lossy.lossless = 0;
    const Encoded alpha = encode(picture(Look::kSmooth, 50, 41, 1), 50, 41, true, lossy);
    const Buffer files[] = {patches.file, packed.file, alpha.file, test::sample_webp_groups(6, 7)};
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
TEST(WebpLossless, BareStreamsAreNoFiles) {
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
        EXPECT_ERROR(read_webp(file).status(), Code::kFormat, "has no image");
    }
}

}  // namespace
}  // namespace splat::io
