// The frozen layouts of training sessions.
#pragma once

#include "api/layout/layout.h"

namespace splat::test {

inline const Layout kTrainingDesc = {  // clang-format off
    "splat_training_desc",
    sizeof(splat_training_desc),
    80,
    {
    SPLAT_FIELD(splat_training_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_training_desc, flags, 4, 4),
    SPLAT_FIELD(splat_training_desc, next, 8, 8),
    SPLAT_FIELD(splat_training_desc, folder, 16, 8),
    SPLAT_FIELD(splat_training_desc, config, 24, 8),
    SPLAT_FIELD(splat_training_desc, values, 32, 8),
    SPLAT_FIELD(splat_training_desc, value_count, 40, 8),
    SPLAT_FIELD(splat_training_desc, dataset, 48, 8),
    SPLAT_FIELD(splat_training_desc, validation, 56, 8),
    SPLAT_FIELD(splat_training_desc, init, 64, 8),
    SPLAT_FIELD(splat_training_desc, init_flags, 72, 4),
    SPLAT_FIELD(splat_training_desc, reserved, 76, 4),}
};  // clang-format on

inline const Layout kTrainingEvent = {  // clang-format off
    "splat_training_event",
    sizeof(splat_training_event),
    200,
    {
    SPLAT_FIELD(splat_training_event, struct_size, 0, 4),
    SPLAT_FIELD(splat_training_event, kind, 4, 4),
    SPLAT_FIELD(splat_training_event, text, 8, 8),
    SPLAT_FIELD(splat_training_event, warning, 16, 4),
    SPLAT_FIELD(splat_training_event, logged, 20, 4),
    SPLAT_FIELD(splat_training_event, step, 24, 8),
    SPLAT_FIELD(splat_training_event, attempts, 32, 8),
    SPLAT_FIELD(splat_training_event, iterations, 40, 8),
    SPLAT_FIELD(splat_training_event, skipped, 48, 8),
    SPLAT_FIELD(splat_training_event, peak_bytes, 56, 8),
    SPLAT_FIELD(splat_training_event, info, 64, 8),
    SPLAT_FIELD(splat_training_event, psnr, 72, 8),
    SPLAT_FIELD(splat_training_event, averaged_loss, 80, 8),
    SPLAT_FIELD(splat_training_event, seconds, 88, 8),
    SPLAT_FIELD(splat_training_event, steps_per_second, 96, 8),
    SPLAT_FIELD(splat_training_event, name, 104, 8),
    SPLAT_FIELD(splat_training_event, object, 112, 4),
    SPLAT_FIELD(splat_training_event, objects, 116, 4),
    SPLAT_FIELD(splat_training_event, views, 120, 4),
    SPLAT_FIELD(splat_training_event, inputs, 124, 4),
    SPLAT_FIELD(splat_training_event, side, 128, 4),
    SPLAT_FIELD(splat_training_event, reserved, 132, 4),
    SPLAT_FIELD(splat_training_event, image_count, 136, 8),
    SPLAT_FIELD(splat_training_event, images, 144, 8),
    SPLAT_FIELD(splat_training_event, truths, 152, 8),
    SPLAT_FIELD(splat_training_event, novel_psnr, 160, 8),
    SPLAT_FIELD(splat_training_event, novel_ssim, 168, 8),
    SPLAT_FIELD(splat_training_event, conditioning_psnr, 176, 8),
    SPLAT_FIELD(splat_training_event, conditioning_ssim, 184, 8),
    SPLAT_FIELD(splat_training_event, best_psnr, 192, 8),}
};  // clang-format on

}  // namespace splat::test
