#include <algorithm>

#include "api/api_guard.h"
#include "api/handles.h"
#include "core/float_mode.h"
#include "data/dataset_export.h"
#include "data/formats.h"
#include "tables/import.h"

using namespace splat;

namespace {

tables::Progress progress_of(splat_progress_callback callback, void* user,
                             const CallersFloatMode& mode) {
    if (callback == nullptr) return nullptr;
    return [=](std::uint64_t done, std::uint64_t total) -> Status {
        if (mode.call([&] { return callback(user, done, total); }) == 0) return {};
        return error(Code::kCancelled, "the callback ended the call after %llu of %llu rows",
                     llu(done), llu(total));
    };
}

std::string text_or(const char* text, const char* fallback) {
    return text != nullptr ? text : fallback;
}

Result<tables::Part> part_of(std::uint32_t shard, std::uint32_t shards) {
    constexpr std::uint32_t kMost = 65536;
    const tables::Part part{shard, std::max(shards, 1U)};
    if (part.count <= kMost && part.index < part.count) return part;
    return invalid(
        "desc.shard is %u and desc.shards %u, expected at most %u shards and one below them", shard,
        shards, kMost);
}

Result<data::Layout> layout_of(const std::string& name) {
    if (name == "tables") return data::Layout::kTables;
    if (name == "srn") return data::Layout::kSrn;
    if (name == "images") return data::Layout::kImages;
    if (name == "store") return data::Layout::kStore;
    return invalid("layout is '%s', expected tables, srn, images or store", name.c_str());
}

}  // namespace

splat_result splat_dataset_import(const splat_dataset_import_desc* desc,
                                  splat_progress_callback callback, void* user) {
    const CallersFloatMode mode;
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::check_desc(desc, SPLAT_IMPORT_REPLACE));
        SPLAT_TRY(api::require(desc->path, "desc.path"));
        tables::ImportDesc value;
        value.path = desc->path;
        value.split = text_or(desc->split, "train");
        if (value.split != "train" && value.split != "val" && value.split != "test")
            return invalid("split is '%s', expected train, val or test", value.split.c_str());
        value.store = desc->out == nullptr ? data::store_beside(value.path, value.split)
                                           : desc->out + ("/" + value.split);
        value.library = text_or(desc->duckdb, "");
        SPLAT_ASSIGN(value.part, part_of(desc->shard, desc->shards));
        value.replace = desc->out == nullptr || (desc->flags & SPLAT_IMPORT_REPLACE) != 0;
        return tables::import_tables(value, progress_of(callback, user, mode));
    });
}

splat_result splat_dataset_export(splat_dataset dataset, const splat_dataset_export_desc* desc,
                                  splat_progress_callback callback, void* user) {
    const CallersFloatMode mode;
    return api::with(dataset, [&](const auto& found) -> Status {
        SPLAT_TRY(api::check_desc(desc, 0));
        SPLAT_TRY(api::require(desc->path, "desc.path"));
        if (desc->object_count > 0) SPLAT_TRY(api::require(desc->objects, "desc.objects"));
        if (desc->objects != nullptr && desc->object_count == 0)
            return invalid("desc.objects lists no object; NULL exports all of them");
        data::ExportDesc value;
        value.path = desc->path;
        SPLAT_ASSIGN(value.layout, layout_of(text_or(desc->layout, "tables")));
        value.split = text_or(desc->split, "");
        value.category = text_or(desc->category, "cars");
        value.library = text_or(desc->duckdb, "");
        SPLAT_ASSIGN(value.part, part_of(desc->shard, desc->shards));
        if (desc->objects != nullptr)
            value.objects.assign(desc->objects, desc->objects + desc->object_count);
        return data::export_dataset(*found->dataset, value, progress_of(callback, user, mode));
    });
}
