// Limits of what a file may cost. Needs no device.
#include "api/api_calls.h"

namespace splat::test {
namespace {

/// Restores the defaults.
struct Limited {
    explicit Limited(const splat_decode_limits& limits) {
        EXPECT_DONE(splat_decode_set_limits(&limits));
    }
    ~Limited() { EXPECT_DONE(splat_decode_set_limits(nullptr)); }
};

std::vector<unsigned char> small_png() {
    unsigned char pixels[64 * 64 * 3] = {};
    splat_image image{};
    image.pixels = pixels;
    image.bytes = sizeof pixels;
    image.type = SPLAT_PIXEL_U8;
    image.width = image.height = 64;
    image.channels = 3;
    std::vector<unsigned char> file(4096);
    std::size_t needed = 0;
    EXPECT_DONE(
        splat_image_save_memory(&image, SPLAT_IMAGE_PNG, file.data(), file.size(), &needed));
    file.resize(needed);
    return file;
}

splat_result load_png(const std::vector<unsigned char>& file) {
    std::vector<unsigned char> pixels(64 * 64 * 3);
    splat_image image{};
    image.pixels = pixels.data();
    image.bytes = pixels.size();
    image.type = SPLAT_PIXEL_U8;
    image.width = image.height = 64;
    image.channels = 3;
    return splat_image_load_memory(file.data(), file.size(), &image, nullptr);
}

TEST(ApiDecodeLimits, HoldUntilTheyAreReplaced) {
    const std::vector<unsigned char> file = small_png();
    EXPECT_DONE(load_png(file));
    auto limits = sized<splat_decode_limits>();
    limits.bytes_times_file = 1;
    limits.bytes_besides = 1000;
    {
        const Limited limited(limits);
        EXPECT_REFUSED(load_png(file), SPLAT_ERROR_FORMAT, "splat_decode_set_limits");
        splat_image header{};  // for which its caller would make room
        EXPECT_REFUSED(splat_image_load_memory(file.data(), file.size(), &header, nullptr),
                       SPLAT_ERROR_FORMAT, "png: 64 x 64 pixels: 12288 x 2 bytes are too many");
        EXPECT_EQ(header.width, 0U);
        auto zeros = sized<splat_decode_limits>();
        EXPECT_DONE(splat_decode_set_limits(&zeros));
        EXPECT_DONE(load_png(file));
        EXPECT_DONE(splat_decode_set_limits(&limits));
        EXPECT_FALSE(load_png(file) == SPLAT_OK);
    }
    EXPECT_DONE(load_png(file));
}

TEST(ApiDecodeLimits, CountTensors) {
    const float value = 1;
    const splat_named_array arrays[] = {{"a", &value, 1, {1}, 1, 0}, {"b", &value, 1, {1}, 1, 0}};
    Weights weights;
    ASSERT_DONE(splat_weights_from_arrays(arrays, 2, weights.out()));
    std::size_t needed = 0;
    std::vector<char> file(4096);
    ASSERT_DONE(splat_weights_save_memory(weights, SPLAT_WEIGHTS_SAFETENSORS, 0, file.data(),
                                          file.size(), &needed));
    auto limits = sized<splat_decode_limits>();
    limits.items = 1;
    const Limited limited(limits);
    Weights read;
    EXPECT_REFUSED(splat_weights_load_memory(file.data(), needed, read.out()), SPLAT_ERROR_FORMAT,
                   "more than 1 tensors");
}

TEST(ApiDecodeLimits, RefuseWhatTheyDoNotKnow) {
    auto limits = sized<splat_decode_limits>();
    limits.reserved = 1;
    EXPECT_REFUSED(splat_decode_set_limits(&limits), SPLAT_ERROR_INVALID_ARGUMENT, "reserved");
    limits = sized<splat_decode_limits>();
    limits.flags = 1;
    EXPECT_REFUSED(splat_decode_set_limits(&limits), SPLAT_ERROR_INVALID_ARGUMENT, "flags");
}

}  // namespace
}  // namespace splat::test
