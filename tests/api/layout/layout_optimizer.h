#pragma once

#include "api/layout/layout.h"

namespace splat::test {

inline const Layout kOptimizerItem = {  // clang-format off
    "splat_optimizer_item",
    sizeof(splat_optimizer_item),
    40,
    {
    SPLAT_FIELD(splat_optimizer_item, name, 0, 8),
    SPLAT_FIELD(splat_optimizer_item, model, 8, 8),
    SPLAT_FIELD(splat_optimizer_item, module, 16, 8),
    SPLAT_FIELD(splat_optimizer_item, parameter, 24, 8),
    SPLAT_FIELD(splat_optimizer_item, gradient, 32, 8),}
};  // clang-format on

inline const Layout kOptimizerGroup = {  // clang-format off
    "splat_optimizer_group",
    sizeof(splat_optimizer_group),
    40,
    {
    SPLAT_FIELD(splat_optimizer_group, pattern, 0, 8),
    SPLAT_FIELD(splat_optimizer_group, rate_factor, 8, 8),
    SPLAT_FIELD(splat_optimizer_group, beta1, 16, 8),
    SPLAT_FIELD(splat_optimizer_group, beta2, 24, 8),
    SPLAT_FIELD(splat_optimizer_group, eps, 32, 8),}
};  // clang-format on

inline const Layout kOptimizerDesc = {  // clang-format off
    "splat_optimizer_desc",
    sizeof(splat_optimizer_desc),
    136,
    {
    SPLAT_FIELD(splat_optimizer_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_optimizer_desc, flags, 4, 4),
    SPLAT_FIELD(splat_optimizer_desc, next, 8, 8),
    SPLAT_FIELD(splat_optimizer_desc, items, 16, 8),
    SPLAT_FIELD(splat_optimizer_desc, item_count, 24, 8),
    SPLAT_FIELD(splat_optimizer_desc, groups, 32, 8),
    SPLAT_FIELD(splat_optimizer_desc, group_count, 40, 8),
    SPLAT_FIELD(splat_optimizer_desc, rate, 48, 8),
    SPLAT_FIELD(splat_optimizer_desc, beta1, 56, 8),
    SPLAT_FIELD(splat_optimizer_desc, beta2, 64, 8),
    SPLAT_FIELD(splat_optimizer_desc, eps, 72, 8),
    SPLAT_FIELD(splat_optimizer_desc, schedule, 80, 4),
    SPLAT_FIELD(splat_optimizer_desc, reserved, 84, 4),
    SPLAT_FIELD(splat_optimizer_desc, warmup_steps, 88, 8),
    SPLAT_FIELD(splat_optimizer_desc, total_steps, 96, 8),
    SPLAT_FIELD(splat_optimizer_desc, step_at, 104, 8),
    SPLAT_FIELD(splat_optimizer_desc, ema_decay, 112, 8),
    SPLAT_FIELD(splat_optimizer_desc, ema_every, 120, 8),
    SPLAT_FIELD(splat_optimizer_desc, ema_after, 128, 8),}
};  // clang-format on

inline const Layout kOptimizerInfo = {  // clang-format off
    "splat_optimizer_info",
    sizeof(splat_optimizer_info),
    64,
    {
    SPLAT_FIELD(splat_optimizer_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_optimizer_info, was_skipped, 4, 4),
    SPLAT_FIELD(splat_optimizer_info, step, 8, 8),
    SPLAT_FIELD(splat_optimizer_info, skipped, 16, 8),
    SPLAT_FIELD(splat_optimizer_info, rate, 24, 8),
    SPLAT_FIELD(splat_optimizer_info, non_finite, 32, 8),
    SPLAT_FIELD(splat_optimizer_info, gradients_zero, 40, 4),
    SPLAT_FIELD(splat_optimizer_info, averaged, 44, 4),
    SPLAT_FIELD(splat_optimizer_info, parameters, 48, 8),
    SPLAT_FIELD(splat_optimizer_info, elements, 56, 8),}
};  // clang-format on

}  // namespace splat::test
