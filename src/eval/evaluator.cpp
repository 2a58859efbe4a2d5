#include "eval/evaluator.h"

#include <algorithm>
#include <mutex>

#include "data/dataset.h"
#include "eval/saved_objects.h"

namespace splat::eval {

Evaluator::Evaluator(std::unique_ptr<predict::ViewSource> data, Protocol protocol,
                     const Lpips& lpips, Evaluation evaluation)
    : data_(std::move(data)),
      protocol_(std::move(protocol)),
      lpips_(lpips),
      evaluation_(std::move(evaluation)),
      objects_(protocol_.objects == 0 ? data_->objects()
                                      : std::min(protocol_.objects, data_->objects())) {
    const data::DatasetIndex& index = data_->dataset().index();
    evaluation_.format = index.format;
    evaluation_.split = index.split;
    evaluation_.data_objects = data_->objects();
    bool all = true;  // so many novel views as asked for, or fewer, are there
    for (std::uint32_t i = 0; protocol_.novel != 0 && i < objects_; ++i)
        all = all && data_->views_of(i) <= std::uint64_t{protocol_.inputs} + protocol_.novel;
    std::string given;
    for (const std::uint32_t view : protocol_.conditioning) given += format(" %u", view);
    evaluation_.views =
        format("%u inputs%s%s, %s novel%s", protocol_.inputs, given.empty() ? "" : ":",
               given.c_str(), all ? "all" : std::to_string(protocol_.novel).c_str(),
               lpips_.net == nullptr ? "" : ", LPIPS");
}

Status Evaluator::use(vk::Context& context, predict::Predictor& predictor) {
    const std::lock_guard lock(context.mutex);
    SPLAT_ASSIGN(evaluation_.network, predictor.checksum());
    context_ = &context;
    predictor_ = &predictor;
    return {};
}

Result<EvaluatedViews> Evaluator::views(std::uint32_t object) const {
    if (object >= objects_)
        return invalid("object %u does not exist: there are %u to score", object, objects_);
    const std::uint32_t count = data_->views_of(object);
    if (!protocol_.conditioning.empty())
        return evaluated_views(count, protocol_.conditioning, protocol_.novel);
    const std::vector<std::uint32_t>& sources = data_->dataset().index().source_views;
    if (!sources.empty())
        return evaluated_views_from(sources[object], count, protocol_.inputs, protocol_.novel);
    return evaluated_views(count, protocol_.inputs, protocol_.novel, evaluation_.format);
}

Result<predict::Views> Evaluator::read(std::uint32_t object) const {
    SPLAT_ASSIGN(const EvaluatedViews which, views(object));
    return data_->read(object, which.all(), static_cast<std::uint32_t>(which.conditioning.size()));
}

Status Evaluator::load(const std::string& folder) {
    std::map<std::string, std::uint32_t> numbers;
    for (std::uint32_t i = 0; i < objects_; ++i) numbers.emplace(data_->name(i), i);
    SPLAT_ASSIGN(auto loaded,
                 load_objects(folder, evaluation(),
                              [&](const std::string& name) -> std::optional<std::uint32_t> {
                                  const auto found = numbers.find(name);
                                  if (found == numbers.end()) return std::nullopt;
                                  return found->second;
                              }));
    for (const auto& [object, scores] : loaded) keep(object, scores);
    return {};
}

Result<ObjectScores> Evaluator::score(std::uint32_t object) {
    if (predictor_ == nullptr)
        return bad_state("the evaluator has no network: it scores the caller's images of '%s'",
                         evaluation_.method.c_str());
    SPLAT_ASSIGN(const EvaluatedViews which, views(object));
    drawn_.clear();
    SPLAT_ASSIGN(ObjectScores scores,
                 score_object(*context_, *predictor_, *data_, object, which, lpips_, &drawn_));
    drawn_object_ = object;
    keep(object, scores);
    return scores;
}

Result<ObjectScores> Evaluator::score_images(std::uint32_t object, std::span<const float> images) {
    SPLAT_ASSIGN(const EvaluatedViews which, views(object));
    SPLAT_ASSIGN(const predict::Views read, this->read(object));
    ObjectScores scores;
    scores.name = data_->name(object);
    SPLAT_TRY(eval::score_images(lpips_, images, read, which, data_->resolution(), scores));
    keep(object, scores);
    return scores;
}

void Evaluator::keep(std::uint32_t object, const ObjectScores& scores) {
    const std::lock_guard lock(*mutex_);
    evaluation_.objects[object] = scores;
}

}  // namespace splat::eval
