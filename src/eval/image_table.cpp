#include "eval/image_table.h"

#include <cmath>
#include <set>

#include "core/os/path.h"
#include "core/shown.h"
#include "eval/csv_table.h"
#include "io/file.h"

namespace splat::eval {
namespace {

const std::vector<std::string> kHeading = {"object", "view", "psnr_novel", "ssim_novel",
                                           "lpips_novel"};

}  // namespace

std::string image_table_text(const ImageTable& images) {
    std::string csv;
    for (const std::string& name : kHeading) csv += (csv.empty() ? "" : ",") + name;
    csv += "\n";
    for (const auto& [object, views] : images)
        for (const ViewScores& view : views)
            csv += csv_field(object) + format(",%u,", view.view) + decimal("%.9g", view.psnr) +
                   "," + decimal("%.9g", view.ssim) + "," + decimal("%.9g", view.lpips) + "\n";
    return csv;
}

Result<ImageTable> read_image_scores(const std::string& folder) {
    const std::string path = os::text_of(os::path_of(folder) / kImagesFile);
    const auto bytes = io::read_file(path);
    if (bytes.status().code() == Code::kNotFound) return ImageTable{};
    SPLAT_TRY(bytes.status());
    SPLAT_ASSIGN(const std::vector<CsvRow> rows, csv_rows(io::as_text(bytes.value()), path));
    if (rows.empty() || rows[0].fields != kHeading)
        return refuse_line(path, 1,
                           "expected the heading object,view,psnr_novel,ssim_novel,lpips_novel");
    ImageTable images;
    std::set<std::pair<std::string, std::uint32_t>> seen;
    for (const CsvRow& row : std::span(rows).subspan(1)) {
        if (row.fields.size() != kHeading.size())
            return refuse_line(path, row.line,
                               format("%zu columns, expected %zu, as in the heading",
                                      row.fields.size(), kHeading.size()));
        double numbers[4];  // the view, then its scores
        for (std::size_t i = 0; i < std::size(numbers); ++i) {
            const auto value = score_of(row.fields[i + 1]);
            if (!value ||
                (i == 0 && !(*value >= 0 && *value <= UINT32_MAX && *value == std::floor(*value))))
                return refuse_line(path, row.line,
                                   "'" + shown(row.fields[i + 1]) + "' is not a number" +
                                       (i == 0 ? " of a view" : ""));
            numbers[i] = *value;
        }
        const auto view = static_cast<std::uint32_t>(numbers[0]);
        if (!seen.emplace(row.fields[0], view).second)
            return refuse_line(path, row.line,
                               format("view %u of object '%s' is in the table already", view,
                                      shown(row.fields[0]).c_str()));
        images[row.fields[0]].push_back({view, numbers[1], numbers[2], numbers[3]});
    }
    return images;
}

}  // namespace splat::eval
