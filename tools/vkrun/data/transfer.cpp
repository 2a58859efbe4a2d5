#include "vkrun/data/transfer.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>

#include "vkrun/cli/options.h"
#include "vkrun/cli/progress.h"
#include "vkrun/cli/shard.h"
#include "vkrun/cli/stopwatch.h"

namespace vkrun {
namespace {

/// A bar that is made when its length is known.
struct Bar {
    std::string what;
    std::unique_ptr<Progress> progress;
};

std::int32_t show_bar(void* user, std::uint64_t done, std::uint64_t total) {
    auto& bar = *static_cast<Bar*>(user);
    if (bar.progress == nullptr) bar.progress = std::make_unique<Progress>(bar.what, total);
    bar.progress->show(std::min(done, total));
    return 0;
}

const char* text_or_null(const std::string& text) {
    return text.empty() ? nullptr : text.c_str();
}

}  // namespace

void add_transfer_options(CLI::App& command, TransferOptions& options) {
    command.add_option("DIR", options.source, "Folder of the data set")->required()->type_name("");
    command.add_option("OUT", options.out, "Folder to write to")->required()->type_name("");
    command
        .add_option("--duckdb", options.duckdb,
                    "DuckDB's library; default: SPLAT_DUCKDB_LIBRARY, or found")
        ->type_name("FILE");
    add_json_flag(command, options.json);
}

void add_split_option(CLI::App& command, TransferOptions& options) {
    command.add_option("--split", options.split, "train, val, test or all")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"train", "val", "test", "all"}));
}

void add_export_options(CLI::App& command, TransferOptions& options) {
    command.add_option("--to", options.layout, "What to write: tables, srn, images or store")
        ->type_name("LAYOUT")
        ->capture_default_str()
        ->check(one_of({"tables", "srn", "images", "store"}));
    command.add_option("--class", options.category, "Name of the category in names of folders")
        ->type_name("NAME")
        ->capture_default_str();
    add_source_options(command, options);
}

void check_effect(const CLI::App& command, const TransferOptions& options) {
    const auto refuse = [&](const char* name, const char* layouts) {
        if (command.count(name) != 0)
            throw Failure(kUsageError, std::string(name) + " has no effect with --to " +
                                           options.layout + "; it goes with " + layouts);
    };
    if (options.layout != "srn" && options.layout != "tables") refuse("--class", "srn and tables");
    if (options.layout != "tables") refuse("--duckdb", "tables");
}

void add_source_options(CLI::App& command, TransferOptions& options) {
    command.add_option("--format", options.format, "Format of the data set; default: detected")
        ->type_name("NAME");
    add_count_option(command, "--size", options.size, "Side of the images, pixels; 0: as stored", 0,
                     4096);
    command.add_flag("--black", options.black,
                     "Show black behind transparent pixels instead of white");
    add_allow_missing_flag(command, options.allow_missing);
}

void with_progress(const std::string& what,
                   const std::function<splat_result(splat_progress_callback, void*)>& call) {
    Bar bar{what, nullptr};
    check(call(show_bar, &bar), kBadData);
}

Dataset open_source(const TransferOptions& options, const std::string& split,
                    std::string* missing) {
    auto desc = sized<splat_dataset_desc>();
    desc.path = options.source.c_str();
    desc.format = text_or_null(options.format);
    desc.split = split.c_str();
    desc.resolution = options.size;
    desc.cache_bytes = 1;
    if (options.allow_missing) desc.flags = SPLAT_DATA_ALLOW_MISSING;
    for (float& value : desc.background) value = options.black ? 0.0F : 1.0F;
    Dataset dataset;
    const splat_result result = splat_dataset_open(&desc, dataset.out());
    if (result == SPLAT_ERROR_NOT_FOUND && missing != nullptr)
        *missing = library_message();
    else
        check(result, kBadData);
    // With all splits, the objects of a folder without any are one.
    if (result == SPLAT_OK && missing != nullptr && options.split == "all" && split != "train" &&
        !library_json(splat_dataset_report, dataset.get()).at("has_splits").get<bool>())
        *missing = "'" + options.source + "' has no splits: its objects are those of train";
    return dataset;
}

Json write_split(const TransferOptions& options, splat_dataset dataset, const std::string& split,
                 const std::vector<std::uint32_t>& objects) {
    auto desc = sized<splat_dataset_export_desc>();
    desc.path = options.out.c_str();
    desc.layout = options.layout.c_str();
    desc.split = split.c_str();
    desc.category = options.category.c_str();
    desc.duckdb = text_or_null(options.duckdb);
    desc.objects = objects.empty() ? nullptr : objects.data();
    desc.object_count = objects.size();
    const Shard shard = parse_shard(options.shard);
    desc.shards = shard.count;
    desc.shard = shard.index;
    with_progress(split, [&](splat_progress_callback callback, void* user) {
        return splat_dataset_export(dataset, &desc, callback, user);
    });
    const Json report = library_json(splat_dataset_report, dataset);
    const auto views_of = report.at("views_of").get<std::vector<std::uint64_t>>();
    std::uint64_t views = 0;
    for (const std::uint32_t object : objects) views += views_of[object];
    if (objects.empty())
        return {{"split", split}, {"objects", views_of.size()}, {"views", report.at("views")}};
    return {{"split", split}, {"objects", objects.size()}, {"views", views}};
}

void for_each_split(
    const TransferOptions& options,
    const std::function<Json(const std::string& split, std::string& missing)>& copy) {
    const Stopwatch watch;
    Json done = Json::array();
    std::string reason;
    std::string absent;
    for (const std::string split : {"train", "val", "test"}) {
        if (options.split != "all" && options.split != split) continue;
        std::string missing;
        const Json report = copy(split, missing);
        if (missing.empty()) {
            done.push_back(report);
            continue;
        }
        if (reason.empty()) reason = missing;
        absent += (absent.empty() ? "" : ", ") + split;
    }
    if (done.empty()) throw Failure(kBadData, reason);
    if (options.json) {
        print_json({{"path", options.out}, {"splits", done}, {"seconds", watch.seconds()}});
        return;
    }
    for (const Json& split : done) {
        const auto name = split.at("split").get<std::string>();
        if (split.contains("complete") && !split.at("complete").get<bool>())
            std::printf("%s, %s: shard %s is done; others are not\n", options.out.c_str(),
                        name.c_str(), options.shard.c_str());
        else
            std::printf("%s, %s: %llu objects, %llu views\n", options.out.c_str(), name.c_str(),
                        split.at("objects").get<unsigned long long>(),
                        split.at("views").get<unsigned long long>());
    }
    if (!absent.empty()) std::printf("no objects for %s\n", absent.c_str());
}

}  // namespace vkrun
