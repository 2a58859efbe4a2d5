// The frozen layouts of evaluations and comparisons.
#pragma once

#include "api/layout/layout.h"

namespace splat::test {

inline const Layout kEvaluatorDesc = {  // clang-format off
    "splat_evaluator_desc",
    sizeof(splat_evaluator_desc),
    96,
    {
    SPLAT_FIELD(splat_evaluator_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_evaluator_desc, flags, 4, 4),
    SPLAT_FIELD(splat_evaluator_desc, next, 8, 8),
    SPLAT_FIELD(splat_evaluator_desc, predictor, 16, 8),
    SPLAT_FIELD(splat_evaluator_desc, dataset, 24, 8),
    SPLAT_FIELD(splat_evaluator_desc, data_path, 32, 8),
    SPLAT_FIELD(splat_evaluator_desc, split, 40, 8),
    SPLAT_FIELD(splat_evaluator_desc, method, 48, 8),
    SPLAT_FIELD(splat_evaluator_desc, lpips, 56, 8),
    SPLAT_FIELD(splat_evaluator_desc, conditioning, 64, 8),
    SPLAT_FIELD(splat_evaluator_desc, conditioning_count, 72, 8),
    SPLAT_FIELD(splat_evaluator_desc, inputs, 80, 4),
    SPLAT_FIELD(splat_evaluator_desc, novel_views, 84, 4),
    SPLAT_FIELD(splat_evaluator_desc, objects, 88, 4),
    SPLAT_FIELD(splat_evaluator_desc, reserved, 92, 4),}
};  // clang-format on

inline const Layout kEvaluatorInfo = {  // clang-format off
    "splat_evaluator_info",
    sizeof(splat_evaluator_info),
    16,
    {
    SPLAT_FIELD(splat_evaluator_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_evaluator_info, objects, 4, 4),
    SPLAT_FIELD(splat_evaluator_info, scored, 8, 4),
    SPLAT_FIELD(splat_evaluator_info, resolution, 12, 4),}
};  // clang-format on

inline const Layout kScores = {  // clang-format off
    "splat_scores",
    sizeof(splat_scores),
    32,
    {
    SPLAT_FIELD(splat_scores, psnr, 0, 8),
    SPLAT_FIELD(splat_scores, ssim, 8, 8),
    SPLAT_FIELD(splat_scores, lpips, 16, 8),
    SPLAT_FIELD(splat_scores, views, 24, 4),
    SPLAT_FIELD(splat_scores, perfect_views, 28, 4),}
};  // clang-format on

inline const Layout kLedger = {  // clang-format off
    "splat_ledger",
    sizeof(splat_ledger),
    48,
    {
    SPLAT_FIELD(splat_ledger, outputs_not_finite, 0, 8),
    SPLAT_FIELD(splat_ledger, gaussians, 8, 8),
    SPLAT_FIELD(splat_ledger, gaussians_not_finite, 16, 8),
    SPLAT_FIELD(splat_ledger, gaussians_invisible, 24, 8),
    SPLAT_FIELD(splat_ledger, gaussians_visible, 32, 8),
    SPLAT_FIELD(splat_ledger, images_not_finite, 40, 4),
    SPLAT_FIELD(splat_ledger, images_blank, 44, 4),}
};  // clang-format on

inline const Layout kObjectScores = {  // clang-format off
    "splat_object_scores",
    sizeof(splat_object_scores),
    152,
    {
    SPLAT_FIELD(splat_object_scores, struct_size, 0, 4),
    SPLAT_FIELD(splat_object_scores, object, 4, 4),
    SPLAT_FIELD(splat_object_scores, name, 8, 8),
    SPLAT_FIELD(splat_object_scores, novel, 16, 32),
    SPLAT_FIELD(splat_object_scores, conditioning, 48, 32),
    SPLAT_FIELD(splat_object_scores, ledger, 80, 48),
    SPLAT_FIELD(splat_object_scores, empty_views, 128, 4),
    SPLAT_FIELD(splat_object_scores, not_finite, 132, 4),
    SPLAT_FIELD(splat_object_scores, predict_ms, 136, 8),
    SPLAT_FIELD(splat_object_scores, draw_ms, 144, 8),}
};  // clang-format on

inline const Layout kEvaluatedViews = {  // clang-format off
    "splat_evaluated_views",
    sizeof(splat_evaluated_views),
    80,
    {
    SPLAT_FIELD(splat_evaluated_views, struct_size, 0, 4),
    SPLAT_FIELD(splat_evaluated_views, inputs, 4, 4),
    SPLAT_FIELD(splat_evaluated_views, novel, 8, 4),
    SPLAT_FIELD(splat_evaluated_views, reserved, 12, 4),
    SPLAT_FIELD(splat_evaluated_views, numbers, 16, 8),
    SPLAT_FIELD(splat_evaluated_views, number_count, 24, 8),
    SPLAT_FIELD(splat_evaluated_views, cameras, 32, 8),
    SPLAT_FIELD(splat_evaluated_views, camera_count, 40, 8),
    SPLAT_FIELD(splat_evaluated_views, images, 48, 8),
    SPLAT_FIELD(splat_evaluated_views, image_count, 56, 8),
    SPLAT_FIELD(splat_evaluated_views, drawn, 64, 8),
    SPLAT_FIELD(splat_evaluated_views, drawn_count, 72, 8),}
};  // clang-format on

inline const Layout kEvaluationSummary = {  // clang-format off
    "splat_evaluation_summary",
    sizeof(splat_evaluation_summary),
    144,
    {
    SPLAT_FIELD(splat_evaluation_summary, struct_size, 0, 4),
    SPLAT_FIELD(splat_evaluation_summary, objects, 4, 4),
    SPLAT_FIELD(splat_evaluation_summary, novel, 8, 32),
    SPLAT_FIELD(splat_evaluation_summary, conditioning, 40, 32),
    SPLAT_FIELD(splat_evaluation_summary, ledger, 72, 48),
    SPLAT_FIELD(splat_evaluation_summary, empty_views, 120, 4),
    SPLAT_FIELD(splat_evaluation_summary, objects_not_finite, 124, 4),
    SPLAT_FIELD(splat_evaluation_summary, predictions_per_second, 128, 8),
    SPLAT_FIELD(splat_evaluation_summary, images_per_second, 136, 8),}
};  // clang-format on

inline const Layout kScore = {  // clang-format off
    "splat_score",
    sizeof(splat_score),
    32,
    {
    SPLAT_FIELD(splat_score, object, 0, 8),
    SPLAT_FIELD(splat_score, psnr, 8, 8),
    SPLAT_FIELD(splat_score, ssim, 16, 8),
    SPLAT_FIELD(splat_score, lpips, 24, 8),}
};  // clang-format on

inline const Layout kScoreSet = {  // clang-format off
    "splat_score_set",
    sizeof(splat_score_set),
    24,
    {
    SPLAT_FIELD(splat_score_set, path, 0, 8),
    SPLAT_FIELD(splat_score_set, scores, 8, 8),
    SPLAT_FIELD(splat_score_set, score_count, 16, 8),}
};  // clang-format on

inline const Layout kCompareDesc = {  // clang-format off
    "splat_compare_desc",
    sizeof(splat_compare_desc),
    80,
    {
    SPLAT_FIELD(splat_compare_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_compare_desc, flags, 4, 4),
    SPLAT_FIELD(splat_compare_desc, next, 8, 8),
    SPLAT_FIELD(splat_compare_desc, a, 16, 24),
    SPLAT_FIELD(splat_compare_desc, b, 40, 24),
    SPLAT_FIELD(splat_compare_desc, seed, 64, 8),
    SPLAT_FIELD(splat_compare_desc, resamples, 72, 4),
    SPLAT_FIELD(splat_compare_desc, bootstraps, 76, 4),}
};  // clang-format on

inline const Layout kComparisonInfo = {  // clang-format off
    "splat_comparison_info",
    sizeof(splat_comparison_info),
    40,
    {
    SPLAT_FIELD(splat_comparison_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_comparison_info, metrics, 4, 4),
    SPLAT_FIELD(splat_comparison_info, objects_a, 8, 8),
    SPLAT_FIELD(splat_comparison_info, objects_b, 16, 8),
    SPLAT_FIELD(splat_comparison_info, shared_objects, 24, 8),
    SPLAT_FIELD(splat_comparison_info, unpaired, 32, 4),
    SPLAT_FIELD(splat_comparison_info, comparable, 36, 4),}
};  // clang-format on

inline const Layout kMetricComparison = {  // clang-format off
    "splat_metric_comparison",
    sizeof(splat_metric_comparison),
    120,
    {
    SPLAT_FIELD(splat_metric_comparison, struct_size, 0, 4),
    SPLAT_FIELD(splat_metric_comparison, metric, 4, 4),
    SPLAT_FIELD(splat_metric_comparison, verdict, 8, 4),
    SPLAT_FIELD(splat_metric_comparison, exact, 12, 4),
    SPLAT_FIELD(splat_metric_comparison, mean_a, 16, 8),
    SPLAT_FIELD(splat_metric_comparison, mean_b, 24, 8),
    SPLAT_FIELD(splat_metric_comparison, difference, 32, 8),
    SPLAT_FIELD(splat_metric_comparison, p_permutation, 40, 8),
    SPLAT_FIELD(splat_metric_comparison, p_parametric, 48, 8),
    SPLAT_FIELD(splat_metric_comparison, p_holm, 56, 8),
    SPLAT_FIELD(splat_metric_comparison, low, 64, 8),
    SPLAT_FIELD(splat_metric_comparison, high, 72, 8),
    SPLAT_FIELD(splat_metric_comparison, effect, 80, 8),
    SPLAT_FIELD(splat_metric_comparison, n_a, 88, 8),
    SPLAT_FIELD(splat_metric_comparison, n_b, 96, 8),
    SPLAT_FIELD(splat_metric_comparison, lacking_a, 104, 8),
    SPLAT_FIELD(splat_metric_comparison, lacking_b, 112, 8),}
};  // clang-format on

}  // namespace splat::test
