// vkrun data check: reads a whole data set and reports what is wrong.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>

#include "vkrun/cli/command.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/text.h"
#include "vkrun/data/for_each_index.h"

namespace vkrun {
namespace {

constexpr const char* kDataCheckFooter =
    R"(Reads every image, map and camera of every split that exists; a folder without splits is read once, as train.
Problems: splits that cannot be opened, objects that lack a file or cannot be read, images that cannot be read or differ
in size, poses that are not finite or not rotations, objects with a single view. Warnings: equal views or objects,
images of one colour. Folders beside the objects that have no part of one are named, and so are images that are cut to
squares. It tells the scene's depths, from a COLMAP model's points or else from where the cameras look: data.znear and
data.zfar must enclose them. The hash is that of the decoded images, maps and
cameras. docs/your-data.md explains layouts and ranges.

Exit status: 0 no problems, 2 wrong usage, 4 problems, or no data.

Examples:
  vkrun data check data
  vkrun data check data --split val --json | jq .hash
)";

constexpr std::size_t kShown = 20;  ///< sentences printed for each split

struct CheckOptions {
    std::string path;
    std::string format;
    std::string split = "all";
    std::uint32_t limit = 0;
    std::uint32_t threads = 0;
    bool json = false;
};

/// FNV-1a of 64 bits of texts.
class TextHash {
  public:
    void add(const std::string& text) {
        for (const char c : text)
            value_ = (value_ ^ static_cast<unsigned char>(c)) * 0x100000001B3U;
    }
    [[nodiscard]] std::string text() const {
        return format("%016llx", static_cast<unsigned long long>(value_));
    }

  private:
    unsigned long long value_ = 0xCBF29CE484222325U;
};

struct NoSplit : Failure {
    explicit NoSplit(const std::string& sentence) : Failure(kBadData, sentence) {}
};

/// Throws NoSplit for one of all splits that is not there, Failure for other errors.
Dataset open_split(const CheckOptions& options, const char* split) {
    auto desc = sized<splat_dataset_desc>();
    desc.path = options.path.c_str();
    desc.format = options.format.empty() ? nullptr : options.format.c_str();
    desc.split = split;
    desc.limit = options.limit;
    desc.flags = SPLAT_DATA_LENIENT;
    desc.cache_bytes = 1;
    Dataset dataset;
    const splat_result result = splat_dataset_open(&desc, dataset.out());
    if (options.split == "all" && result == SPLAT_ERROR_NOT_FOUND) throw NoSplit(library_message());
    check(result, kBadData);
    if (options.split == "all" && std::string(split) != "train" &&
        !library_json(splat_dataset_report, dataset.get()).at("has_splits").get<bool>())
        throw NoSplit("'" + options.path + "' has no splits, and was read as train");
    return dataset;
}

/// Objects of equal contents, as warnings.
void find_twins(const std::vector<Json>& objects, Json& warnings) {
    std::map<std::string, std::string> names;  // by hash
    for (const Json& object : objects) {
        const auto name = object.at("name").get<std::string>();
        const auto [place, fresh] = names.emplace(object.at("hash").get<std::string>(), name);
        if (!fresh)
            warnings.push_back(
                {{"object", name}, {"sentence", "holds the same as '" + place->second + "'"}});
    }
}

/// Objects whose images differ in size from most others, as problems.
void find_other_sizes(const std::vector<Json>& objects, Json& problems) {
    std::map<std::uint32_t, std::size_t> counts;
    for (const Json& object : objects) ++counts[object.at("width").get<std::uint32_t>()];
    const auto usual =
        std::max_element(counts.begin(), counts.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    for (const Json& object : objects) {
        const auto width = object.at("width").get<std::uint32_t>();
        if (width != usual->first && width != 0)
            problems.push_back(
                {{"object", object.at("name")},
                 {"sentence", format("has images of %u x %u pixels, most objects %u x %u", width,
                                     width, usual->first, usual->first)}});
    }
}

/// Where the scenes of all objects lie; by points where some have them.
Json depths_of(const std::vector<Json>& objects) {
    Json all;
    for (const char* from : {"points", "cameras"}) {
        for (const Json& object : objects) {
            if (!object.contains("depths") || object.at("depths").at("from") != from) continue;
            const Json& own = object.at("depths");
            if (all.is_null()) all = own;
            for (const char* key : {"near", "znear"})
                all[key] = std::min(all.at(key).get<double>(), own.at(key).get<double>());
            for (const char* key : {"far", "zfar"})
                all[key] = std::max(all.at(key).get<double>(), own.at(key).get<double>());
        }
        if (!all.is_null()) break;
    }
    return all;
}

Json check_split(const CheckOptions& options, const char* split, const Dataset& dataset) {
    const Json report = library_json(splat_dataset_report, dataset.get());
    std::vector<Json> objects(report.at("objects").get<std::size_t>());
    for_each_index(split, static_cast<std::uint32_t>(objects.size()), options.threads,
                   [&](std::uint32_t object) {
                       objects[object] = library_json(splat_dataset_check, dataset.get(), object);
                   });
    Json problems = Json::array();
    Json warnings = Json::array();
    TextHash hash;
    for (const Json& object : objects) {
        hash.add(object.at("name").get<std::string>() + "\n" +
                 object.at("hash").get<std::string>() + "\n");
        for (const Json& text : object.at("problems"))
            problems.push_back({{"object", object.at("name")}, {"sentence", text}});
        for (const Json& text : object.at("warnings"))
            warnings.push_back({{"object", object.at("name")}, {"sentence", text}});
    }
    find_twins(objects, warnings);
    find_other_sizes(objects, problems);
    const auto views_of = report.at("views_of").get<std::vector<std::uint32_t>>();
    return {{"split", split},
            {"format", report.at("format")},
            {"objects", objects.size()},
            {"views", report.at("views")},
            {"least_views", *std::min_element(views_of.begin(), views_of.end())},
            {"most_views", *std::max_element(views_of.begin(), views_of.end())},
            {"resolution", report.at("stored_resolution")},
            {"maps", report.at("maps")},
            {"hash", hash.text()},
            {"not_objects", report.at("not_objects")},
            {"not_read", report.at("not_read")},
            {"not_read_count", report.at("not_read_count")},
            {"notes", report.at("notes")},
            {"depths", depths_of(objects)},
            {"problems", problems},
            {"warnings", warnings}};
}

void print_list(const char* kind, const Json& list) {
    for (std::size_t i = 0; i < list.size() && i < kShown; ++i)
        std::printf("  %s: %s: %s\n", kind, list[i].at("object").get<std::string>().c_str(),
                    list[i].at("sentence").get<std::string>().c_str());
    if (list.size() > kShown) std::printf("  and %zu more\n", list.size() - kShown);
}

void print_depths(const Json& depths) {
    if (depths.is_null()) return;
    const auto number = [&depths](const char* key) { return depths.at(key).get<double>(); };
    std::printf("  depths: %s %.3g to %.3g away; data.znear=%.3g and data.zfar=%.3g hold %s\n",
                depths.at("from") == "points"
                    ? "98 % of the COLMAP model's points in the views lie"
                    : "the cameras look at a place of which their images show what lies",
                number("near"), number("far"), number("znear"), number("zfar"),
                depths.at("from") == "points" ? "them" : "that");
}

void print_split(const Json& split) {
    if (!split.contains("format")) {
        std::printf("%s: cannot be opened: %s\n", split.at("split").get<std::string>().c_str(),
                    split.at("problems")[0].at("sentence").get<std::string>().c_str());
        return;
    }
    std::string maps;
    for (const Json& map : split.at("maps")) maps += " " + map.get<std::string>();
    const auto number = [&split](const char* key) { return split.at(key).get<std::uint32_t>(); };
    std::printf(
        "%s (%s): %u objects, %u views (%u to %u each) of %u x %u pixels, maps:%s; %zu problems, "
        "%zu warnings; hash %s\n",
        split.at("split").get<std::string>().c_str(), split.at("format").get<std::string>().c_str(),
        number("objects"), number("views"), number("least_views"), number("most_views"),
        number("resolution"), number("resolution"), maps.empty() ? " none" : maps.c_str(),
        split.at("problems").size(), split.at("warnings").size(),
        split.at("hash").get<std::string>().c_str());
    std::string others;
    for (const Json& name : split.at("not_objects"))
        others += (others.empty() ? "" : ", ") + name.get<std::string>();
    if (!others.empty()) std::printf("  not an object: %s\n", others.c_str());
    for (const Json& note : split.at("notes"))
        std::printf("  note: %s\n", note.get<std::string>().c_str());
    print_depths(split.at("depths"));
    print_list("problem", split.at("problems"));
    print_list("warning", split.at("warnings"));
}

/// A split that is there, but cannot be opened.
Json unopened(const char* split, const Failure& failure) {
    return {{"split", split},
            {"problems", Json::array({{{"object", nullptr}, {"sentence", failure.what()}}})},
            {"warnings", Json::array()},
            {"hash", ""}};
}

/// The chosen split, or for "all" those that are there; at least one can be opened.
std::vector<Json> check_splits(const CheckOptions& options) {
    std::vector<Json> splits;
    std::optional<Failure> first;
    bool opened = false;
    for (const char* split : {"train", "val", "test"}) {
        if (options.split != "all" && options.split != split) continue;
        Dataset dataset;
        try {
            dataset = open_split(options, split);
        } catch (const NoSplit& failure) {
            if (!first) first = failure;
            continue;
        } catch (const Failure& failure) {
            if (failure.code() != kBadData) throw;
            if (!first) first = failure;
            splits.push_back(unopened(split, failure));
            continue;
        }
        splits.push_back(check_split(options, split, dataset));
        opened = true;
    }
    if (!opened) throw Failure(kBadData, first->what());
    return splits;
}

int check_data(const CheckOptions& options) {
    const std::vector<Json> splits = check_splits(options);
    std::size_t problems = 0;
    TextHash hash;
    Json list = Json::array();
    for (const Json& split : splits) {
        problems += split.at("problems").size();
        hash.add(split.at("split").get<std::string>() + split.at("hash").get<std::string>());
        list.push_back(split);
        if (!options.json) print_split(split);
    }
    if (options.json)
        print_json({{"path", options.path},
                    {"ok", problems == 0},
                    {"problems", problems},
                    {"hash", hash.text()},
                    {"splits", list}});
    return problems == 0 ? kSuccess : kBadData;
}

}  // namespace

void add_data_check(CLI::App& data, int& exit_code) {
    CLI::App* command = add_command(
        data, "check", "Read a whole data set and report what is wrong.", kDataCheckFooter);
    const auto options = std::make_shared<CheckOptions>();
    command->add_option("DIR", options->path, "Folder of the data set")->required()->type_name("");
    command->add_option("--split", options->split, "train, val, test or all")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"train", "val", "test", "all"}));
    command->add_option("--format", options->format, "Format of the data set; default: detected")
        ->type_name("NAME");
    command
        ->add_option("--limit", options->limit,
                     "Check only the first N objects of each split; 0: all")
        ->type_name("N")
        ->capture_default_str();
    add_threads_option(*command, options->threads);
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = check_data(*options); });
}

}  // namespace vkrun
