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
        return splat_picture_cut(picture, desc, outputs.picture_info.out());
    };
    descs<splat_picture_cut_desc>("splat_picture_cut", good,
                                  [cut](const splat_picture_cut_desc* desc) {
                                      const splat_picture picture = black_picture();
                                      return cut(&picture, desc);
                                  });
    add("splat_picture_cut", "desc", "NULL", kArgument, [cut] {
        const splat_picture picture = black_picture();
        return cut(&picture, nullptr);
    });
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
    add("splat_picture_cut", "picture", "NULL", kArgument,
        [cut, good] { return cut(nullptr, &good); });
    for (const WrongPicture& wrong : kWrongPictures)
        for (const char* parameter : {"picture", "info"})
            add("splat_picture_cut", parameter, wrong.what, wrong.expected, [cut, good, wrong] {
                splat_picture picture = black_picture();
                wrong.change(picture);
                return cut(&picture, &good);
            });
}

void MisuseTable::predictor_rows() {
    add("splat_builtin_weights", "name", "unknown", SPLAT_ERROR_NOT_FOUND, [this] {
        return splat_builtin_weights("nothing", *outputs.text.out(), 16, outputs.size.out());
    });
    for (const char* parameter : {"buffer", "capacity", "needed"})
        add("splat_builtin_weights", parameter, "NULL or 0", SPLAT_INCOMPLETE,
            [] { return splat_builtin_weights(nullptr, nullptr, 0, nullptr); });
    auto good = sized<splat_predictor_desc>();
    good.weights = weights_handle_;
    good.config = kSmallModel;
    const auto create = [this](const splat_predictor_desc* desc) {
        return splat_predictor_create(device_, desc, outputs.predictor.out());
    };
    handles<splat_device>(
        "splat_predictor_create", "device",
        [this](splat_device device) {
            return splat_predictor_create(device, nullptr, outputs.predictor.out());
        },
        kHandle);
    descs<splat_predictor_desc>("splat_predictor_create", good, create);
    const auto invalid = [&](const char* what, splat_result expected,
                             void (*change)(splat_predictor_desc&)) {
        splat_predictor_desc desc = good;
        change(desc);
        add("splat_predictor_create", "desc", what, expected,
            [create, desc] { return create(&desc); });
    };
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
    add("splat_predictor_create", "predictor", "NULL", kArgument,
        [this] { return splat_predictor_create(device_, nullptr, nullptr); });
    handles<splat_predictor>(
        "splat_predictor_get_info", "predictor",
        [this](splat_predictor p) {
            return splat_predictor_get_info(p, outputs.predictor_info.out());
        },
        kHandle);
    infos<splat_predictor_info>(
        "splat_predictor_get_info", "info",
        [this](splat_predictor_info* info) { return splat_predictor_get_info(predictor_, info); });
    handles<splat_predictor>(
        "splat_predictor_report", "predictor",
        [this](splat_predictor p) {
            return splat_predictor_report(p, *outputs.text.out(), 16, outputs.size.out());
        },
        kHandle);
    for (const char* parameter : {"buffer", "capacity", "needed"})
        add("splat_predictor_report", parameter, "NULL or 0", SPLAT_INCOMPLETE,
            [this] { return splat_predictor_report(predictor_, nullptr, 0, nullptr); });
    handles<splat_predictor>("splat_predictor_destroy", "predictor", splat_predictor_destroy,
                             SPLAT_OK);
}

void MisuseTable::prediction_rows() {
    const auto predict = [this](splat_predictor predictor, const splat_picture* pictures,
                                std::uint32_t count) {
        return splat_predictor_predict(predictor, pictures, count, outputs.scene.out(), nullptr);
    };
    handles<splat_predictor>(
        "splat_predictor_predict", "predictor",
        [predict](splat_predictor p) {
            const splat_picture picture = black_picture();
            return predict(p, &picture, 1);
        },
        kHandle);
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
    add("splat_predictor_predict", "scene", "NULL", kArgument, [this] {
        const splat_picture picture = black_picture();
        return splat_predictor_predict(predictor_, &picture, 1, nullptr, nullptr);
    });
    add("splat_predictor_predict", "prediction", "struct_size 0", kArgument, [this] {
        const splat_picture picture = black_picture();
        splat_prediction prediction{};
        return splat_predictor_predict(predictor_, &picture, 1, outputs.scene.out(), &prediction);
    });
    const auto object = [this](splat_predictor predictor, splat_dataset dataset,
                               std::uint32_t number, const std::uint32_t* views,
                               std::uint32_t count) {
        return splat_predictor_predict_object(predictor, dataset, number, views, count,
                                              outputs.scene.out(), nullptr);
    };
    static const std::uint32_t kViews[] = {0};
    handles<splat_predictor>(
        "splat_predictor_predict_object", "predictor",
        [this, object](splat_predictor p) { return object(p, dataset_, 0, kViews, 1); }, kHandle);
    handles<splat_dataset>(
        "splat_predictor_predict_object", "dataset",
        [this, object](splat_dataset d) { return object(predictor_, d, 0, kViews, 1); }, kHandle);
    add("splat_predictor_predict_object", "dataset", "of another resolution", kArgument,
        [this, object] { return object(predictor_, dataset_, 0, kViews, 1); });
    add("splat_predictor_predict_object", "object", "of a data set of another resolution",
        kArgument, [this, object] { return object(predictor_, dataset_, 9, kViews, 1); });
    add("splat_predictor_predict_object", "views", "NULL", kArgument,
        [this, object] { return object(predictor_, dataset_, 0, nullptr, 1); });
    add("splat_predictor_predict_object", "count", "0", kArgument,
        [this, object] { return object(predictor_, dataset_, 0, kViews, 0); });
    add("splat_predictor_predict_object", "scene", "NULL", kArgument, [this] {
        return splat_predictor_predict_object(predictor_, dataset_, 0, kViews, 1, nullptr, nullptr);
    });
    add("splat_predictor_predict_object", "prediction", "struct_size 0", kArgument, [this] {
        splat_prediction prediction{};
        return splat_predictor_predict_object(predictor_, dataset_, 0, kViews, 1,
                                              outputs.scene.out(), &prediction);
    });
    infos<splat_prediction>(
        "splat_prediction_report", "prediction", [this](splat_prediction* prediction) {
            return splat_prediction_report(prediction, *outputs.text.out(), 16, outputs.size.out());
        });
    for (const char* parameter : {"buffer", "capacity", "needed"})
        add("splat_prediction_report", parameter, "NULL or 0", SPLAT_INCOMPLETE, [] {
            const auto prediction = sized<splat_prediction>();
            return splat_prediction_report(&prediction, nullptr, 0, nullptr);
        });
}

}  // namespace splat::test
