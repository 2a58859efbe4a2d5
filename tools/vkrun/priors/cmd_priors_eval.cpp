// vkrun priors eval: scores depth maps, normals, masks or planes against true ones. Needs no device.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <set>

#include "core/os/path.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/text.h"
#include "vkrun/data/for_each_index.h"
#include "vkrun/priors/priors_report.h"

namespace vkrun {
namespace {

constexpr const char* kPriorsEvalFooter =
    R"(PRED and TRUTH are folders of .png, .npy, .pfm, .pgm, .jpg or .webp files, paired by their paths below the
folders without the extension; or data sets in SRN's layout, whose maps lie in OBJECT/depth, normal, mask and plane.
A true mask may be the alpha of TRUTH's pictures. Normals are (n + 1) / 2 in images and vectors in .npy and .pfm files.
Planes are .npy files of 'vkrun priors plane'; they are found within 0.05, 5 cm of maps in metres, and 10 degrees.

Each score gets its mean, its median and its worst map; two or more PRED are also compared map by map. OUT gets
per_map.csv, results.json, box.svg, scatter.svg, and report.html with all of it and the worst maps.

--published scores as Splatter Image with priors did: every pixel of a depth map counts; VIF takes values of 0 to 1,
averages in a constant alpha, and finds the truth's background, (188, 188, 188), in predictions, too.

Exit status: 0 every map was scored, 1 a file cannot be written, 2 wrong usage, 4 maps without a pair, damaged or of
another size; the others are scored.

Examples:
  vkrun priors eval midas data/srn_cars/cars_test --out scores
  vkrun priors eval midas zoe truth --kind depth --by lists.txt --json
  vkrun priors eval masks data --kind mask --half
)";

constexpr std::size_t kProblemsShown = 20;  ///< on standard error

struct PriorsEvalOptions {
    std::vector<std::string> folders;
    ScoreOptions scores;
    std::string groups;
    std::string out;
    std::uint32_t threads = 0;
    bool overwrite = false;
    bool json = false;
};

void check_options(const PriorsEvalOptions& options) {
    if (options.folders.size() < 2)
        throw Failure(kUsageError,
                      "expected one or more folders of predictions, then one of the truth");
    const std::set<std::string> distinct(options.folders.begin(), options.folders.end());
    if (distinct.size() != options.folders.size())
        throw Failure(kUsageError, "a folder is given twice");
    if (options.scores.half && options.scores.kind != "mask")
        throw Failure(kUsageError, "--half is of masks: it needs --kind mask");
    if (options.scores.published && options.scores.kind == "mask")
        throw Failure(kUsageError,
                      "--published changes nothing for masks, which are always scored so");
    if (options.scores.published && options.scores.kind == "plane")
        throw Failure(kUsageError, "--published is of depth and normals: planes were not scored");
    if (!options.out.empty()) check_target(options.out + "/report.html", options.overwrite);
}

/// All maps of the truth, and the problems of pairing.
PriorsEvaluation paired_maps(const PriorsEvalOptions& options) {
    PriorsEvaluation evaluation;
    evaluation.options = options.scores;
    evaluation.truth = options.folders.back();
    evaluation.methods.assign(options.folders.begin(), options.folders.end() - 1);
    const std::string& kind = options.scores.kind;
    evaluation.truth_files = find_maps(splat::os::path_of(evaluation.truth), kind);
    for (const std::string& method : evaluation.methods) {
        evaluation.files.push_back(find_maps(splat::os::path_of(method), kind));
        const MapFiles& files = evaluation.files.back();
        for (const auto& [name, path] : evaluation.truth_files)
            if (files.count(name) == 0)
                evaluation.problems.push_back("'" + method + "' has no map '" + name + "'");
        for (const auto& [name, path] : files)
            if (evaluation.truth_files.count(name) == 0)
                evaluation.problems.push_back("'" + evaluation.truth + "' has no map '" + name +
                                              "', which '" + method + "' has");
    }
    for (const auto& [name, path] : evaluation.truth_files) {
        ScoredMap map{name, "", {}};
        map.scores.resize(evaluation.methods.size());
        evaluation.maps.push_back(std::move(map));
    }
    return evaluation;
}

void add_groups(PriorsEvaluation& evaluation, const std::string& path) {
    const MapGroups groups(path);
    evaluation.groups = groups.names();
    std::size_t without = 0;
    for (ScoredMap& map : evaluation.maps) {
        map.group = groups.of(map.name);
        if (map.group.empty()) ++without;
    }
    for (const std::string& name : groups.unknown(evaluation.truth_files))
        evaluation.problems.push_back("'" + path + "' names '" + name + "', which '" +
                                      evaluation.truth + "' does not have");
    if (without != 0)
        std::fprintf(stderr,
                     "note: %zu maps are in no group of '%s' and count in the group of all only\n",
                     without, path.c_str());
}

void score_maps(PriorsEvaluation& evaluation, std::uint32_t threads) {
    const std::size_t methods = evaluation.methods.size();
    std::vector<std::string> failures(evaluation.maps.size() * methods);
    for_each_index(
        "maps", static_cast<std::uint32_t>(failures.size()), threads, [&](std::uint32_t index) {
            const std::size_t method = index % methods;
            ScoredMap& map = evaluation.maps[index / methods];
            const auto file = evaluation.files[method].find(map.name);
            if (file == evaluation.files[method].end()) return;
            try {
                map.scores[method] = score_map(file->second, evaluation.truth_files.at(map.name),
                                               evaluation.options);
            } catch (const Failure& failure) {
                failures[index] = about_file(splat::os::text_of(file->second), failure.what());
            }
        });
    for (const std::string& failure : failures)
        if (!failure.empty()) evaluation.problems.push_back(failure);
}

void check_scored(const PriorsEvaluation& evaluation) {
    for (std::size_t m = 0; m < evaluation.methods.size(); ++m) {
        bool scored = false;
        for (const ScoredMap& map : evaluation.maps) scored = scored || !map.scores[m].empty();
        if (!scored)
            throw Failure(kBadData, "no map of '" + evaluation.methods[m] +
                                        "' was scored: " + evaluation.problems.front());
    }
}

void write_evaluation(const PriorsEvaluation& evaluation, const std::filesystem::path& folder) {
    make_folder(folder);
    replace_file(folder / "per_map.csv", per_map_csv(evaluation));
    replace_file(folder / "results.json", json_text(evaluation_json(evaluation)) + "\n");
    replace_file(folder / "box.svg", boxes_of(evaluation));
    replace_file(folder / "scatter.svg", scatter_of(evaluation));
    replace_file(folder / "report.html", evaluation_page(evaluation));
}

int eval_priors(const PriorsEvalOptions& options) {
    check_options(options);
    PriorsEvaluation evaluation = paired_maps(options);
    if (!options.groups.empty()) add_groups(evaluation, options.groups);
    score_maps(evaluation, options.threads);
    check_scored(evaluation);
    if (!options.out.empty()) write_evaluation(evaluation, splat::os::path_of(options.out));
    if (options.json)
        print_json(evaluation_json(evaluation));
    else
        print_evaluation(evaluation);
    const std::vector<std::string>& problems = evaluation.problems;
    for (std::size_t i = 0; i < problems.size() && i < kProblemsShown; ++i)
        std::fprintf(stderr, "problem: %s\n", problems[i].c_str());
    if (problems.size() > kProblemsShown)
        std::fprintf(stderr, "and %zu more problems\n", problems.size() - kProblemsShown);
    return problems.empty() ? kSuccess : kBadData;
}

}  // namespace

void add_priors_eval(CLI::App& priors, int& exit_code) {
    CLI::App* command =
        add_command(priors, "eval", "Score depth maps, normals, masks or planes against true ones.",
                    kPriorsEvalFooter);
    const auto options = std::make_shared<PriorsEvalOptions>();
    command
        ->add_option("FOLDER", options->folders,
                     "PRED..., folders of predictions, and last TRUTH, that of the truth")
        ->required()
        ->type_name("");
    command->add_option("--kind", options->scores.kind, "depth, normal, mask or plane")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"depth", "normal", "mask", "plane"}));
    command
        ->add_option("--by", options->groups,
                     "File of lines 'GROUP NAME', such as 'easy car7' or 'hard car9/000004': each "
                     "group also gets its own table")
        ->type_name("FILE");
    command->add_flag("--published", options->scores.published,
                      "Score as the published code did (below)");
    command->add_flag("--half", options->scores.half,
                      "The true mask is where alpha > 0.5; default: > 0");
    command->add_option("--out", options->out, "Folder of the report")->type_name("DIR");
    add_overwrite_flag(*command, options->overwrite, "the report");
    add_threads_option(*command, options->threads);
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = eval_priors(*options); });
}

}  // namespace vkrun
