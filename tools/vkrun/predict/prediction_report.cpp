#include "vkrun/predict/prediction_report.h"

#include <algorithm>
#include <filesystem>

#include "core/os/path.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/text.h"
#include "vkrun/predict/predicted_scene.h"
#include "vkrun/weights/builtin_weights.h"

namespace vkrun {
namespace {

constexpr std::uint32_t kSheetColumns = 8;
constexpr std::uint32_t kSheetWidth = 1000, kPictureWidth = 256;  ///< pixels of the page

std::string view_path(const std::string& out, std::size_t number) {
    return out + format("/view_%02zu.png", number);
}

/// Removes the views that an earlier run with more of them left.
void remove_views_from(const std::string& out, std::size_t first) {
    std::error_code failed;
    while (std::filesystem::remove(splat::os::path_of(view_path(out, first)), failed)) ++first;
}

/// Input views, each next to its prediction, then novel views. With truths, a row of them stands
/// above each row of predictions.
std::vector<const float*> sheet_cells(const Predicted& task, const std::vector<float>& images,
                                      std::size_t inputs, std::size_t plane) {
    const std::size_t count = images.size() / plane;
    std::vector<const float*> cells;
    for (std::size_t i = 0; i < inputs; ++i) {
        cells.push_back(task.inputs.data() + plane * i);
        cells.push_back(images.data() + plane * i);
    }
    if (task.truths.empty()) {
        for (std::size_t i = inputs; i < count; ++i) cells.push_back(images.data() + plane * i);
        return cells;
    }
    const auto end_row = [&] {
        while (cells.size() % kSheetColumns != 0) cells.push_back(nullptr);
    };
    for (std::size_t first = inputs; first < count; first += kSheetColumns)
        for (const std::vector<float>* from : {&task.truths, &images}) {
            end_row();
            for (std::size_t i = first; i < std::min(first + kSheetColumns, count); ++i)
                cells.push_back(from->data() + plane * i);
        }
    return cells;
}

std::string file_name(const Json& path) {
    return splat::os::text_of(splat::os::path_of(path.get<std::string>()).filename());
}

/// The result for the page, in words and rounded.
std::vector<std::pair<std::string, std::string>> facts_of(const Json& result) {
    const auto number = [](const Json& of, const char* key) { return of.at(key).get<double>(); };
    std::vector<std::pair<std::string, std::string>> facts = {
        {"Input", result.at("input")},
        {"Weights", weights_title(result.at("weights")) +
                        (result.at("adapters").get<std::string>().empty()
                             ? ""
                             : " with the adapters " + file_name(result.at("adapters")))},
        {"Trained for", result.at("trained_for")},
        {"Gaussians", format("%.0f; left out: %.0f that cannot be seen, %.0f that are not finite",
                             number(result, "gaussians"), number(result, "faint"),
                             number(result, "not_finite"))},
        {"Time",
         format("%.0f ms to predict, %.0f ms to draw %.0f images", number(result, "predict_ms"),
                number(result, "draw_ms"), number(result, "images"))},
        {"Device", result.at("device")}};
    if (result.contains("photo"))
        facts.emplace_back("Object found by", result.at("photo").at("mask"));
    if (result.contains("photo") && number(result.at("photo"), "focal") > 0)
        facts.emplace_back(
            "Focal length",
            format("%.1f pixels of the picture, %.1f degrees across the square",
                   number(result.at("photo"), "focal"), number(result.at("photo"), "fov")));
    if (result.contains("psnr"))
        facts.emplace_back("Against the truth",
                           format("PSNR %.2f dB, SSIM %.3f on %.0f novel views; PSNR of the input "
                                  "view %.2f dB",
                                  number(result, "psnr"), number(result, "ssim"),
                                  number(result, "novel_views"), number(result, "psnr_input")));
    if (result.contains("depth"))
        facts.emplace_back(
            "Depth of the input view",
            format("correlation %.3f, mean error %.3f of its range, after scale and shift",
                   number(result.at("depth"), "correlation"), number(result.at("depth"), "error")));
    if (result.contains("warnings"))
        for (const Json& warning : result.at("warnings")) facts.emplace_back("Warning", warning);
    return facts;
}

void add_sheet(HtmlPage& page, const std::string& out, const Predicted& task) {
    page.picture(out + "/sheet.png",
                 task.truths.empty()
                     ? "the input, its reconstruction, and novel views"
                     : "the input and its reconstruction; then alternately a row of "
                       "true and a row of predicted novel views",
                 kSheetWidth);
}

}  // namespace

void write_prediction_pictures(const std::string& out, const splat_predictor_info& info,
                               const Predicted& task, const std::vector<float>& images) {
    const std::uint32_t side = info.resolution;
    const std::size_t pixels = std::size_t{side} * side;
    const std::size_t count = images.size() / (3 * pixels);
    const splat_image input = planar_image(task.inputs.data(), side, 3);
    check(splat_image_save((out + "/input.png").c_str(), &input));
    std::vector<splat_image> frames;
    for (std::size_t i = info.views; i < count; ++i) {
        frames.push_back(planar_image(images.data() + 3 * pixels * i, side, 3));
        check(splat_image_save(view_path(out, i - info.views).c_str(), &frames.back()));
    }
    remove_views_from(out, frames.size());
    check(splat_image_save_animation((out + "/orbit.png").c_str(), frames.data(),
                                     static_cast<std::uint32_t>(frames.size()), 80));
    contact_sheet(sheet_cells(task, images, info.views, 3 * pixels), side, kSheetColumns)
        .save(out + "/sheet.png");
}

std::string write_prediction_report(const std::string& out, const Predicted& task,
                                    const splat_predictor_info& info,
                                    const std::vector<splat_camera>& cameras, const Json& result) {
    HtmlPage page("Prediction of " + task.name);
    if (result.contains("note")) page.note(result.at("note"));
    add_predicted_scene(page, task.scene.get(), task.name, info, cameras);
    page.picture(out + "/input.png", "input", kPictureWidth);
    page.picture(out + "/orbit.png", "novel views", kPictureWidth);
    page.facts(facts_of(result));
    page.heading("Views");
    add_sheet(page, out, task);
    const std::string path = out + "/report.html";
    replace_file(path, page.text());
    return path;
}

void add_prediction(HtmlPage& page, const std::string& out, const Predicted& task,
                    const splat_predictor_info& info, const std::vector<splat_camera>& cameras) {
    add_predicted_scene(page, task.scene.get(), task.name, info, cameras);
    add_sheet(page, out, task);
}

}  // namespace vkrun
