#include "vkrun/eval/scene_eval.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/html_page.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/progress.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/temporary_folder.h"
#include "vkrun/cli/text.h"
#include "vkrun/fit/fit_report.h"
#include "vkrun/scene/scene_file.h"
#include "vkrun/train/training_view.h"

namespace vkrun {
namespace {

/// Views that the page shows, from the worst to the best.
constexpr std::size_t kSheetViews = 8;

struct ViewRow {
    std::string name;
    double psnr, ssim, inner_psnr, inner_ssim;
    PhotoSheet pictures;
};

/// Means, and the views in the order of the data.
struct SceneScoring {
    std::vector<ViewRow> rows;
    ViewRow mean;
};

ViewRow row_of(const splat_run_event& event) {
    ViewRow row{event.name == nullptr ? "mean" : event.name,
                number_of(event, "val_psnr"),
                number_of(event, "val_ssim"),
                number_of(event, "inner_psnr"),
                number_of(event, "inner_ssim"),
                {}};
    if (event.images != nullptr)
        row.pictures.add(event.truths, event.images, event.width, event.height);
    return row;
}

SceneScoring score(splat_device device, splat_scene scene, const std::string& data,
                   const SceneEvalOptions& options) {
    auto desc = sized<splat_fit_desc>();
    desc.data = data.c_str();
    if (!options.masks.empty()) desc.masks = options.masks.c_str();
    if (options.white) desc.flags |= SPLAT_FIT_WHITE_BACKGROUND;
    if (options.test_every == 0) desc.flags |= SPLAT_FIT_ALL_PHOTOS;
    desc.test_every = options.test_every;
    desc.downscale = options.downscale;
    desc.cameras = options.cameras == "colmap"       ? SPLAT_FIT_CAMERAS_COLMAP
                   : options.cameras == "transforms" ? SPLAT_FIT_CAMERAS_TRANSFORMS
                                                     : SPLAT_FIT_CAMERAS_AUTO;
    Run run;
    check_opened(splat_fit_score(device, &desc, scene, options.border, run.out()));
    SceneScoring scoring;
    std::optional<Progress> progress;
    auto event = sized<splat_run_event>();
    while (event.kind < SPLAT_EVENT_DONE) {
        check(splat_run_next(run.get(), &event), kBadData);
        if (event.kind == SPLAT_EVENT_MESSAGE && event.text != nullptr)
            std::fprintf(stderr, "%s\n", in_own_words(event.text).c_str());
        if (event.kind == SPLAT_EVENT_VALIDATED_PIECE) {
            if (!progress) progress.emplace("scoring", event.pieces);
            progress->show(event.piece);
            scoring.rows.push_back(row_of(event));
        }
        if (event.kind == SPLAT_EVENT_VALIDATION) scoring.mean = row_of(event);
    }
    return scoring;
}

Json number_or_null(double value) {
    return std::isfinite(value) ? Json(value) : Json();
}

void add_scores(Json& json, const ViewRow& row) {
    json["psnr"] = number_or_null(row.psnr);
    json["ssim"] = number_or_null(row.ssim);
    json["inner_psnr"] = number_or_null(row.inner_psnr);
    json["inner_ssim"] = number_or_null(row.inner_ssim);
}

/// For 'vkrun compare'.
std::string csv_text(const SceneScoring& scoring) {
    std::string csv = "object,psnr_novel,ssim_novel,inner_psnr,inner_ssim,views\n";
    for (const ViewRow& row : scoring.rows) {
        std::string name;
        for (const char c : row.name) name += c == '"' ? "\"\"" : std::string(1, c);
        csv += format("\"%s\",%.9g,%.9g,%.9g,%.9g,1\n", name.c_str(), row.psnr, row.ssim,
                      row.inner_psnr, row.inner_ssim);
    }
    return csv;
}

std::string text_of(double value, const char* pattern) {
    return std::isnan(value) ? "-" : format(pattern, value);
}

std::vector<std::string> table_row(const ViewRow& row) {
    return {row.name, text_of(row.psnr, "%.3f"), text_of(row.ssim, "%.4f"),
            text_of(row.inner_psnr, "%.3f"), text_of(row.inner_ssim, "%.4f")};
}

std::vector<std::string> table_head(double border) {
    const std::string inner = format(" of the central %g %%", 100 - 200 * border);
    return {"view", ">PSNR", ">SSIM", ">PSNR" + inner, ">SSIM" + inner};
}

std::string page_text(const std::string& path, const std::string& data, const SceneScoring& scoring,
                      const SceneEvalOptions& options, const Json& facts, splat_scene scene) {
    HtmlPage page("Scores of " + path);
    page.facts({{"Scene", path},
                {"Gaussians", std::to_string(facts.at("gaussians").get<std::uint64_t>())},
                {"Photographs", format("%zu of %s", scoring.rows.size(), data.c_str())},
                {"Device", facts.at("device").get<std::string>()}});
    std::vector<std::vector<std::string>> rows = {table_head(options.border),
                                                  table_row(scoring.mean)};
    for (const ViewRow& row : scoring.rows) rows.push_back(table_row(row));
    page.table(rows);
    std::vector<const ViewRow*> order;
    for (const ViewRow& row : scoring.rows) order.push_back(&row);
    std::stable_sort(order.begin(), order.end(),
                     [](const ViewRow* a, const ViewRow* b) { return a->psnr < b->psnr; });
    const std::size_t shown = std::min(kSheetViews, order.size());
    PhotoSheet sheet;
    std::string names;
    for (std::size_t i = 0; i < shown; ++i) {
        const ViewRow& row = *order[shown == 1 ? 0 : i * (order.size() - 1) / (shown - 1)];
        sheet.add(row.pictures);
        names += (names.empty() ? "" : ", ") + row.name;
    }
    const TemporaryFolder folder;
    sheet.save(folder.file("sheet.png"));
    constexpr std::uint32_t kWidth = 1000;
    page.picture(folder.file("sheet.png"),
                 "truth, drawn, error, from the worst to the best: " + names, kWidth);
    add_scene_of_photographs(page, scene, data, options.cameras == "transforms", options.white);
    return page.text();
}

}  // namespace

void add_scene_eval_options(CLI::App& command, SceneEvalOptions& options) {
    command
        .add_option(
            "--test-every", options.test_every,
            "Of a scene: score every so many photographs, as the fit held\nthem out; 0: all")
        ->type_name("N")
        ->capture_default_str();
    command
        .add_option("--downscale", options.downscale,
                    "Of a scene: divide the photographs' sides by it")
        ->type_name("D")
        ->capture_default_str();
    command
        .add_option("--cameras", options.cameras,
                    "Of a scene: cameras to read: auto, colmap or transforms")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"auto", "colmap", "transforms"}));
    command
        .add_option("--masks", options.masks,
                    "Of a scene: folder of masks, named like the photographs")
        ->type_name("DIR");
    command
        .add_option("--border", options.border,
                    "Of a scene: share of width and height that the second scores\nleave out on "
                    "each side, 0 to below 0.5")
        ->type_name("X")
        ->capture_default_str();
    command.add_flag("--white-background", options.white,
                     "Of a scene: transparent pictures lie on white");
}

int evaluate_scene(const std::string& path, const std::string& data, const std::string& out,
                   const SceneEvalOptions& options, const std::string& device_name, bool json) {
    if (!(options.border >= 0 && options.border < 0.5))
        throw Failure(kUsageError,
                      format("--border is %g, expected 0 to below 0.5", options.border));
    const SceneFile file = load_scene(path);
    const Device device = open_device(device_desc(device_name));
    const SceneScoring scoring = score(device.get(), file.scene.get(), data, options);
    Json results = {{"schema", 1},
                    {"scene", path},
                    {"data", data},
                    {"device", info_of(device.get()).name},
                    {"gaussians", file.info.count},
                    {"views", scoring.rows.size()},
                    {"downscale", options.downscale},
                    {"border", options.border},
                    {"drawn_as", drawn_names(file.info.drawn_as)}};
    add_scores(results, scoring.mean);
    results["per_view"] = Json::array();
    for (const ViewRow& row : scoring.rows) {
        Json view = {{"name", row.name}};
        add_scores(view, row);
        results["per_view"].push_back(std::move(view));
    }
    make_folder(out);
    replace_file(out + "/results.json", results.dump(2) + "\n");
    replace_file(out + "/per_view.csv", csv_text(scoring));
    replace_file(out + "/report.html",
                 page_text(path, data, scoring, options, results, file.scene.get()));
    if (json) {
        print_json(results);
        return kSuccess;
    }
    Table table(table_head(options.border));
    for (const ViewRow& row : scoring.rows) table.add(table_row(row));
    table.add(table_row(scoring.mean));
    std::printf("%s%s/report.html\n", table.text().c_str(), out.c_str());
    return kSuccess;
}

}  // namespace vkrun
