#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/status.h"

namespace splat::eval {

/// Scores of one view; NaN where there are none, and an infinite PSNR where it equals its target.
struct ViewScores {
    std::uint32_t view = 0;  ///< number in the data set
    double psnr = 0, ssim = 0, lpips = 0;
};

/// The novel views of objects, by the objects' names.
using ImageTable = std::map<std::string, std::vector<ViewScores>>;

/// Beside per_object.csv.
inline constexpr const char* kImagesFile = "per_image.csv";

/// The text of per_image.csv: a heading and a line per view.
std::string image_table_text(const ImageTable& images);

/// Read it from a folder; without the file, which evaluations of earlier versions lack, empty. Errors: kFormat, naming
/// file and line, for another heading, a number that is malformed, a view of an object that occurs twice; those of
/// io::read_file.
Result<ImageTable> read_image_scores(const std::string& folder);

}  // namespace splat::eval
