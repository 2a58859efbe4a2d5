#include <cmath>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

/// 4 x 3 pixels of 0.5.
splat_image small_image(std::uint32_t channels) {
    static float pixels[4 * 3 * 4];
    std::fill(std::begin(pixels), std::end(pixels), 0.5F);
    splat_image image{};
    image.pixels = pixels;
    image.bytes = sizeof(float) * 12 * channels;
    image.type = SPLAT_PIXEL_F32;
    image.width = 4;
    image.height = 3;
    image.channels = channels;
    return image;
}

splat_normals_desc normals_desc() {
    auto desc = sized<splat_normals_desc>();
    desc.focal_x = desc.focal_y = 4;
    return desc;
}

}  // namespace

void MisuseTable::prior_rows() {
    add("splat_prior_preset", "name", "NULL: the names", SPLAT_INCOMPLETE,
        [] { return splat_prior_preset(nullptr, nullptr, 0, nullptr); });
    add("splat_prior_preset", "name", "no preset", kNotFound,
        [this] { return splat_prior_preset("none", text_out(), 16, out<std::size_t>()); });
    const auto mask = [](const splat_image* picture, const splat_image* to) {
        return splat_picture_mask(picture, to, nullptr);
    };
    for (const char* parameter : {"picture", "mask"}) {
        const bool picture = parameter[0] == 'p';
        const auto with = [mask, picture](const splat_image* wrong) {
            const splat_image other = small_image(picture ? 1 : 3);
            return picture ? mask(wrong, &other) : mask(&other, wrong);
        };
        add("splat_picture_mask", parameter, "NULL", kArgument, [with] { return with(nullptr); });
        splat_image image = small_image(picture ? 3 : 1);
        image.type = 9;
        add("splat_picture_mask", parameter, "a type of pixels that is unknown", kArgument,
            [with, image] { return with(&image); });
    }
    add("splat_picture_mask", "mask", "three channels", SPLAT_ERROR_SHAPE_MISMATCH, [mask] {
        const splat_image image = small_image(3);
        return mask(&image, &image);
    });
    add("splat_picture_mask", "found", "NULL: not wanted", SPLAT_OK, [mask] {
        std::uint8_t bytes[12];
        splat_image to{bytes, sizeof bytes, SPLAT_PIXEL_U8, 4, 3, 1, 0, 0, 0};
        const splat_image image = small_image(3);
        return mask(&image, &to);
    });
}

void MisuseTable::normals_rows() {
    const auto normals = [](const splat_image* depth, const splat_normals_desc* desc,
                            std::uint32_t channels) {
        float pixels[4 * 3 * 4];
        splat_image to = small_image(channels);
        to.pixels = pixels;
        return splat_normals_from_depth(depth, desc, &to);
    };
    const auto invalid = [&](const char* what, void (*change)(splat_normals_desc&)) {
        splat_normals_desc desc = normals_desc();
        change(desc);
        add("splat_normals_from_depth", "desc", what, kArgument, [normals, desc] {
            const splat_image depth = small_image(1);
            return normals(&depth, &desc, 3);
        });
    };
    invalid("no focal length", [](auto& d) { d.focal_x = 0; });
    invalid("a focal length that is no number", [](auto& d) { d.focal_y = NAN; });
    invalid("a centre that is no number", [](auto& d) { d.center_x = NAN; });
    invalid("farthest before nearest", [](auto& d) { d.nearest = 2, d.farthest = 1; });
    invalid("only farthest", [](auto& d) { d.farthest = 1; });
    const splat_normals_desc good = normals_desc();
    add("splat_normals_from_depth", "depth", "three channels", SPLAT_ERROR_SHAPE_MISMATCH,
        [normals, good] {
            const splat_image depth = small_image(3);
            return normals(&depth, &good, 3);
        });
    add("splat_normals_from_depth", "depth", "relative depth above 1", kArgument, [normals, good] {
        float two[12];
        std::fill(std::begin(two), std::end(two), 2.0F);
        splat_image depth = small_image(1);
        depth.pixels = two;
        splat_normals_desc desc = good;
        desc.nearest = 1, desc.farthest = 2;
        return normals(&depth, &desc, 3);
    });
    add("splat_normals_from_depth", "normal", "one channel", SPLAT_ERROR_SHAPE_MISMATCH,
        [normals, good] {
            const splat_image depth = small_image(1);
            return normals(&depth, &good, 1);
        });
}

void MisuseTable::prior_model_rows() {
    const auto invalid = wrong_descs<splat_prior_model_desc>("splat_prior_model_create");
    invalid("no runtime", kNotFound, [](auto&) {});
    invalid("no preset of this name", kNotFound, [](auto& d) { d.preset = "none"; });
    invalid("no preset for this file", kNotFound, [](auto& d) {
        d.preset = nullptr;
        d.model_path = "net.onnx";
    });
    invalid("neither preset nor model", kArgument,
            [](auto& d) { d.preset = d.model_path = nullptr; });
    invalid("JSON without members", kArgument, [](auto& d) { d.preset = "{}"; });
    invalid("JSON that ends early", kArgument, [](auto& d) { d.preset = "{"; });
    invalid("too many threads", kArgument, [](auto& d) { d.threads = UINT32_MAX; });
    static const splat_image picture = small_image(3);
    static const splat_prior_maps maps = {{}, {}, small_image(1)};
    add("splat_prior_model_run", "count", "0", kArgument,
        [] { return splat_prior_model_run(nullptr, &picture, &maps, 0); });
}

}  // namespace splat::test
