#pragma once

#include <vector>

#include "predict/pictures.h"
#include "splat.h"

namespace splat::api {

/// A picture, decoded, with the focal length of its Exif data where the caller gives none; `name` stands
/// for it in messages. Errors: kInvalidArgument, naming the member, for unknown flags, for a source that is a
/// path and pixels, for pixels that do not fit, and for a picture without an image; those of io::load_image.
Result<predict::PictureInput> picture_input(const splat_picture& from, const std::string& name);

/// The pictures of a prediction.
Result<std::vector<predict::PictureInput>> picture_inputs(const splat_picture* pictures,
                                                          std::uint32_t count);

splat_picture_info info_of(const predict::PictureFacts& facts, bool field_of_view_differs);

/// The warnings in sentences.
std::vector<std::string> picture_warnings(const splat_picture_info& info);

/// The JSON of splat_prediction_report.
Result<std::string> prediction_text(const splat_prediction& prediction);

}  // namespace splat::api
