// The rows of data sets.
#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr std::uint32_t kView = 0;

splat_result read_one(splat_dataset dataset, std::uint32_t object, const std::uint32_t* views,
                      std::uint32_t count) {
    auto out = sized<splat_dataset_views>();
    return splat_dataset_read(dataset, object, views, count, &out);
}

}  // namespace

void MisuseTable::dataset_rows() {
    synthetic_rows();
    co3d_rows();
    table_rows();
    const auto invalid = wrong_descs<splat_dataset_desc>("splat_dataset_open");
    invalid("no path", [](splat_dataset_desc& d) { d.path = nullptr; });
    invalid(
        "a missing path", [](splat_dataset_desc& d) { d.path = "/nonexistent"; }, kNotFound);
    invalid("an unknown format", [](splat_dataset_desc& d) { d.format = "x"; });
    invalid("an unknown split", [](splat_dataset_desc& d) { d.split = "x"; });
    invalid(
        "a missing split", [](splat_dataset_desc& d) { d.split = "val"; }, kNotFound);
    invalid("a list of another format", [](splat_dataset_desc& d) { d.objects_file = "x"; });
    invalid("a large resolution", [](splat_dataset_desc& d) { d.resolution = UINT32_MAX; });
    invalid("a background above 1", [](splat_dataset_desc& d) { d.background[0] = 2; });
    add("splat_dataset_check", "object", "too high", kArgument,
        [this] { return splat_dataset_check(dataset_, 2, text_out(), 16, out<std::size_t>()); });
    for (const std::uint32_t object : {2U, UINT32_MAX})
        add("splat_dataset_read", "object", "too high", kArgument,
            [this, object] { return read_one(dataset_, object, &kView, 1); });
    static const std::uint32_t high[] = {0, 3};
    add("splat_dataset_read", "count", "a view beyond the count", kArgument,
        [this] { return read_one(dataset_, 0, high, 2); });
    add("splat_dataset_read", "out", "NULL with count 0", kArgument,
        [this] { return splat_dataset_read(dataset_, 0, nullptr, 0, nullptr); });
    add("splat_dataset_read", "out", "an array that is too short", kArgument, [this] {
        auto out = sized<splat_dataset_views>();
        float focals[2] = {};
        out.focals = focals;
        out.focal_count = 1;
        return splat_dataset_read(dataset_, 0, &kView, 1, &out);
    });
}

void MisuseTable::table_rows() {
    const auto import = [](const splat_dataset_import_desc* desc) {
        return splat_dataset_import(desc, nullptr, nullptr);
    };
    auto good = sized<splat_dataset_import_desc>();
    good.path = "/nonexistent";
    const auto bad_import = wrong_descs<splat_dataset_import_desc>("splat_dataset_import");
    bad_import("no path", kArgument, [](auto& d) { d.path = nullptr; });
    bad_import("a missing path", kNotFound, [](auto&) {});
    bad_import("an unknown split", kArgument, [](auto& d) { d.split = "x"; });
    bad_import("a shard without shards", kArgument, [](auto& d) { d.shard = 1; });
    bad_import("a shard beyond them", kArgument, [](auto& d) { d.shard = d.shards = 4; });
    bad_import("too many shards", kArgument, [](auto& d) { d.shards = 65537; });
    for (const char* parameter : {"callback", "user"})
        add("splat_dataset_import", parameter, "not given", kNotFound,
            [import, good] { return import(&good); });

    const auto write = [this](const splat_dataset_export_desc* desc) {
        return splat_dataset_export(dataset_, desc, nullptr, nullptr);
    };
    auto out = sized<splat_dataset_export_desc>();
    out.path = "/proc/x";
    out.layout = "srn";
    const auto bad_export = wrong_descs<splat_dataset_export_desc>("splat_dataset_export");
    static const std::uint32_t objects[] = {0, 2};
    bad_export("no path", kArgument, [](auto& d) { d.path = nullptr; });
    bad_export("a path that cannot be written", kNotFound, [](auto&) {});
    bad_export("an unknown layout", kArgument, [](auto& d) { d.layout = "x"; });
    bad_export("an unknown split", kArgument, [](auto& d) { d.split = "x"; });
    bad_export("a category that is no name", kArgument, [](auto& d) { d.category = "a/b"; });
    bad_export("a shard beyond them", kArgument, [](auto& d) { d.shard = d.shards = 4; });
    bad_export("shards of folders", kArgument, [](auto& d) { d.shards = 2; });
    bad_export("no list of objects", kArgument, [](auto& d) { d.object_count = 1; });
    bad_export("an empty list of objects", kArgument, [](auto& d) { d.objects = objects; });
    bad_export("an object beyond the count", kArgument, [](auto& d) {
        d.objects = objects;
        d.object_count = 2;
    });
    for (const char* parameter : {"callback", "user"})
        add("splat_dataset_export", parameter, "not given", kNotFound,
            [write, out] { return write(&out); });
}

void MisuseTable::synthetic_rows() {
    const auto invalid = wrong_descs<splat_synthetic_desc>("splat_synthetic_write");
    invalid("no path", kArgument, [](splat_synthetic_desc& d) { d.path = nullptr; });
    invalid("a path that cannot be written", kNotFound,
            [](splat_synthetic_desc& d) { d.path = "/proc/x"; });
    invalid("another category", kArgument, [](splat_synthetic_desc& d) { d.category = "x"; });
    invalid("another seed", kArgument, [](splat_synthetic_desc& d) { d.seed = 1; });
    invalid("a small resolution", kArgument, [](splat_synthetic_desc& d) { d.resolution = 7; });
    invalid("a large resolution", SPLAT_ERROR_UNSUPPORTED,
            [](splat_synthetic_desc& d) { d.resolution = 2049; });
    for (const std::uint32_t index : {3U, UINT32_MAX})
        add("splat_synthetic_write", "index", "too high", kArgument, [index] {
            const splat_synthetic_desc desc = synthetic_desc(data_folder());
            return splat_synthetic_write(&desc, index);
        });
}

void MisuseTable::co3d_rows() {
    auto good = sized<splat_co3d_desc>();
    good.raw = "/nonexistent";
    good.out = data_folder();
    good.category = "hydrant";
    const auto invalid = wrong_descs<splat_co3d_desc>("splat_co3d_prepare");
    invalid("no release", kArgument, [](splat_co3d_desc& d) { d.raw = nullptr; });
    invalid("no folder to write to", kArgument, [](splat_co3d_desc& d) { d.out = nullptr; });
    invalid("no category", kArgument, [](splat_co3d_desc& d) { d.category = nullptr; });
    invalid("a path as the category", kArgument, [](splat_co3d_desc& d) { d.category = "a/b"; });
    invalid("another split", kArgument, [](splat_co3d_desc& d) { d.split = "x"; });
    invalid("a large size", kArgument, [](splat_co3d_desc& d) { d.size = 4097; });
    invalid("a missing release", kNotFound, [](splat_co3d_desc&) {});
    add("splat_co3d_prepare", "info", "without its size", kArgument, [good] {
        splat_co3d_info info = {};
        return splat_co3d_prepare(&good, &info);
    });
}

}  // namespace splat::test
