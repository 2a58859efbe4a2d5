// The rows of scenes.
#include <array>
#include <cmath>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr const char* kNoSceneFile = "/nonexistent/scene.ply";
constexpr float kSix[6] = {};

}  // namespace

void MisuseTable::scene_rows() {
    const auto create = [this](const splat_scene_desc* desc) {
        return splat_scene_create(desc, out<splat_scene>());
    };
    const splat_scene_desc good = sized<splat_scene_desc>();
    splat_scene_desc desc = good;
    desc.sh_degree = 4;
    add("splat_scene_create", "desc", "a degree too high", kArgument,
        [create, desc] { return create(&desc); });
    desc = good;
    desc.count = 2;
    desc.means = kSix;
    desc.mean_count = 5;
    add("splat_scene_create", "desc", "an array that is too short", kArgument,
        [create, desc] { return create(&desc); });
    desc = good;
    desc.count = UINT64_MAX;
    add("splat_scene_create", "desc", "too many", SPLAT_ERROR_UNSUPPORTED,
        [create, desc] { return create(&desc); });
}

void MisuseTable::scene_file_rows() {
    const auto good = sized<splat_scene_file_desc>();
    const auto load = [this](const splat_scene_file_desc* desc) {
        return splat_scene_load(kNoSceneFile, desc, out<splat_scene>());
    };
    const auto load_memory = [this](const splat_scene_file_desc* desc) {
        return splat_scene_load_memory(kSix, sizeof kSix, desc, out<splat_scene>());
    };
    const auto save = [this](const splat_scene_file_desc* desc) {
        return splat_scene_save(scene_, kNoSceneFile, desc);
    };
    const auto save_memory = [this](const splat_scene_file_desc* desc) {
        return splat_scene_save_memory(scene_, desc, values_out(), 64, out<std::size_t>());
    };
    using Call = std::function<splat_result(const splat_scene_file_desc*)>;
    for (const auto& [name, call] :
         {std::pair<const char*, Call>{"splat_scene_load", load},
          std::pair<const char*, Call>{"splat_scene_load_memory", load_memory},
          std::pair<const char*, Call>{"splat_scene_save", save},
          std::pair<const char*, Call>{"splat_scene_save_memory", save_memory}}) {
        const Call function = call;
        for (std::int32_t splat_scene_file_desc::*field :
             {&splat_scene_file_desc::format, &splat_scene_file_desc::frame,
              &splat_scene_file_desc::sh_degree})
            for (const std::int32_t value : {INT32_MIN, -2, 9, INT32_MAX}) {
                splat_scene_file_desc desc = good;
                desc.*field = value;
                add(name, "desc", "a field out of range", kArgument,
                    [function, desc] { return function(&desc); });
            }
    }
    add("splat_scene_load", "path", "no file", kNotFound, [load] { return load(nullptr); });
    for (const std::size_t bytes : {std::size_t{0}, sizeof kSix})
        add("splat_scene_load_memory", "bytes", "an invalid file", kFormat, [this, bytes] {
            return splat_scene_load_memory(kSix, bytes, nullptr, out<splat_scene>());
        });
    add("splat_scene_save", "path", "a missing folder", kNotFound,
        [save] { return save(nullptr); });
    for (const char* parameter : {"buffer", "capacity", "needed"}) {
        splat_scene_file_desc desc = good;
        desc.format = SPLAT_SCENE_PLY;
        add("splat_scene_save_memory", parameter, "without room", SPLAT_INCOMPLETE, [this, desc] {
            return splat_scene_save_memory(scene_, &desc, values_out(), 64, nullptr);
        });
    }
}

void MisuseTable::scene_change_rows() {
    add("splat_scene_transform", "similarity", "all zeros", kArgument, [this] {
        const splat_similarity zero = {};
        return splat_scene_transform(scene_, &zero);
    });
    static constexpr double kLow[3] = {0, 0, 0};
    static constexpr double kHigh[3] = {1, 1, 1};
    add("splat_scene_crop", "low", "above high", kArgument,
        [this] { return splat_scene_crop(scene_, kHigh, kLow); });
    for (const double least : {-0.1, 1.1, static_cast<double>(NAN)})
        add("splat_scene_filter", "min_opacity", "out of range", kArgument,
            [this, least] { return splat_scene_filter(scene_, 0, least); });
    handles<splat_scene>(
        "splat_scene_merge", "scenes",
        [this](splat_scene s) { return splat_scene_merge(&s, 1, out<splat_scene>()); }, kHandle);
    add("splat_scene_merge", "scenes", "no array", kArgument,
        [this] { return splat_scene_merge(nullptr, 1, out<splat_scene>()); });
    const splat_scene one = scene_;
    add("splat_scene_merge", "count", "0: an empty scene", SPLAT_OK, [one] {
        Scene empty;
        return splat_scene_merge(&one, 0, empty.out());
    });
    for (const char* name : {static_cast<const char*>(nullptr), "", "Means", "colour"}) {
        const char* what = name == nullptr ? "NULL" : "an unknown name";
        add("splat_scene_read", "name", what, kArgument,
            [this, name] { return splat_scene_read(scene_, name, values_out(), 64); });
        add("splat_scene_write", "name", what, kArgument,
            [this, name] { return splat_scene_write(scene_, name, kSix, sizeof kSix); });
        add("splat_scene_to_tensor", "name", what, kArgument, [this, name] {
            return splat_scene_to_tensor(scene_, name, device_, out<splat_tensor>());
        });
    }
    add("splat_scene_read", "values", "NULL", kArgument,
        [this] { return splat_scene_read(scene_, "means", nullptr, 64); });
    add("splat_scene_read", "bytes", "too few", kArgument,
        [this] { return splat_scene_read(scene_, "means", values_out(), 35); });
    add("splat_scene_write", "values", "NULL", kArgument,
        [this] { return splat_scene_write(scene_, "means", nullptr, 64); });
    add("splat_scene_write", "bytes", "too few", kArgument,
        [this] { return splat_scene_write(scene_, "means", kSix, sizeof kSix); });
}

}  // namespace splat::test
