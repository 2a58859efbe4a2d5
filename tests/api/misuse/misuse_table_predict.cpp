// The rows of pictures and predictors.
#include <cmath>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

/// A picture with one wrong member.
struct WrongPicture {
    const char* what;
    splat_result expected;
    void (*change)(splat_picture&);
};

const float kEmbedding[] = {1};

constexpr WrongPicture kWrongPictures[] = {
    {"no image", kArgument, [](splat_picture& p) { p.image = {}; }},
    {"a path and pixels", kArgument, [](splat_picture& p) { p.image.path = "a.png"; }},
    {"unknown flags", kArgument, [](splat_picture& p) { p.flags = 2; }},
    {"no file", kNotFound,
     [](splat_picture& p) {
         p.image = {};
         p.image.path = "/nowhere/photo.png";
     }},
    {"a type of pixels that is unknown", kArgument,
     [](splat_picture& p) { p.image.pixels.type = 9; }},
    {"too few bytes", kArgument, [](splat_picture& p) { p.image.pixels.bytes -= 1; }},
    {"a width of 0", kArgument, [](splat_picture& p) { p.image.pixels.width = 0; }},
    {"a foreground of 2", kArgument, [](splat_picture& p) { p.foreground = 2; }},
    {"a foreground of a whole picture", kArgument,
     [](splat_picture& p) {
         p.flags = SPLAT_PICTURE_WHOLE;
         p.foreground = 0.5F;
     }},
    {"an embedding without a count", kArgument, [](splat_picture& p) { p.embedding = kEmbedding; }},
    {"tokens without a count", kArgument, [](splat_picture& p) { p.tokens = kEmbedding; }},
    {"a mask of black", kArgument, [](splat_picture& p) { p.mask = p.image; }},
    {"a mask of another size", kArgument,
     [](splat_picture& p) {
         p.mask = p.image;
         p.mask.pixels.height = 8;
     }},
};

}  // namespace

void MisuseTable::picture_rows() {
    static const splat_image pixels = good<splat_picture>().image.pixels;
    const auto invalid = wrong_structs<splat_picture_cut_desc>("splat_picture_cut");
    invalid("a resolution of 7", kArgument, [](auto& d) { d.resolution = 7; });
    invalid("depth of a picture without", kArgument, [](auto& d) {
        d.depth = pixels;
        d.depth.channels = 1;
    });
    invalid("an image of another size", kShape, [](auto& d) {
        d.image = pixels;
        d.resolution = 8;
    });
    for (const auto& [what, expected, change] : kWrongPictures) {
        for (const char* named : {"picture", "info"})
            wrong_structs<splat_picture>("splat_picture_cut", "picture", named)(what, expected,
                                                                                change);
        wrong_structs<splat_picture>("splat_predictor_predict", "pictures")(what, expected, change);
    }
}

void MisuseTable::predictor_rows() {
    SPLAT_WRONG(splat_builtin_weights).each("name", "unknown", kNotFound, "nothing");
    const auto invalid = wrong_structs<splat_predictor_desc>("splat_predictor_create");
    invalid("weights of another network", kFormat, [](auto&) {});
    invalid("no configuration", kArgument, [](auto& d) { d.config = nullptr; });
    invalid("a wrong configuration", kArgument, [](auto& d) { d.config = "a: 1"; });
    invalid("an aggregation of one view", kArgument, [](auto& d) { d.aggregate = 1; });
    invalid("an aggregation of another network", kArgument, [](auto& d) { d.aggregate = 8; });
    invalid("an unknown convention", kArgument, [](auto& d) { d.convention = 77; });
    invalid("a path and adapters", kArgument, [](auto& d) {
        d.adapters = d.weights;
        d.adapters_path = "a.npz";
    });
    invalid("no adapters", kFormat, [](auto& d) { d.adapters = d.weights; });
    invalid("a factor that is not finite", kArgument, [](auto& d) { d.adapters_alpha = NAN; });
    invalid("no file", kNotFound, [](auto& d) {
        d.weights = nullptr;
        d.weights_path = "/nowhere/weights.npz";
    });
    const splat_picture picture = good<splat_picture>();
    static const splat_picture two[] = {picture, picture};
    const auto predict = SPLAT_WRONG(splat_predictor_predict);
    for (const std::uint32_t count : {1U, 2U, UINT32_MAX})
        predict.given("count", count).each("pictures", "NULL", kArgument, nullptr);
    predict.given("pictures", two)
        .each("count", "0, 2 for a network of one view", kArgument, 0U, 2U);
    predict.each("prediction", "struct_size 0", kArgument, splat_prediction{});
    SPLAT_WRONG(splat_predictor_predict_object)
        .as_is("dataset", "of another resolution", kArgument)
        .each("object", "of a data set of another resolution", kArgument, 9U)
        .each("count", "0", kArgument, 0U)
        .each("prediction", "struct_size 0", kArgument, splat_prediction{});
}

}  // namespace splat::test
