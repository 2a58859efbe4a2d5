#include <cmath>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr splat_result kNoFile = SPLAT_ERROR_NOT_FOUND;  ///< result for a file that is not there

/// 16 x 16 black pixels.
splat_picture black_picture() {
    static std::uint8_t pixels[16 * 16 * 3];
    splat_picture picture{};
    picture.image.pixels.pixels = pixels;
    picture.image.pixels.bytes = sizeof pixels;
    picture.image.pixels.type = SPLAT_PIXEL_U8;
    picture.image.pixels.width = picture.image.pixels.height = 16;
    picture.image.pixels.channels = 3;
    return picture;
}

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
    {"no file", kNoFile,
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
    auto good = sized<splat_picture_cut_desc>();
    good.resolution = 16;
    const auto cut = [this](const splat_picture* picture, const splat_picture_cut_desc* desc) {
        return splat_picture_cut(picture, desc, out<splat_picture_info>());
    };
    add("splat_picture_cut", "desc", "a resolution of 7", kArgument, [cut, good] {
        const splat_picture picture = black_picture();
        splat_picture_cut_desc desc = good;
        desc.resolution = 7;
        return cut(&picture, &desc);
    });
    add("splat_picture_cut", "desc", "depth of a picture without", kArgument, [this, cut, good] {
        const splat_picture picture = black_picture();
        splat_picture_cut_desc desc = good;
        desc.depth = picture.image.pixels;
        desc.depth.channels = 1;
        return cut(&picture, &desc);
    });
    add("splat_picture_cut", "desc", "an image of another size", SPLAT_ERROR_SHAPE_MISMATCH,
        [cut, good] {
            const splat_picture picture = black_picture();
            splat_picture_cut_desc desc = good;
            desc.image = picture.image.pixels;
            desc.resolution = 8;
            return cut(&picture, &desc);
        });
    for (const WrongPicture& wrong : kWrongPictures)
        for (const char* parameter : {"picture", "info"})
            add("splat_picture_cut", parameter, wrong.what, wrong.expected, [cut, good, wrong] {
                splat_picture picture = black_picture();
                wrong.change(picture);
                return cut(&picture, &good);
            });
}

void MisuseTable::predictor_rows() {
    add("splat_builtin_weights", "name", "unknown", SPLAT_ERROR_NOT_FOUND,
        [this] { return splat_builtin_weights("nothing", text_out(), 16, out<std::size_t>()); });
    const auto invalid = wrong_descs<splat_predictor_desc>("splat_predictor_create");
    invalid("weights of another network", SPLAT_ERROR_FORMAT, [](splat_predictor_desc&) {});
    invalid("no configuration", kArgument, [](splat_predictor_desc& d) { d.config = nullptr; });
    invalid("a wrong configuration", kArgument, [](splat_predictor_desc& d) { d.config = "a: 1"; });
    invalid("a path and adapters", kArgument, [](splat_predictor_desc& d) {
        d.adapters = d.weights;
        d.adapters_path = "a.npz";
    });
    invalid("no adapters", kFormat, [](splat_predictor_desc& d) { d.adapters = d.weights; });
    invalid("a factor that is not finite", kArgument,
            [](splat_predictor_desc& d) { d.adapters_alpha = NAN; });
    invalid("no file", kNoFile, [](splat_predictor_desc& d) {
        d.weights = nullptr;
        d.weights_path = "/nowhere/weights.npz";
    });
}

void MisuseTable::prediction_rows() {
    const auto predict = [this](splat_predictor predictor, const splat_picture* pictures,
                                std::uint32_t count) {
        return splat_predictor_predict(predictor, pictures, count, out<splat_scene>(), nullptr);
    };
    for (const std::uint32_t count : {1U, 2U, UINT32_MAX})
        add("splat_predictor_predict", "pictures", "NULL", kArgument,
            [this, predict, count] { return predict(predictor_, nullptr, count); });
    for (const std::uint32_t count : {0U, 2U})
        add("splat_predictor_predict", "count", "0, 2 for a network of one view", kArgument,
            [this, predict, count] {
                const splat_picture pictures[] = {black_picture(), black_picture()};
                return predict(predictor_, pictures, count);
            });
    for (const WrongPicture& wrong : kWrongPictures)
        add("splat_predictor_predict", "pictures", wrong.what, wrong.expected,
            [this, predict, wrong] {
                splat_picture picture = black_picture();
                wrong.change(picture);
                return predict(predictor_, &picture, 1);
            });
    add("splat_predictor_predict", "prediction", "struct_size 0", kArgument, [this] {
        const splat_picture picture = black_picture();
        splat_prediction prediction{};
        return splat_predictor_predict(predictor_, &picture, 1, out<splat_scene>(), &prediction);
    });
    const auto object = [this](splat_predictor predictor, splat_dataset dataset,
                               std::uint32_t number, const std::uint32_t* views,
                               std::uint32_t count) {
        return splat_predictor_predict_object(predictor, dataset, number, views, count,
                                              out<splat_scene>(), nullptr);
    };
    static const std::uint32_t kViews[] = {0};
    add("splat_predictor_predict_object", "dataset", "of another resolution", kArgument,
        [this, object] { return object(predictor_, dataset_, 0, kViews, 1); });
    add("splat_predictor_predict_object", "object", "of a data set of another resolution",
        kArgument, [this, object] { return object(predictor_, dataset_, 9, kViews, 1); });
    add("splat_predictor_predict_object", "count", "0", kArgument,
        [this, object] { return object(predictor_, dataset_, 0, kViews, 0); });
    add("splat_predictor_predict_object", "prediction", "struct_size 0", kArgument, [this] {
        splat_prediction prediction{};
        return splat_predictor_predict_object(predictor_, dataset_, 0, kViews, 1,
                                              out<splat_scene>(), &prediction);
    });
}

}  // namespace splat::test
