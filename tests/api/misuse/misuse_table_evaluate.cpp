#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

/// Images of the views of one object of the table's data set.
constexpr std::uint64_t kNumbers = 3 * 3 * 8 * 8;
const float kImages[kNumbers] = {};

}  // namespace

void MisuseTable::evaluator_rows() {
    const auto invalid = wrong_descs<splat_evaluator_desc>("splat_evaluator_create");
    invalid("neither predictor nor method", kArgument, [](auto& d) { d.method = nullptr; });
    invalid("a data set and a path", kArgument, [](auto& d) { d.data_path = "cars"; });
    invalid("a split with a data set", kArgument, [](auto& d) { d.split = "test"; });
    static const std::uint32_t first[] = {0};
    invalid("conditioning views without a count", kArgument,
            [](auto& d) { d.conditioning = first; });
    invalid("conditioning views and their number", kArgument, [](auto& d) {
        d.conditioning = first;
        d.conditioning_count = d.inputs = 1;
    });
    invalid("no data set without a predictor", kArgument, [](auto& d) { d.dataset = nullptr; });
    invalid("a count without conditioning views", kArgument,
            [](auto& d) { d.conditioning_count = 1; });
    invalid("no predictor", kHandle, [this](auto& d) { d.predictor = stale<splat_predictor>(); });
    invalid("no LPIPS", kHandle,
            [this](auto& d) { d.lpips = reinterpret_cast<splat_lpips>(stale<splat_predictor>()); });
    invalid("no data set", kHandle, [this](auto& d) { d.dataset = stale<splat_dataset>(); });
    invalid("a data set of another resolution", kArgument,
            [this](auto& d) { d.predictor = predictor_; });
    add("splat_evaluator_save", "folder", "that cannot be made", SPLAT_ERROR_IO,
        [this] { return splat_evaluator_save(evaluator_, "/dev/null/eval"); });
}

void MisuseTable::evaluator_load_rows() {
    add("splat_evaluator_load", "folder", "without scores", kNotFound,
        [this] { return splat_evaluator_load(evaluator_, "/nowhere"); });
}

void MisuseTable::evaluator_score_rows() {
    add("splat_evaluator_score", "evaluator", "of the caller's images", kState,
        [this] { return splat_evaluator_score(evaluator_, 0, out<splat_object_scores>()); });
    const auto images = [this](std::uint32_t object, const float* given, std::uint64_t count) {
        return splat_evaluator_score_images(evaluator_, object, given, count,
                                            out<splat_object_scores>());
    };
    for (const std::uint64_t count : {std::uint64_t{0}, kNumbers - 1})
        add("splat_evaluator_score_images", "count", "too small", SPLAT_ERROR_SHAPE_MISMATCH,
            [images, count] { return images(0, kImages, count); });
    for (const std::uint32_t object : {2U, UINT32_MAX}) {
        add("splat_evaluator_score", "object", "beyond the last", kState, [this, object] {
            return splat_evaluator_score(evaluator_, object, out<splat_object_scores>());
        });
        add("splat_evaluator_score_images", "object", "beyond the last", kArgument,
            [images, object] { return images(object, kImages, kNumbers); });
        add("splat_evaluator_read", "object", "beyond the last", kArgument, [this, object] {
            auto views = sized<splat_evaluated_views>();
            return splat_evaluator_read(evaluator_, object, &views);
        });
    }
    for (const std::uint32_t size : {0U, 8U}) {
        auto scores = sized<splat_object_scores>();
        scores.struct_size = size;
        add("splat_evaluator_score", "scores", "a struct_size of no version", kArgument,
            [this, scores]() mutable { return splat_evaluator_score(evaluator_, 0, &scores); });
        add("splat_evaluator_score_images", "scores", "a struct_size of no version", kArgument,
            [this, scores]() mutable {
                return splat_evaluator_score_images(evaluator_, 0, kImages, kNumbers, &scores);
            });
        add("splat_evaluator_read", "views", "a struct_size of no version", kArgument,
            [this, size] {
                auto views = sized<splat_evaluated_views>();
                views.struct_size = size;
                return splat_evaluator_read(evaluator_, 0, &views);
            });
    }
    add("splat_evaluator_read", "views", "an array that is too short", kArgument, [this] {
        auto views = sized<splat_evaluated_views>();
        std::uint32_t numbers[2];
        views.numbers = numbers;
        views.number_count = 2;
        return splat_evaluator_read(evaluator_, 0, &views);
    });
    add("splat_evaluator_read", "views", "images that were not drawn", kState, [this] {
        auto views = sized<splat_evaluated_views>();
        std::vector<float> drawn(kNumbers);
        views.drawn = drawn.data();
        views.drawn_count = drawn.size();
        return splat_evaluator_read(evaluator_, 0, &views);
    });
}

void MisuseTable::comparison_rows() {
    const auto invalid = wrong_descs<splat_compare_desc>("splat_compare_scores");
    static const splat_score nameless[] = {{nullptr, 1, 1, 1}};
    static const splat_score twice[] = {{"x", 1, 1, 1}, {"x", 2, 1, 1}};
    static const splat_score others[] = {{"z", 1, 1, 1}};
    invalid("no scores", kArgument, [](auto& d) { d.a.score_count = 0; });
    invalid("NULL with a count", kArgument, [](auto& d) { d.b.scores = nullptr; });
    invalid("a path and scores", kArgument, [](auto& d) { d.a.path = "scores.txt"; });
    invalid("an object without a name", kArgument, [](auto& d) { d.a = {nullptr, nameless, 1}; });
    invalid("an object twice", kArgument, [](auto& d) { d.b = {nullptr, twice, 2}; });
    invalid("other objects", kNotFound, [](auto& d) { d.b = {nullptr, others, 1}; });
    invalid("no file", kNotFound, [](auto& d) { d.b = {"/nowhere/scores.txt", nullptr, 0}; });
    for (const std::uint32_t index : {3U, UINT32_MAX}) {
        add("splat_comparison_metric", "index", "beyond the last", kArgument, [this, index] {
            return splat_comparison_metric(comparison_, index, out<splat_metric_comparison>());
        });
        add("splat_comparison_samples", "index", "beyond the last", kArgument, [this, index] {
            return splat_comparison_samples(comparison_, index, nullptr, 0, nullptr, 0);
        });
    }
    for (const char* parameter : {"a", "b"})
        add("splat_comparison_samples", parameter, "NULL: not wanted", SPLAT_OK,
            [this] { return splat_comparison_samples(comparison_, 0, nullptr, 0, nullptr, 0); });
    add("splat_comparison_samples", "a_count", "too small", kArgument, [this] {
        double a[2];
        return splat_comparison_samples(comparison_, 0, a, 1, nullptr, 0);
    });
    add("splat_comparison_samples", "b_count", "too small", kArgument, [this] {
        double b[2];
        return splat_comparison_samples(comparison_, 0, nullptr, 0, b, 1);
    });
}

}  // namespace splat::test
