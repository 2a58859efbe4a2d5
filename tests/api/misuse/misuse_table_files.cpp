// The rows of images, weights and cameras, in files and in memory.
#include <cmath>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr char kNoKnownFile[] = "no file of any kind";

/// A picture that no function takes, by its wrong member.
struct WrongImage {
    const char* what;
    void (*change)(splat_image&);
};

/// Without bytes, which the size would exceed, where the size alone is wrong.
constexpr WrongImage kWrongImages[] = {
    {"a type", [](splat_image& i) { i.type = -1; }},
    {"a type", [](splat_image& i) { i.type = 0; }},
    {"a type", [](splat_image& i) { i.type = 4; }},
    {"a width", [](splat_image& i) { i.width = 0, i.bytes = 0; }},
    {"a width", [](splat_image& i) { i.width = 16385, i.bytes = 0; }},
    {"a height", [](splat_image& i) { i.height = 0, i.bytes = 0; }},
    {"a height", [](splat_image& i) { i.height = 16385, i.bytes = 0; }},
    {"channels", [](splat_image& i) { i.channels = 0, i.bytes = 0; }},
    {"channels", [](splat_image& i) { i.channels = 16385, i.bytes = 0; }},
    {"too few bytes", [](splat_image& i) { i.bytes = std::size_t{12} * i.width * i.height - 1; }},
    {"a stride beyond the bytes", [](splat_image& i) { i.row_stride = std::int64_t{1} << 50; }},
    {"a negative stride with bytes", [](splat_image& i) { i.pixel_stride = -12; }},
};

}  // namespace

void MisuseTable::image_rows() {
    constexpr const char* kNoImage = "/nonexistent/image.png";
    SPLAT_WRONG(splat_image_load)
        .given("path", kNoImage)
        .as_is("path", "no file", kNotFound)
        .each("info", "of no file", kNotFound, sized<splat_image_info>());
    SPLAT_WRONG(splat_image_save)
        .each("path", "another extension", kUnsupported, "image.gif")
        .each("path", "a missing folder", kNotFound, kNoImage);
    const splat_image good = this->good<splat_image>();
    static splat_image two[] = {good, good};
    two[1].width = 1;
    const auto animation = SPLAT_WRONG(splat_image_save_animation);
    animation.each("path", "no .png or .gif", kUnsupported, "a.npy")
        .each("count", "0", kArgument, 0U)
        .each("milliseconds", "out of range", kArgument, 0U, 65536U);
    animation.given("count", 2U).each("frames", "of two sizes", kArgument, two);
    static std::vector<float> broken(std::size_t{3} * 48 * 48, 0.5F);
    broken[0] = NAN;
    splat_image not_finite = good, narrow = good, gray = good, one_place = good;
    not_finite.pixels = broken.data();
    narrow.width = 1;
    gray.channels = 1;
    one_place.pixel_stride = 4;
    SPLAT_WRONG(splat_image_compare)
        .each("a", "not finite", kArgument, not_finite)
        .each("b", "not finite", kArgument, not_finite)
        .each("b", "another size", kShape, narrow, gray);
    const auto load = SPLAT_WRONG(splat_image_load_memory)
                          .given("data", kNoKnownFile)
                          .given("bytes", sizeof kNoKnownFile);
    load.each("image", "two samples in one place", kArgument, one_place)
        .each("bytes", "no image", kFormat, 0, sizeof kNoKnownFile)
        .each("info", "a struct_size of no version", kArgument, splat_image_info{});
    for (const auto& [what, change] : kWrongImages) {
        splat_image image = good;
        change(image);
        SPLAT_WRONG(splat_image_save).each("image", what, kArgument, image);
        animation.each("frames", what, kArgument, image);
        SPLAT_WRONG(splat_image_compare)
            .each("a", what, kArgument, image)
            .each("b", what, kArgument, image);
        load.each("image", what, kArgument, image);
    }
}

void MisuseTable::image_memory_rows() {
    SPLAT_WRONG(splat_image_save_memory)
        .each("format", "not written", kArgument, -1, 0, SPLAT_IMAGE_GIF, 5);
    const auto animation = SPLAT_WRONG(splat_image_save_animation_memory);
    animation.each("format", "not written", kArgument, -1, 0, SPLAT_IMAGE_NPY, 4);
    animation.given("format", SPLAT_IMAGE_GIF)
        .each("count", "0", kArgument, 0U)
        .each("milliseconds", "0", kArgument, 0U);
    const auto bytes = [](const auto& rows, const char* what) {
        rows.given("data", kNoKnownFile).each("bytes", what, kFormat, 0, sizeof kNoKnownFile);
    };
    bytes(SPLAT_WRONG(splat_weights_load_memory), "no weights");
    bytes(SPLAT_WRONG(splat_trainer_resume_memory), "no checkpoint");
    for (const char* function : {"splat_camera_load_memory", "splat_camera_load_memory_report"}) {
        const auto invalid = wrong_structs<splat_camera_bytes>(function, "files");
        invalid("no cameras", kArgument, [](auto& f) { f.cameras = nullptr, f.camera_bytes = 4; });
        invalid("no file of cameras", kFormat, [](auto& f) { f.camera_bytes = 0; });
        invalid("no file of cameras", kFormat, [](auto&) {});
    }
    const auto load = SPLAT_WRONG(splat_camera_load_memory).given("desc", nullptr);
    load.as_is("count", "of a damaged file", kFormat);
    for (const char* parameter : {"cameras", "capacity"})
        load.given("cameras", nullptr)
            .given("count", nullptr)
            .as_is(parameter, "NULL, of a capacity", kArgument);
    static const char* const no_name = nullptr;
    const auto save = [this](const auto& rows) {
        splat_camera wrong = good<splat_camera>();
        wrong.fx = 0;
        rows.each("cameras", "NULL", kArgument, nullptr)
            .each("cameras", "invalid", kArgument, wrong)
            .each("names", "NULL in it", kArgument, &no_name);
    };
    const auto to_file = SPLAT_WRONG(splat_camera_save);
    save(to_file.given("path", "a.json"));
    save(SPLAT_WRONG(splat_camera_save_memory));
    to_file.as_is("path", "a missing folder", kNotFound);
    to_file.given("cameras", nullptr).each("count", "0, in no folder", kNotFound, 0U);
    SPLAT_WRONG(splat_camera_save_memory)
        .given("cameras", nullptr)
        .given("buffer", nullptr)
        .given("needed", nullptr)
        .each("count", "0, without room", SPLAT_INCOMPLETE, 0U);
}

void MisuseTable::weights_rows() {
    constexpr const char* kNoFile = "/nonexistent/weights.npz";
    SPLAT_WRONG(splat_weights_load)
        .given("path", kNoFile)
        .as_is("path", "no file", kNotFound)
        .each("flags", "unknown", kArgument, 1U, 4U, 1U << 31U);
    SPLAT_WRONG(splat_weights_save)
        .each("path", "a missing folder", kNotFound, kNoFile)
        .each("path", "an unknown extension", kUnsupported, "/nonexistent/a.bin")
        .given("path", "/nonexistent/a.npz")
        .each("flags", "of loading", kArgument, SPLAT_WEIGHTS_COPY);
    SPLAT_WRONG(splat_weights_save_memory)
        .each("flags", "of loading", kArgument, SPLAT_WEIGHTS_COPY)
        .each("format", "none", kArgument, -1, 0, 4);
    SPLAT_WRONG(splat_weights_find).each("name", "none", kNotFound, "", "c", "A");
    SPLAT_WRONG(splat_weights_get_info).each("index", "too high", kArgument, 2U, UINT32_MAX);
    SPLAT_WRONG(splat_weights_read)
        .each("index", "too high", kArgument, 2U, UINT32_MAX)
        .each("values", "NULL", kArgument, nullptr)
        .each("bytes", "too few", kArgument, 15);
    SPLAT_WRONG(splat_weights_data)
        .each("index", "too high", kArgument, 2U)
        .given("weights", nullptr)
        .each("count", "of no weights", kHandle, nullptr);
    handles<splat_weights>(
        "splat_weights_fold", "adapters",
        [this](splat_weights w) {
            return splat_weights_fold(weights_, w, 1, 0, out<splat_weights>());
        },
        kArgument);
    SPLAT_WRONG(splat_weights_fold)
        .given("alpha", 1)
        .each("adapters", "none", kArgument, weights_)
        .given("adapters", nullptr)
        .each("alpha", "not finite", kArgument, NAN);
}

void MisuseTable::memory_rows() {
    const auto invalid = wrong_structs<splat_named_array>("splat_weights_from_arrays", "arrays");
    invalid("no name", kArgument, [](auto& a) { a.name = nullptr; });
    invalid("no values", kArgument, [](auto& a) { a.values = nullptr; });
    invalid("a rank", kArgument, [](auto& a) { a.rank = SPLAT_MAX_RANK + 1; });
    for (const std::uint64_t count : {std::uint64_t{0}, std::uint64_t{5}, UINT64_MAX})
        invalid("another number", kShape, [count](auto& a) { a.value_count = count; });
    invalid("a negative dimension", kArgument, [](auto& a) { a.dims[1] = -3; });
    const auto good = this->good<splat_named_array>();
    static const splat_named_array two[] = {good, good};
    SPLAT_WRONG(splat_weights_from_arrays)
        .each("arrays", "NULL", kArgument, nullptr)
        .given("arrays", two)
        .each("count", "one name twice", kArgument, 2);
}

}  // namespace splat::test
