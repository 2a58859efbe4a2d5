#include "vkrun/eval/eval_report.h"

#include <algorithm>
#include <cmath>

#include "vkrun/cli/files.h"
#include "vkrun/cli/html_page.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/temporary_folder.h"
#include "vkrun/cli/text.h"
#include "vkrun/view/scene_viewer.h"

namespace vkrun {
namespace {

std::string number_text(const Json& value, const char* pattern) {
    return value.is_null() ? "-" : format(pattern, value.get<double>());
}

void add_means(HtmlPage& page, const Json& results) {
    std::vector<std::vector<std::string>> rows = {
        {"views", "PSNR, dB", "SSIM", "LPIPS", "images", "equal to their target"}};
    for (const char* kind : {"novel", "conditioning"}) {
        const Json& s = results.at(kind);
        rows.push_back({kind, number_text(s.at("psnr"), "%.3f"), number_text(s.at("ssim"), "%.4f"),
                        number_text(s.at("lpips"), "%.4f"),
                        std::to_string(s.at("views").get<std::uint32_t>()),
                        std::to_string(s.at("perfect_views").get<std::uint32_t>())});
    }
    page.table(rows);
}

void add_shown_object(HtmlPage& page, const char* which, const ObjectRow& row,
                      const ShownObject& shown, const float* background) {
    constexpr std::uint32_t kWidth = 1000;  ///< pixels of the page
    page.heading(std::string(which) + " object: " + row.name);
    page.paragraph(format("PSNR %.2f dB and SSIM %.4f of novel views; PSNR of input views %.2f dB.",
                          row.psnr, row.ssim, row.conditioning_psnr));
    auto info = sized<splat_scene_info>();
    if (shown.scene.get() != nullptr) check(splat_scene_get_info(shown.scene.get(), &info));
    if (info.count > 0) {
        ViewerOptions viewer;
        viewer.name = row.name;
        viewer.file = row.name + ".ply";
        viewer.cameras = shown.views.cameras;
        viewer.instead = "Images of it are below.";
        std::copy_n(background, 3, viewer.background);
        up_of(viewer.cameras, viewer.up);
        add_viewer(page, shown.scene.get(), viewer);
    }
    const TemporaryFolder folder;
    save_eval_sheet(folder.file("sheet.png"), shown.views, shown.images);
    page.picture(folder.file("sheet.png"), "true images above, drawn ones below; input views first",
                 kWidth);
}

}  // namespace

void save_eval_sheet(const std::string& path, const ObjectViews& views,
                     const std::vector<float>& images) {
    constexpr std::size_t kColumns = 8;
    const std::size_t plane = std::size_t{3} * views.side * views.side;
    const std::size_t count = images.size() / plane;
    const std::size_t columns = std::min(kColumns, count);
    std::vector<const float*> cells;
    for (const std::vector<float>* from : {&views.images, &images})
        for (std::size_t i = 0; i < columns; ++i)
            cells.push_back(from->data() + i * count / columns * plane);
    contact_sheet(cells, views.side, static_cast<std::uint32_t>(columns)).save(path);
}

std::string write_eval_report(const std::string& out, const Json& results,
                              const std::vector<std::pair<std::string, std::string>>& facts,
                              std::vector<ObjectRow> rows, const float* background,
                              const std::function<ShownObject(std::uint32_t object)>& show) {
    HtmlPage page("Evaluation");
    std::erase_if(rows, [](const ObjectRow& row) { return !std::isfinite(row.psnr); });
    std::sort(rows.begin(), rows.end(), [](const ObjectRow& a, const ObjectRow& b) {
        return a.psnr != b.psnr ? a.psnr < b.psnr : a.object < b.object;
    });
    if (rows.size() > 1) {
        HtmlPage::Curve novel{"novel views", {}}, input{"input views", {}};
        for (std::size_t i = 0; i < rows.size(); ++i) {
            novel.points.emplace_back(i, rows[i].psnr);
            if (std::isfinite(rows[i].conditioning_psnr))
                input.points.emplace_back(i, rows[i].conditioning_psnr);
        }
        page.chart("PSNR of each object, dB, from the worst to the best by novel views",
                   {novel, input});
    }
    page.facts(facts);
    add_means(page, results);
    const std::pair<const char*, std::size_t> chosen[] = {
        {"Worst", 0}, {"Median", rows.size() / 2}, {"Best", rows.size() - 1}};
    for (const auto& [which, at] : chosen) {
        if (rows.empty()) break;
        const bool only = rows.size() == 1;
        add_shown_object(page, only ? "The" : which, rows[at], show(rows[at].object), background);
        if (only) break;
    }
    const std::string path = out + "/report.html";
    replace_file(path, page.text());
    return path;
}

}  // namespace vkrun
