#include <algorithm>
#include <cstring>

#include "api/api_guard.h"
#include "api/handles.h"
#include "api/scene/camera_value.h"
#include "core/log.h"

using namespace splat;

namespace {

using EvaluatorPointer = std::shared_ptr<api::EvaluatorObject>;

/// A data set that is already open, with the settings of a configuration or, without a predictor, its own.
Result<std::unique_ptr<predict::ViewSource>> views_of_dataset(
    const std::shared_ptr<api::DatasetObject>& object, const config::Settings* settings) {
    const std::shared_ptr<data::Dataset> dataset(object, object->dataset.get());
    if (settings != nullptr)
        return predict::ViewSource::open(predict::without_map_losses(*settings), dataset);
    config::Settings own;
    own.network.resolution = dataset->resolution();
    own.training.white_background = dataset->background()[0] > 0;
    return predict::ViewSource::open(own, dataset);
}

Result<std::unique_ptr<predict::ViewSource>> evaluator_views(const splat_evaluator_desc& desc,
                                                             const config::Settings* settings) {
    if (desc.dataset != nullptr && desc.data_path != nullptr)
        return invalid("splat_evaluator_desc: dataset and data_path are both given, expected one");
    if (desc.dataset != nullptr && desc.split != nullptr)
        return invalid(
            "splat_evaluator_desc.split is '%s', but dataset is given, which is of the "
            "split that it was opened with: expected NULL",
            desc.split);
    if (desc.dataset != nullptr) {
        SPLAT_ASSIGN(const auto object, api::Datasets::find(desc.dataset, "desc.dataset"));
        return views_of_dataset(object, settings);
    }
    if (settings == nullptr)
        return invalid(
            "splat_evaluator_desc.dataset is NULL, expected a data set: without a "
            "predictor no configuration says how to open a folder");
    return predict::ViewSource::open(predict::without_map_losses(*settings),
                                     desc.data_path == nullptr ? "" : desc.data_path,
                                     desc.split == nullptr ? "test" : desc.split);
}

Result<eval::Protocol> evaluator_protocol(const splat_evaluator_desc& desc,
                                          const config::Settings* settings) {
    const bool listed = desc.conditioning_count > 0;
    if (desc.inputs != 0 && (settings != nullptr || listed))
        return invalid(
            "splat_evaluator_desc.inputs is %u, expected 0: the number of conditioning "
            "views is that of %s",
            desc.inputs, listed ? "conditioning" : "the predictor");
    eval::Protocol protocol;
    protocol.novel = desc.novel_views;
    protocol.objects = desc.objects;
    protocol.inputs = settings != nullptr ? settings->network.views
                      : desc.inputs != 0  ? desc.inputs
                                          : 1;
    if (!listed && desc.conditioning != nullptr)
        return invalid("splat_evaluator_desc.conditioning is given, but conditioning_count is 0");
    if (!listed) return protocol;
    SPLAT_TRY(api::require(desc.conditioning, "desc.conditioning"));
    if (settings != nullptr && desc.conditioning_count != settings->network.views)
        return invalid(
            "splat_evaluator_desc.conditioning_count is %llu, expected %u: the network's "
            "inputs",
            llu(desc.conditioning_count), settings->network.views);
    protocol.conditioning.assign(desc.conditioning, desc.conditioning + desc.conditioning_count);
    return protocol;
}

/// Looks at few objects: the cameras of all may be many files.
void warn_of_cameras(const predict::ViewSource& views) {
    for (const auto& sentence :
         {views.field_of_view_warning(std::min(views.objects(), 1U)), views.depth_range_warning()})
        // What cannot be read is an error of the scores.
        if (sentence.ok() && !sentence.value().empty()) log(LogLevel::kWarning, sentence.value());
}

Result<EvaluatorPointer> make_evaluator(const splat_evaluator_desc& desc) {
    auto object = std::make_shared<api::EvaluatorObject>();
    const config::Settings* settings = nullptr;
    eval::Evaluation labels;
    if (desc.method != nullptr) labels.method = desc.method;
    if (desc.predictor != nullptr) {
        SPLAT_ASSIGN(object->predictor, api::Predictors::find(desc.predictor, "desc.predictor"));
        settings = &object->predictor->settings;
        if (const std::uint32_t views = object->predictor->aggregation.views;
            desc.method == nullptr && views > 0)
            return invalid(
                "splat_evaluator_desc.predictor joins predictions of %u drawn views "
                "(splat_predictor_desc.aggregate), which an evaluator does not: expected 0, or a "
                "method whose images splat_evaluator_score_images gets",
                views);
        labels.weights = object->predictor->path;
        labels.device = object->predictor->context->device().info().name;
    } else if (labels.method.empty()) {
        return invalid("splat_evaluator_desc has neither a predictor nor a method, expected one");
    }
    SPLAT_ASSIGN(auto views, evaluator_views(desc, settings));
    if (desc.method == nullptr) warn_of_cameras(*views);
    SPLAT_ASSIGN(eval::Protocol protocol, evaluator_protocol(desc, settings));
    eval::Lpips lpips;
    if (desc.lpips != nullptr) {
        SPLAT_ASSIGN(object->lpips, api::Lpipses::find(desc.lpips, "desc.lpips"));
        if (object->lpips->side != views->resolution())
            return error(Code::kShape,
                         "splat_evaluator_desc.lpips is for images of %u pixels, expected %u",
                         object->lpips->side, views->resolution());
        lpips = {object->lpips->context.get(), object->lpips->net.get()};
    }
    object->evaluator = std::make_unique<eval::Evaluator>(std::move(views), std::move(protocol),
                                                          lpips, std::move(labels));
    if (desc.method == nullptr)
        SPLAT_TRY(
            object->evaluator->use(*object->predictor->context, *object->predictor->predictor));
    return object;
}

splat_scores value_of(const eval::Scores& from) {
    return {from.psnr, from.ssim, from.lpips, from.views, from.perfect};
}

splat_ledger value_of(const eval::Ledger& from) {
    return {from.outputs_not_finite,
            from.gaussians,
            from.gaussians_not_finite,
            from.invisible,
            from.visible,
            static_cast<std::uint32_t>(from.images_not_finite),
            static_cast<std::uint32_t>(from.images_blank)};
}

/// Find the evaluator, score an object with `score(evaluator)`, and give its scores.
template <class Score>
splat_result score_with(splat_evaluator evaluator, std::uint32_t object,
                        splat_object_scores* scores, Score&& score) {
    return api::with(evaluator, [&](const auto& found) -> Status {
        if (scores != nullptr) SPLAT_TRY(api::check_fill(scores, "scores"));
        SPLAT_ASSIGN(const eval::ObjectScores made, score(*found->evaluator));
        if (scores == nullptr) return {};
        splat_object_scores filled{};
        filled.object = object;
        filled.name = found->evaluator->data().name(object).c_str();
        filled.novel = value_of(made.novel);
        filled.conditioning = value_of(made.conditioning);
        filled.ledger = value_of(made.ledger);
        filled.empty_views = made.empty;
        filled.not_finite = made.ledger.finite() ? 0 : 1;
        filled.predict_ms = 1e3 * made.predict_seconds;
        filled.draw_ms = 1e3 * made.draw_seconds;
        api::give(filled, scores);
        return {};
    });
}

/// Check the room of a caller's array.
Status check_room(const void* array, std::uint64_t room, std::size_t needed, const char* member) {
    if (array == nullptr || room >= needed) return {};
    return invalid("splat_evaluated_views.%s is %llu, expected %zu or more", member, llu(room),
                   needed);
}

Status read_views(const eval::Evaluator& evaluator, std::uint32_t object,
                  splat_evaluated_views& out) {
    SPLAT_ASSIGN(const eval::EvaluatedViews which, evaluator.views(object));
    const std::vector<std::uint32_t> numbers = which.all();
    const std::size_t n = numbers.size();
    const std::uint32_t side = evaluator.data().resolution();
    const std::size_t pixels = n * 3 * side * side;
    SPLAT_TRY(check_room(out.numbers, out.number_count, n, "number_count"));
    SPLAT_TRY(check_room(out.cameras, out.camera_count, n, "camera_count"));
    SPLAT_TRY(check_room(out.images, out.image_count, pixels, "image_count"));
    SPLAT_TRY(check_room(out.drawn, out.drawn_count, pixels, "drawn_count"));
    if (out.drawn != nullptr &&
        (evaluator.drawn().size() != pixels || evaluator.drawn_object() != object))
        return bad_state("object %u is not the latest that splat_evaluator_score drew", object);
    if (out.images != nullptr || out.cameras != nullptr) {
        SPLAT_ASSIGN(const predict::Views views, evaluator.read(object));
        if (out.images != nullptr) std::copy(views.images.begin(), views.images.end(), out.images);
        if (out.cameras != nullptr)
            std::transform(views.cameras.begin(), views.cameras.end(), out.cameras,
                           [](const scene::Camera& camera) { return api::value_of(camera); });
    }
    if (out.numbers != nullptr) std::copy(numbers.begin(), numbers.end(), out.numbers);
    if (out.drawn != nullptr)
        std::copy(evaluator.drawn().begin(), evaluator.drawn().end(), out.drawn);
    out.inputs = static_cast<std::uint32_t>(which.conditioning.size());
    out.novel = static_cast<std::uint32_t>(which.novel.size());
    return {};
}

}  // namespace

splat_result splat_evaluator_create(const splat_evaluator_desc* desc, splat_evaluator* evaluator) {
    return api::create(evaluator, [&]() -> api::Evaluators::Made {
        SPLAT_TRY(api::check_desc(desc, 0));
        SPLAT_ASSIGN(EvaluatorPointer object, make_evaluator(*desc));
        return object;
    });
}

splat_result splat_evaluator_get_info(splat_evaluator evaluator, splat_evaluator_info* info) {
    return api::describe(evaluator, info, "info", [&](auto& object) {
        splat_evaluator_info filled{};
        filled.objects = object.evaluator->objects();
        filled.scored = static_cast<std::uint32_t>(object.evaluator->evaluation().objects.size());
        filled.resolution = object.evaluator->data().resolution();
        return filled;
    });
}

splat_result splat_evaluator_score(splat_evaluator evaluator, uint32_t object,
                                   splat_object_scores* scores) {
    return score_with(evaluator, object, scores,
                      [object](eval::Evaluator& found) { return found.score(object); });
}

splat_result splat_evaluator_score_images(splat_evaluator evaluator, uint32_t object,
                                          const float* images, uint64_t count,
                                          splat_object_scores* scores) {
    return score_with(evaluator, object, scores,
                      [&](eval::Evaluator& found) -> Result<eval::ObjectScores> {
                          SPLAT_TRY(api::require(images, "images"));
                          return found.score_images(object, {images, count});
                      });
}

splat_result splat_evaluator_read(splat_evaluator evaluator, uint32_t object,
                                  splat_evaluated_views* views) {
    return api::with(evaluator, [&](const auto& found) -> Status {
        SPLAT_TRY(api::require(views, "views"));
        SPLAT_TRY(api::check_size(*views));
        return read_views(*found->evaluator, object, *views);
    });
}

splat_result splat_evaluator_summary(splat_evaluator evaluator, splat_evaluation_summary* summary) {
    return api::describe(evaluator, summary, "summary", [&](auto& found) {
        const eval::Summary made = eval::summary_of(found.evaluator->evaluation());
        splat_evaluation_summary filled{};
        SPLAT_COPY(filled, made, objects, objects_not_finite, predictions_per_second,
                   images_per_second);
        filled.novel = value_of(made.novel);
        filled.conditioning = value_of(made.conditioning);
        filled.ledger = value_of(made.ledger);
        filled.empty_views = made.empty;
        return filled;
    });
}

splat_result splat_evaluator_report(splat_evaluator evaluator, char* buffer, size_t capacity,
                                    size_t* needed) {
    return api::report(evaluator, buffer, capacity, needed, [](auto& found) {
        return eval::results_text(found.evaluator->evaluation());
    });
}

splat_result splat_evaluator_load(splat_evaluator evaluator, const char* folder) {
    return api::with(evaluator, [&](const auto& found) -> Status {
        SPLAT_TRY(api::require(folder, "folder"));
        return found->evaluator->load(folder);
    });
}

splat_result splat_evaluator_save(splat_evaluator evaluator, const char* folder) {
    return api::with(evaluator, [&](const auto& found) -> Status {
        SPLAT_TRY(api::require(folder, "folder"));
        return eval::save(found->evaluator->evaluation(), folder);
    });
}
