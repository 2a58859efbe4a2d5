// The rows of files and of what reads and writes them in memory.
#include <array>
#include <cstring>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr const char* kNoImage = "/nonexistent/image.png";
constexpr float kMisusePixels[6] = {};
constexpr char kNoKnownFile[] = "no file of any kind";

splat_image float_image(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
    splat_image image{};
    image.pixels = const_cast<float*>(kMisusePixels);
    image.type = SPLAT_PIXEL_F32;
    image.width = width;
    image.height = height;
    image.channels = channels;
    return image;
}

/// Pictures that no function takes, with the field that is wrong.
std::vector<std::pair<const char*, splat_image>> wrong_images() {
    const splat_image good = float_image(2, 1, 3);
    std::vector<std::pair<const char*, splat_image>> wrong;
    const auto change = [&](const char* what, auto member, auto value) {
        wrong.emplace_back(what, good);
        wrong.back().second.*member = value;
    };
    for (const splat_pixel type : {-1, 0, 4}) change("a type", &splat_image::type, type);
    for (const std::uint32_t size : {0U, 16385U}) {
        change("a width", &splat_image::width, size);
        change("a height", &splat_image::height, size);
        change("channels", &splat_image::channels, size);
    }
    change("too few bytes", &splat_image::bytes, std::size_t{23});
    change("a stride beyond the bytes", &splat_image::row_stride, std::int64_t{1} << 62);
    wrong.back().second.height = 2;
    wrong.back().second.bytes = sizeof kMisusePixels;
    change("a negative stride with bytes", &splat_image::pixel_stride, std::int64_t{-12});
    wrong.back().second.bytes = sizeof kMisusePixels;
    return wrong;
}

}  // namespace

void MisuseTable::image_rows() {
    const splat_image good = float_image(2, 1, 3);
    add("splat_image_load", "path", "no file", kNotFound,
        [good] { return splat_image_load(kNoImage, std::array{good}.data(), nullptr); });
    add("splat_image_load", "info", "of no file", kNotFound, [good] {
        auto info = sized<splat_image_info>();
        return splat_image_load(kNoImage, std::array{good}.data(), &info);
    });
    add("splat_image_save", "path", "another extension", SPLAT_ERROR_UNSUPPORTED,
        [good] { return splat_image_save("image.gif", &good); });
    add("splat_image_save", "path", "a missing folder", kNotFound,
        [good] { return splat_image_save(kNoImage, &good); });
    add("splat_image_save_animation", "path", "no .png or .gif", SPLAT_ERROR_UNSUPPORTED,
        [good] { return splat_image_save_animation("a.npy", &good, 1, 50); });
    add("splat_image_save_animation", "frames", "of two sizes", kArgument, [good] {
        const splat_image two[] = {good, float_image(1, 1, 3)};
        return splat_image_save_animation(kNoImage, two, 2, 50);
    });
    add("splat_image_save_animation", "count", "0", kArgument,
        [good] { return splat_image_save_animation(kNoImage, &good, 0, 50); });
    for (const std::uint32_t time : {0U, 65536U})
        add("splat_image_save_animation", "milliseconds", "out of range", kArgument,
            [good, time] { return splat_image_save_animation(kNoImage, &good, 1, time); });
    for (const auto& [what, image] : wrong_images()) {
        add("splat_image_save", "image", what, kArgument,
            [image = image] { return splat_image_save(kNoImage, &image); });
        add("splat_image_save_animation", "frames", what, kArgument,
            [image = image] { return splat_image_save_animation(kNoImage, &image, 1, 50); });
    }
}

void MisuseTable::image_score_rows() {
    const splat_image good = float_image(2, 1, 3);
    static float broken[6] = {__builtin_nanf("")};
    splat_image not_finite = good;
    not_finite.pixels = broken;
    const auto compare = [this](const splat_image* a, const splat_image* b) {
        return splat_image_compare(a, b, out<splat_image_scores>());
    };
    auto wrong = wrong_images();
    wrong.emplace_back("not finite", not_finite);
    for (const auto& [what, image] : wrong) {
        add("splat_image_compare", "a", what, kArgument,
            [=, image = image] { return compare(&image, &good); });
        add("splat_image_compare", "b", what, kArgument,
            [=, image = image] { return compare(&good, &image); });
    }
    for (const splat_image other : {float_image(1, 1, 3), float_image(2, 1, 1)})
        add("splat_image_compare", "b", "another size", SPLAT_ERROR_SHAPE_MISMATCH,
            [=] { return compare(&good, &other); });
}

void MisuseTable::image_memory_rows() {
    const splat_image good = float_image(2, 1, 3);
    const auto load = [](const void* data, std::size_t bytes, splat_image image) {
        return splat_image_load_memory(data, bytes, &image, nullptr);
    };
    for (const std::size_t bytes : {std::size_t{0}, sizeof kNoKnownFile})
        add("splat_image_load_memory", "bytes", "no image", kFormat,
            [=] { return load(kNoKnownFile, bytes, good); });
    for (const auto& [what, image] : wrong_images())
        add("splat_image_load_memory", "image", what, kArgument,
            [load, image = image] { return load(kNoKnownFile, sizeof kNoKnownFile, image); });
    splat_image one_place = good;
    one_place.pixel_stride = 4;
    add("splat_image_load_memory", "image", "two samples in one place", kArgument,
        [=] { return load(kNoKnownFile, sizeof kNoKnownFile, one_place); });
    add("splat_image_load_memory", "info", "a struct_size of no version", kArgument, [good] {
        splat_image_info info{};
        return splat_image_load_memory(kNoKnownFile, sizeof kNoKnownFile, std::array{good}.data(),
                                       &info);
    });
    for (const splat_image_format format :
         std::initializer_list<splat_image_format>{-1, 0, SPLAT_IMAGE_GIF, 5})
        add("splat_image_save_memory", "format", "not written", kArgument, [this, good, format] {
            return splat_image_save_memory(&good, format, values_out(), 64, out<std::size_t>());
        });
    for (const splat_image_format format :
         std::initializer_list<splat_image_format>{-1, 0, SPLAT_IMAGE_NPY, 4})
        add("splat_image_save_animation_memory", "format", "not written", kArgument,
            [this, good, format] {
                return splat_image_save_animation_memory(&good, 1, 50, format, values_out(), 64,
                                                         out<std::size_t>());
            });
    const auto animation = [this](const splat_image* frames, std::uint32_t count,
                                  std::uint32_t time) {
        return splat_image_save_animation_memory(frames, count, time, SPLAT_IMAGE_GIF, values_out(),
                                                 64, out<std::size_t>());
    };
    add("splat_image_save_animation_memory", "count", "0", kArgument,
        [=] { return animation(&good, 0, 50); });
    add("splat_image_save_animation_memory", "milliseconds", "0", kArgument,
        [=] { return animation(&good, 1, 0); });
}

void MisuseTable::weights_memory_rows() {
    for (const std::size_t bytes : {std::size_t{0}, sizeof kNoKnownFile})
        add("splat_weights_load_memory", "bytes", "no weights", kFormat, [this, bytes] {
            return splat_weights_load_memory(kNoKnownFile, bytes, out<splat_weights>());
        });
    splat_named_array good{};
    good.name = "a";
    good.values = kMisusePixels;
    good.value_count = 6;
    good.rank = 2;
    good.dims[0] = 2;
    good.dims[1] = 3;
    const auto arrays = [&](const char* what, splat_result expected, auto member, auto value) {
        splat_named_array wrong = good;
        wrong.*member = value;
        add("splat_weights_from_arrays", "arrays", what, expected,
            [this, wrong] { return splat_weights_from_arrays(&wrong, 1, out<splat_weights>()); });
    };
    arrays("no name", kArgument, &splat_named_array::name, static_cast<const char*>(nullptr));
    arrays("no values", kArgument, &splat_named_array::values, static_cast<const float*>(nullptr));
    arrays("a rank", kArgument, &splat_named_array::rank, SPLAT_MAX_RANK + 1U);
    for (const std::uint64_t count : {std::uint64_t{0}, std::uint64_t{5}, UINT64_MAX})
        arrays("another number", SPLAT_ERROR_SHAPE_MISMATCH, &splat_named_array::value_count,
               count);
    good.dims[1] = -3;
    arrays("a negative dimension", kArgument, &splat_named_array::rank, 2U);
    good.dims[1] = 3;
    add("splat_weights_from_arrays", "arrays", "NULL", kArgument,
        [this] { return splat_weights_from_arrays(nullptr, 1, out<splat_weights>()); });
    add("splat_weights_from_arrays", "count", "one name twice", kArgument, [this, good] {
        const splat_named_array two[] = {good, good};
        return splat_weights_from_arrays(two, 2, out<splat_weights>());
    });
    const auto save = [this](splat_weights weights, splat_weights_format format,
                             std::uint32_t flags) {
        return splat_weights_save_memory(weights, format, flags, values_out(), 64,
                                         out<std::size_t>());
    };
    for (const splat_weights_format format : {-1, 0, 4})
        add("splat_weights_save_memory", "format", "none", kArgument,
            [=, this] { return save(weights_, format, 0); });
    const auto data = [this](splat_weights weights, std::uint32_t index) {
        const float* values = kMisusePixels;
        std::uint64_t count = 7;
        const splat_result result = splat_weights_data(weights, index, &values, &count);
        return values == kMisusePixels && count == 7 ? result : SPLAT_ERROR_INTERNAL;
    };
    add("splat_weights_data", "index", "too high", kArgument,
        [=, this] { return data(weights_, 2); });
    add("splat_weights_data", "count", "of no weights", kHandle,
        [] { return splat_weights_data(nullptr, 0, nullptr, nullptr); });
}

void MisuseTable::camera_memory_rows() {
    const auto files = [](const void* cameras, std::size_t bytes) {
        auto made = sized<splat_camera_bytes>();
        made.cameras = cameras;
        made.camera_bytes = bytes;
        return made;
    };
    const auto load = [this](const splat_camera_bytes* from, const splat_camera_file_desc* desc) {
        return splat_camera_load_memory(from, desc, out<splat_camera>(), 1, out<std::uint32_t>());
    };
    const auto report = [this](const splat_camera_bytes* from, const splat_camera_file_desc* desc) {
        return splat_camera_load_memory_report(from, desc, text_out(), 16, out<std::size_t>());
    };
    const splat_camera_bytes bad = files(kNoKnownFile, sizeof kNoKnownFile);
    using Call =
        std::function<splat_result(const splat_camera_bytes*, const splat_camera_file_desc*)>;
    for (const auto& [name, call] :
         {std::pair<const char*, Call>{"splat_camera_load_memory", load},
          std::pair<const char*, Call>{"splat_camera_load_memory_report", report}}) {
        const Call function = call;
        add(name, "files", "no cameras", kArgument,
            [=] { return function(std::array{files(nullptr, 4)}.data(), nullptr); });
        for (const std::size_t bytes : {std::size_t{0}, sizeof kNoKnownFile})
            add(name, "files", "no file of cameras", kFormat,
                [=] { return function(std::array{files(kNoKnownFile, bytes)}.data(), nullptr); });
    }
    for (const char* parameter : {"cameras", "capacity"})
        add("splat_camera_load_memory", parameter, "NULL, of a capacity", kArgument,
            [bad] { return splat_camera_load_memory(&bad, nullptr, nullptr, 1, nullptr); });
    add("splat_camera_load_memory", "count", "of a damaged file", kFormat,
        [=] { return load(&bad, nullptr); });
}

void MisuseTable::camera_save_rows() {
    const splat_camera good = sample_camera(8, 8);
    const auto save = [this](const splat_camera* cameras, const char* const* names,
                             std::uint32_t count) {
        return splat_camera_save_memory(cameras, names, count, values_out(), 64,
                                        out<std::size_t>());
    };
    add("splat_camera_save", "path", "a missing folder", kNotFound,
        [good] { return splat_camera_save("/nonexistent/a.json", &good, nullptr, 1); });
    const char* const no_name = nullptr;
    splat_camera wrong = good;
    wrong.fx = 0;
    add("splat_camera_save", "cameras", "NULL", kArgument,
        [] { return splat_camera_save("a.json", nullptr, nullptr, 1); });
    add("splat_camera_save_memory", "cameras", "NULL", kArgument,
        [=] { return save(nullptr, nullptr, 1); });
    add("splat_camera_save", "count", "0, in no folder", kNotFound,
        [] { return splat_camera_save("/nonexistent/a.json", nullptr, nullptr, 0); });
    add("splat_camera_save_memory", "count", "0, without room", SPLAT_INCOMPLETE,
        [] { return splat_camera_save_memory(nullptr, nullptr, 0, nullptr, 64, nullptr); });
    add("splat_camera_save", "cameras", "invalid", kArgument,
        [wrong] { return splat_camera_save("a.json", &wrong, nullptr, 1); });
    add("splat_camera_save_memory", "cameras", "invalid", kArgument,
        [=] { return save(&wrong, nullptr, 1); });
    add("splat_camera_save", "names", "NULL in it", kArgument,
        [=] { return splat_camera_save("a.json", &good, &no_name, 1); });
    add("splat_camera_save_memory", "names", "NULL in it", kArgument,
        [=] { return save(&good, &no_name, 1); });
}

void MisuseTable::trainer_memory_rows() {
    for (const std::size_t bytes : {std::size_t{0}, sizeof kNoKnownFile})
        add("splat_trainer_resume_memory", "bytes", "no checkpoint", kFormat,
            [this, bytes] { return splat_trainer_resume_memory(trainer_, kNoKnownFile, bytes); });
}

}  // namespace splat::test
