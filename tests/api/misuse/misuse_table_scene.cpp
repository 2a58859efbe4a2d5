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
        return splat_scene_create(desc, outputs.scene.out());
    };
    const splat_scene_desc good = sized<splat_scene_desc>();
    add("splat_scene_create", "desc", "NULL", kArgument, [create] { return create(nullptr); });
    descs<splat_scene_desc>("splat_scene_create", good, create);
    add("splat_scene_create", "scene", "NULL", kArgument,
        [good] { return splat_scene_create(&good, nullptr); });
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
    handles<splat_scene>(
        "splat_scene_load_report", "scene",
        [this](splat_scene s) {
            return splat_scene_load_report(s, *outputs.text.out(), 16, outputs.size.out());
        },
        kHandle);
    add("splat_scene_formats", "buffer", "NULL with a capacity", SPLAT_INCOMPLETE,
        [] { return splat_scene_formats(nullptr, SIZE_MAX, nullptr); });
    add("splat_scene_formats", "capacity", "0", SPLAT_INCOMPLETE,
        [this] { return splat_scene_formats(*outputs.text.out(), 0, nullptr); });
    add("splat_scene_formats", "needed", "NULL", SPLAT_INCOMPLETE,
        [] { return splat_scene_formats(nullptr, 0, nullptr); });
    add("splat_scene_load_report", "buffer", "NULL with a capacity", SPLAT_INCOMPLETE,
        [this] { return splat_scene_load_report(scene_, nullptr, SIZE_MAX, nullptr); });
    add("splat_scene_load_report", "capacity", "0", SPLAT_INCOMPLETE,
        [this] { return splat_scene_load_report(scene_, *outputs.text.out(), 0, nullptr); });
    add("splat_scene_load_report", "needed", "NULL", SPLAT_INCOMPLETE,
        [this] { return splat_scene_load_report(scene_, nullptr, 0, nullptr); });
    handles<splat_scene>(
        "splat_scene_get_info", "scene",
        [this](splat_scene s) { return splat_scene_get_info(s, outputs.scene_info.out()); },
        kHandle);
    infos<splat_scene_info>("splat_scene_get_info", "info", [this](splat_scene_info* info) {
        return splat_scene_get_info(scene_, info);
    });
    handles<splat_scene>("splat_scene_destroy", "scene", splat_scene_destroy, SPLAT_OK);
}

void MisuseTable::scene_file_rows() {
    const auto good = sized<splat_scene_file_desc>();
    const auto load = [this](const splat_scene_file_desc* desc) {
        return splat_scene_load(kNoSceneFile, desc, outputs.scene.out());
    };
    const auto load_memory = [this](const splat_scene_file_desc* desc) {
        return splat_scene_load_memory(kSix, sizeof kSix, desc, outputs.scene.out());
    };
    const auto save = [this](const splat_scene_file_desc* desc) {
        return splat_scene_save(scene_, kNoSceneFile, desc);
    };
    const auto save_memory = [this](const splat_scene_file_desc* desc) {
        return splat_scene_save_memory(scene_, desc, *outputs.values.out(), 64, outputs.size.out());
    };
    using Call = std::function<splat_result(const splat_scene_file_desc*)>;
    for (const auto& [name, call] :
         {std::pair<const char*, Call>{"splat_scene_load", load},
          std::pair<const char*, Call>{"splat_scene_load_memory", load_memory},
          std::pair<const char*, Call>{"splat_scene_save", save},
          std::pair<const char*, Call>{"splat_scene_save_memory", save_memory}}) {
        const Call function = call;
        descs<splat_scene_file_desc>(name, good, function);
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
    add("splat_scene_load", "path", "NULL", kArgument,
        [this] { return splat_scene_load(nullptr, nullptr, outputs.scene.out()); });
    add("splat_scene_load", "path", "no file", kNotFound, [load] { return load(nullptr); });
    add("splat_scene_load", "scene", "NULL", kArgument,
        [] { return splat_scene_load(kNoSceneFile, nullptr, nullptr); });
    add("splat_scene_load_memory", "data", "NULL", kArgument,
        [this] { return splat_scene_load_memory(nullptr, 4, nullptr, outputs.scene.out()); });
    for (const std::size_t bytes : {std::size_t{0}, sizeof kSix})
        add("splat_scene_load_memory", "bytes", "an invalid file", kFormat, [this, bytes] {
            return splat_scene_load_memory(kSix, bytes, nullptr, outputs.scene.out());
        });
    add("splat_scene_load_memory", "scene", "NULL", kArgument,
        [] { return splat_scene_load_memory(kSix, sizeof kSix, nullptr, nullptr); });
    handles<splat_scene>(
        "splat_scene_save", "scene",
        [](splat_scene s) { return splat_scene_save(s, kNoSceneFile, nullptr); }, kHandle);
    add("splat_scene_save", "path", "NULL", kArgument,
        [this] { return splat_scene_save(scene_, nullptr, nullptr); });
    add("splat_scene_save", "path", "a missing folder", kNotFound,
        [save] { return save(nullptr); });
    handles<splat_scene>(
        "splat_scene_save_memory", "scene",
        [](splat_scene s) { return splat_scene_save_memory(s, nullptr, nullptr, 0, nullptr); },
        kHandle);
    for (const char* parameter : {"buffer", "capacity", "needed"}) {
        splat_scene_file_desc desc = good;
        desc.format = SPLAT_SCENE_PLY;
        add("splat_scene_save_memory", parameter, "without room", SPLAT_INCOMPLETE, [this, desc] {
            return splat_scene_save_memory(scene_, &desc, *outputs.values.out(), 64, nullptr);
        });
    }
}

void MisuseTable::scene_change_rows() {
    const auto on_scenes = [this](const char* name, std::function<splat_result(splat_scene)> call) {
        handles<splat_scene>(name, "scene", std::move(call), kHandle);
    };
    const splat_similarity same = {{1, 0, 0, 0}, {0, 0, 0}, 1};
    on_scenes("splat_scene_transform",
              [same](splat_scene s) { return splat_scene_transform(s, &same); });
    add("splat_scene_transform", "similarity", "NULL", kArgument,
        [this] { return splat_scene_transform(scene_, nullptr); });
    add("splat_scene_transform", "similarity", "all zeros", kArgument, [this] {
        const splat_similarity zero = {};
        return splat_scene_transform(scene_, &zero);
    });
    static constexpr double kLow[3] = {0, 0, 0};
    static constexpr double kHigh[3] = {1, 1, 1};
    on_scenes("splat_scene_crop", [](splat_scene s) { return splat_scene_crop(s, kLow, kHigh); });
    add("splat_scene_crop", "low", "NULL", kArgument,
        [this] { return splat_scene_crop(scene_, nullptr, kHigh); });
    add("splat_scene_crop", "high", "NULL", kArgument,
        [this] { return splat_scene_crop(scene_, kLow, nullptr); });
    add("splat_scene_crop", "low", "above high", kArgument,
        [this] { return splat_scene_crop(scene_, kHigh, kLow); });
    on_scenes("splat_scene_filter", [](splat_scene s) { return splat_scene_filter(s, 0, 0.5); });
    add("splat_scene_filter", "flags", "unknown", kArgument,
        [this] { return splat_scene_filter(scene_, 4, 0.5); });
    for (const double least : {-0.1, 1.1, static_cast<double>(NAN)})
        add("splat_scene_filter", "min_opacity", "out of range", kArgument,
            [this, least] { return splat_scene_filter(scene_, 0, least); });
    handles<splat_scene>(
        "splat_scene_merge", "scenes",
        [this](splat_scene s) { return splat_scene_merge(&s, 1, outputs.scene.out()); }, kHandle);
    add("splat_scene_merge", "scenes", "no array", kArgument,
        [this] { return splat_scene_merge(nullptr, 1, outputs.scene.out()); });
    const splat_scene one = scene_;
    add("splat_scene_merge", "count", "0: an empty scene", SPLAT_OK, [one] {
        Scene empty;
        return splat_scene_merge(&one, 0, empty.out());
    });
    add("splat_scene_merge", "scene", "NULL", kArgument,
        [one] { return splat_scene_merge(&one, 1, nullptr); });
    on_scenes("splat_scene_read", [this](splat_scene s) {
        return splat_scene_read(s, "means", *outputs.values.out(), 64);
    });
    on_scenes("splat_scene_write",
              [](splat_scene s) { return splat_scene_write(s, "means", kSix, sizeof kSix); });
    on_scenes("splat_scene_to_tensor", [this](splat_scene s) {
        return splat_scene_to_tensor(s, "means", device_, outputs.tensor.out());
    });
    for (const char* name : {static_cast<const char*>(nullptr), "", "Means", "colour"}) {
        const char* what = name == nullptr ? "NULL" : "an unknown name";
        add("splat_scene_read", "name", what, kArgument,
            [this, name] { return splat_scene_read(scene_, name, *outputs.values.out(), 64); });
        add("splat_scene_write", "name", what, kArgument,
            [this, name] { return splat_scene_write(scene_, name, kSix, sizeof kSix); });
        add("splat_scene_to_tensor", "name", what, kArgument, [this, name] {
            return splat_scene_to_tensor(scene_, name, device_, outputs.tensor.out());
        });
    }
    add("splat_scene_read", "values", "NULL", kArgument,
        [this] { return splat_scene_read(scene_, "means", nullptr, 64); });
    add("splat_scene_read", "bytes", "too few", kArgument,
        [this] { return splat_scene_read(scene_, "means", *outputs.values.out(), 35); });
    add("splat_scene_write", "values", "NULL", kArgument,
        [this] { return splat_scene_write(scene_, "means", nullptr, 64); });
    add("splat_scene_write", "bytes", "too few", kArgument,
        [this] { return splat_scene_write(scene_, "means", kSix, sizeof kSix); });
    handles<splat_device>(
        "splat_scene_to_tensor", "device",
        [this](splat_device d) {
            return splat_scene_to_tensor(scene_, "means", d, outputs.tensor.out());
        },
        kHandle);
    add("splat_scene_to_tensor", "tensor", "NULL", kArgument,
        [this] { return splat_scene_to_tensor(scene_, "means", device_, nullptr); });
}

}  // namespace splat::test
