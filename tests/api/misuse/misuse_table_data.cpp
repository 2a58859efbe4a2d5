// The rows of data sets.
#include "api/misuse/misuse_table.h"

namespace splat::test {

void MisuseTable::dataset_rows() {
    const auto invalid = wrong_structs<splat_dataset_desc>("splat_dataset_open");
    invalid("no path", kArgument, [](auto& d) { d.path = nullptr; });
    invalid("a missing path", kNotFound, [](auto& d) { d.path = "/nonexistent"; });
    invalid("an unknown format", kArgument, [](auto& d) { d.format = "x"; });
    invalid("an unknown split", kArgument, [](auto& d) { d.split = "x"; });
    invalid("a missing split", kNotFound, [](auto& d) { d.split = "val"; });
    invalid("a list of another format", kArgument, [](auto& d) { d.objects_file = "x"; });
    invalid("a large resolution", kArgument, [](auto& d) { d.resolution = UINT32_MAX; });
    invalid("maps that are not there", kNotFound, [](auto& d) { d.flags |= SPLAT_DATA_PLANE; });
    invalid("a background above 1", kArgument, [](auto& d) { d.background[0] = 2; });
    SPLAT_WRONG(splat_dataset_check).each("object", "too high", kArgument, 2U);
    static const std::uint32_t high[] = {0, 3};
    static float focals[2];
    auto few = sized<splat_dataset_views>();
    few.focals = focals;
    few.focal_count = 1;
    auto little = sized<splat_dataset_views>(), lacking = little;
    little.planes = lacking.planes = focals;
    little.plane_count = 1;
    const auto read = SPLAT_WRONG(splat_dataset_read);
    read.each("object", "too high", kArgument, 2U, UINT32_MAX)
        .each("out", "an array that is too short", kArgument, few, little)
        .each("out", "maps that are not there", kNotFound, lacking);
    read.given("views", high).each("count", "a view beyond the count", kArgument, 2U);
    read.given("views", nullptr)
        .given("count", 0U)
        .each("out", "NULL with count 0", kArgument, nullptr);

    const auto synthetic = wrong_structs<splat_synthetic_desc>("splat_synthetic_write");
    synthetic("no path", kArgument, [](auto& d) { d.path = nullptr; });
    synthetic("a path that cannot be written", kNotFound, [](auto& d) { d.path = "/proc/x"; });
    synthetic("another category", kArgument, [](auto& d) { d.category = "x"; });
    synthetic("another seed", kArgument, [](auto& d) { d.seed = 1; });
    synthetic("a small resolution", kArgument, [](auto& d) { d.resolution = 7; });
    synthetic("a large resolution", kUnsupported, [](auto& d) { d.resolution = 2049; });
    SPLAT_WRONG(splat_synthetic_write).each("index", "too high", kArgument, 3U, UINT32_MAX);

    const auto co3d = wrong_structs<splat_co3d_desc>("splat_co3d_prepare");
    co3d("no release", kArgument, [](auto& d) { d.raw = nullptr; });
    co3d("no folder to write to", kArgument, [](auto& d) { d.out = nullptr; });
    co3d("no category", kArgument, [](auto& d) { d.category = nullptr; });
    co3d("a path as the category", kArgument, [](auto& d) { d.category = "a/b"; });
    co3d("another split", kArgument, [](auto& d) { d.split = "x"; });
    co3d("a large size", kArgument, [](auto& d) { d.size = 4097; });
    co3d("a missing release", kNotFound, [](auto&) {});
    SPLAT_WRONG(splat_co3d_prepare).each("info", "without its size", kArgument, splat_co3d_info{});

    const auto tokens = wrong_structs<splat_tokens_desc>("splat_tokens_write");
    tokens("no data set", kArgument, [](auto& d) { d.data = nullptr; });
    tokens("no masks", kArgument, [](auto& d) { d.masks = nullptr; });
    tokens("no names", kArgument, [](auto& d) { d.names = nullptr; });
    tokens("no file to write", kArgument, [](auto& d) { d.out = nullptr; });
    tokens("an odd dimension", kArgument, [](auto& d) { d.dimension = 13; });
    tokens("a small dimension", kArgument, [](auto& d) { d.dimension = 10; });
    tokens("a large dimension", kArgument, [](auto& d) { d.dimension = 4098; });
    tokens("many tokens", kArgument, [](auto& d) { d.tokens = 65537; });
    tokens("vectors of a dimension that no embedding has", kArgument, [](auto& d) {
        d.flags = SPLAT_TOKENS_POOLED;
        d.dimension = 32;
    });
    tokens("missing names", kNotFound, [](auto&) {});
    SPLAT_WRONG(splat_tokens_write)
        .each("info", "without its size", kArgument, splat_tokens_info{});
}

void MisuseTable::table_rows() {
    const auto to_read = wrong_structs<splat_dataset_import_desc>("splat_dataset_import");
    to_read("no path", kArgument, [](auto& d) { d.path = nullptr; });
    to_read("a missing path", kNotFound, [](auto&) {});
    to_read("an unknown split", kArgument, [](auto& d) { d.split = "x"; });
    to_read("a shard without shards", kArgument, [](auto& d) { d.shard = 1; });
    to_read("a shard beyond them", kArgument, [](auto& d) { d.shard = d.shards = 4; });
    to_read("too many shards", kArgument, [](auto& d) { d.shards = 65537; });
    const auto to_write = wrong_structs<splat_dataset_export_desc>("splat_dataset_export");
    static const std::uint32_t objects[] = {0, 2};
    to_write("no path", kArgument, [](auto& d) { d.path = nullptr; });
    to_write("a path that cannot be written", kNotFound, [](auto&) {});
    to_write("an unknown layout", kArgument, [](auto& d) { d.layout = "x"; });
    to_write("an unknown split", kArgument, [](auto& d) { d.split = "x"; });
    to_write("a category that is no name", kArgument, [](auto& d) { d.category = "a/b"; });
    to_write("a shard beyond them", kArgument, [](auto& d) { d.shard = d.shards = 4; });
    to_write("shards of folders", kArgument, [](auto& d) { d.shards = 2; });
    to_write("no list of objects", kArgument, [](auto& d) { d.object_count = 1; });
    to_write("an empty list of objects", kArgument, [](auto& d) { d.objects = objects; });
    to_write("an object beyond the count", kArgument,
             [](auto& d) { d.objects = objects, d.object_count = 2; });
    for (const char* parameter : {"callback", "user"}) {
        SPLAT_WRONG(splat_dataset_import).as_is(parameter, "not given", kNotFound);
        SPLAT_WRONG(splat_dataset_export).as_is(parameter, "not given", kNotFound);
    }
}

}  // namespace splat::test
