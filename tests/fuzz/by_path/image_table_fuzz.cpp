// per_image.csv of an evaluation.
#include "eval/image_table.h"

#include "fuzz/by_path/folder.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    static const fuzz::Folder folder({eval::kImagesFile});
    folder.write(0, file);
    const auto images = eval::read_image_scores(folder.path());
    if (!fuzz::accepted(images.status())) return;
    // What is written is read as the same; NaNs are unequal.
    const std::string text = eval::image_table_text(images.value());
    folder.write(0, io::as_bytes(text));
    const auto again = eval::read_image_scores(folder.path());
    fuzz::require(again.ok() && eval::image_table_text(again.value()) == text);
}
