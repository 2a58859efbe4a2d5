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

std::string small_png() {
    const std::vector<unsigned char> pixels(64 * 64 * 3);
    return bytes_of(splat_image_save_memory, packed_image(pixels, 64, 64, 3), SPLAT_IMAGE_PNG);
}

splat_result load_png(const std::string& file) {
    const std::vector<unsigned char> pixels(64 * 64 * 3);
    splat_image image = packed_image(pixels, 64, 64, 3);
    return splat_image_load_memory(file.data(), file.size(), &image, nullptr);
}

TEST(ApiDecodeLimits, HoldUntilTheyAreReplaced) {
    const std::string file = small_png();
    EXPECT_DONE(load_png(file));
    auto limits = sized<splat_decode_limits>();
    limits.bytes_times_file = 1;
    limits.bytes_besides = 1000;
    {
        const Limited limited(limits);
        EXPECT_REFUSED(load_png(file), kFormat, "splat_decode_set_limits");
        splat_image header{};  // for which its caller would make room
        EXPECT_REFUSED(splat_image_load_memory(file.data(), file.size(), &header, nullptr), kFormat,
                       "png: 64 x 64 pixels: 12288 x 2 bytes are too many");
        EXPECT_EQ(header.width, 0U);
        const auto zeros = sized<splat_decode_limits>();
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
    const Weights weights = got(splat_weights_from_arrays, arrays, 2);
    const std::string file =
        bytes_of(splat_weights_save_memory, weights, SPLAT_WEIGHTS_SAFETENSORS, 0);
    auto limits = sized<splat_decode_limits>();
    limits.items = 1;
    const Limited limited(limits);
    Weights read;
    EXPECT_REFUSED(splat_weights_load_memory(file.data(), file.size(), read.out()), kFormat,
                   "more than 1 tensors");
}

TEST(ApiDecodeLimits, RefuseWhatTheyDoNotKnow) {
    auto limits = sized<splat_decode_limits>();
    limits.reserved = 1;
    EXPECT_REFUSED(splat_decode_set_limits(&limits), kArgument, "reserved");
    limits = sized<splat_decode_limits>();
    limits.flags = 1;
    EXPECT_REFUSED(splat_decode_set_limits(&limits), kArgument, "flags");
}

}  // namespace
}  // namespace splat::test
