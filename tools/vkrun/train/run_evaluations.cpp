#include "vkrun/train/run_evaluations.h"

#include <filesystem>

#include "core/os/path.h"
#include "vkrun/cli/handles.h"

namespace vkrun {
namespace {

/// `b` compared with `a`, files of scores, or its means alone; empty if they share no object.
Comparison compare_files(const std::string& a, const std::string& b, bool means) {
    auto desc = sized<splat_compare_desc>();
    desc.a.path = a.c_str();
    desc.b.path = b.c_str();
    if (means) desc.resamples = desc.bootstraps = 1;
    Comparison comparison;
    const splat_result result = splat_compare_scores(&desc, comparison.out());
    if (result != SPLAT_OK && result != SPLAT_ERROR_NOT_FOUND)
        throw Failure(kBadData, library_message());
    return comparison;
}

}  // namespace

RunEvaluations compare_evaluations(const std::vector<std::string>& folders) {
    RunEvaluations found;
    std::string first;
    for (const std::string& folder : folders) {
        const auto path = splat::os::path_of(folder) / "eval" / "per_object.csv";
        if (!std::filesystem::exists(path)) continue;
        const std::string file = splat::os::text_of(path);
        const bool is_first = first.empty();
        if (is_first) {
            first = file;
            found.table.baseline = folder;
        }
        const Comparison comparison = compare_files(first, file, is_first);
        if (comparison.get() == nullptr) continue;
        const Json report = library_json(splat_comparison_report, comparison.get());
        const auto compared = compared_metrics(comparison.get(), report);
        if (is_first) {
            found.first = compared;
            continue;
        }
        found.table.add(folder, compared, report);
        const auto note = report.at("note").get<std::string>();
        if (!note.empty()) found.notes.push_back("B is " + folder + ": " + note);
    }
    return found;
}

}  // namespace vkrun
