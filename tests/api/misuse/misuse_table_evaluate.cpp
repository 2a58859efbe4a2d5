// The rows of evaluations and comparisons.
#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

/// Images of the views of one object of the table's data set.
constexpr std::uint64_t kNumbers = 3 * 3 * 8 * 8;
const float kImages[kNumbers] = {};

template <class Struct>
Struct of_size(std::uint32_t size) {
    auto made = sized<Struct>();
    made.struct_size = size;
    return made;
}

}  // namespace

void MisuseTable::evaluator_rows() {
    const auto invalid = wrong_structs<splat_evaluator_desc>("splat_evaluator_create");
    static const std::uint32_t first[] = {0};
    invalid("neither predictor nor method", kArgument, [](auto& d) { d.method = nullptr; });
    invalid("a data set and a path", kArgument, [](auto& d) { d.data_path = "cars"; });
    invalid("a split with a data set", kArgument, [](auto& d) { d.split = "test"; });
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
    SPLAT_WRONG(splat_evaluator_save).each("folder", "that cannot be made", kIo, "/dev/null/eval");
    SPLAT_WRONG(splat_evaluator_load).each("folder", "without scores", kNotFound, "/nowhere");
    SPLAT_WRONG(splat_evaluator_score)
        .as_is("evaluator", "of the caller's images", kState)
        .each("object", "beyond the last", kState, 2U, UINT32_MAX)
        .each("scores", "a struct_size of no version", kArgument, of_size<splat_object_scores>(0),
              of_size<splat_object_scores>(8));
    SPLAT_WRONG(splat_evaluator_score_images)
        .given("images", kImages)
        .given("count", kNumbers)
        .each("count", "too small", kShape, 0, kNumbers - 1)
        .each("object", "beyond the last", kArgument, 2U, UINT32_MAX)
        .each("scores", "a struct_size of no version", kArgument, of_size<splat_object_scores>(0),
              of_size<splat_object_scores>(8));
    static std::uint32_t numbers[2];
    static float drawn[kNumbers];
    auto few = sized<splat_evaluated_views>(), not_drawn = few;
    few.numbers = numbers;
    few.number_count = 2;
    not_drawn.drawn = drawn;
    not_drawn.drawn_count = kNumbers;
    SPLAT_WRONG(splat_evaluator_read)
        .each("object", "beyond the last", kArgument, 2U, UINT32_MAX)
        .each("views", "a struct_size of no version", kArgument, of_size<splat_evaluated_views>(0),
              of_size<splat_evaluated_views>(8))
        .each("views", "an array that is too short", kArgument, few)
        .each("views", "images that were not drawn", kState, not_drawn);
}

void MisuseTable::comparison_rows() {
    const auto invalid = wrong_structs<splat_compare_desc>("splat_compare_scores");
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
    SPLAT_WRONG(splat_comparison_metric)
        .each("index", "beyond the last", kArgument, 3U, UINT32_MAX);
    static double values[2];
    const auto samples = SPLAT_WRONG(splat_comparison_samples)
                             .given("a", nullptr)
                             .given("a_count", 0)
                             .given("b", nullptr)
                             .given("b_count", 0);
    samples.each("index", "beyond the last", kArgument, 3U, UINT32_MAX)
        .as_is("a", "NULL: not wanted", SPLAT_OK)
        .as_is("b", "NULL: not wanted", SPLAT_OK);
    samples.given("a", &values[0]).each("a_count", "too small", kArgument, 1);
    samples.given("b", &values[0]).each("b_count", "too small", kArgument, 1);
}

}  // namespace splat::test
