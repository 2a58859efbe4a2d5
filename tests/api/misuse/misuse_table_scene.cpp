// The rows of scenes.
#include <cmath>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr float kSix[6] = {};
constexpr double kLowest[3] = {};
constexpr double kHighest[3] = {1, 1, 1};
constexpr double kNowhere[3] = {0, NAN, 0};

}  // namespace

void MisuseTable::scene_rows() {
    const auto invalid = wrong_structs<splat_scene_desc>("splat_scene_create");
    invalid("a degree too high", kArgument, [](auto& d) { d.sh_degree = 4; });
    invalid("drawn as nothing known", kArgument, [](auto& d) { d.drawn_as = 1; });
    invalid("an array that is too short", kArgument, [](auto& d) {
        d.count = 2;
        d.means = kSix;
        d.mean_count = 5;
    });
    invalid("too many", kUnsupported, [](auto& d) { d.count = UINT64_MAX; });
    SPLAT_WRONG(splat_scene_transform)
        .each("similarity", "all zeros", kArgument, splat_similarity{});
    SPLAT_WRONG(splat_scene_crop)
        .given("high", kLowest)
        .each("low", "above high", kArgument, kHighest);
    SPLAT_WRONG(splat_scene_crop_sphere)
        .given("center", kLowest)
        .each("radius", "out of range", kArgument, -1.0, NAN)
        .given("radius", 1.0)
        .each("center", "not finite", kArgument, kNowhere);
    SPLAT_WRONG(splat_scene_set_sh_degree).each("sh_degree", "too high", kArgument, 4U, UINT32_MAX);
    SPLAT_WRONG(splat_scene_filter).each("min_opacity", "out of range", kArgument, -0.1, 1.1, NAN);
    handles<splat_scene>(
        "splat_scene_merge", "scenes",
        [this](splat_scene s) { return splat_scene_merge(&s, 1, out<splat_scene>()); }, kHandle);
    SPLAT_WRONG(splat_scene_merge).each("scenes", "no array", kArgument, nullptr);
    add("splat_scene_merge", "count", "0: an empty scene", SPLAT_OK, [one = scene_.get()] {
        Scene empty;
        return splat_scene_merge(&one, 0, empty.out());
    });
    add("splat_scene_get_size", "count", "NULL: not asked", SPLAT_OK, [one = scene_.get()] {
        std::uint32_t degree = 0;
        return splat_scene_get_size(one, nullptr, &degree);
    });
    add("splat_scene_get_size", "sh_degree", "NULL: not asked", SPLAT_OK, [one = scene_.get()] {
        std::uint64_t count = 0;
        return splat_scene_get_size(one, &count, nullptr);
    });
    const auto names = [](const auto& rows) {
        rows.each("name", "NULL", kArgument, nullptr)
            .each("name", "an unknown name", kArgument, "", "Means", "colour");
    };
    const auto values = [names](const auto& rows, std::size_t few) {
        names(rows);
        const auto means = rows.given("name", "means");
        means.each("values", "NULL", kArgument, nullptr).each("bytes", "too few", kArgument, few);
    };
    values(SPLAT_WRONG(splat_scene_read), 35);
    values(SPLAT_WRONG(splat_scene_write), sizeof kSix);
    names(SPLAT_WRONG(splat_scene_to_tensor));
}

void MisuseTable::scene_file_rows() {
    constexpr const char* kNoFile = "/nonexistent/scene.ply";
    for (const char* function : {"splat_scene_load", "splat_scene_load_memory", "splat_scene_save",
                                 "splat_scene_save_memory", "splat_scene_peek"}) {
        const auto invalid = wrong_structs<splat_scene_file_desc>(function);
        for (auto splat_scene_file_desc::*field :
             {&splat_scene_file_desc::format, &splat_scene_file_desc::frame,
              &splat_scene_file_desc::sh_degree})
            for (const std::int32_t value : {INT32_MIN, -2, 9, INT32_MAX})
                invalid("a field out of range", kArgument, [=](auto& d) { d.*field = value; });
    }
    SPLAT_WRONG(splat_scene_load)
        .given("desc", nullptr)
        .each("path", "no file", kNotFound, kNoFile);
    SPLAT_WRONG(splat_scene_peek)
        .given("desc", nullptr)
        .each("path", "no file", kNotFound, kNoFile);
    SPLAT_WRONG(splat_scene_load_memory)
        .given("data", kSix)
        .given("desc", nullptr)
        .each("bytes", "an invalid file", kFormat, 0, sizeof kSix);
    SPLAT_WRONG(splat_scene_save)
        .given("desc", nullptr)
        .each("path", "a missing folder", kNotFound, kNoFile);
    for (const char* parameter : {"buffer", "capacity", "needed"})
        SPLAT_WRONG(splat_scene_save_memory)
            .given("needed", nullptr)
            .as_is(parameter, "without room", SPLAT_INCOMPLETE);
}

}  // namespace splat::test
