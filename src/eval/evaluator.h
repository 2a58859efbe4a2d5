#pragma once

#include <memory>
#include <mutex>

#include "eval/evaluation.h"

namespace splat::eval {

/// What is scored and how.
struct Protocol {
    std::vector<std::uint32_t> conditioning;  ///< views per object; empty: the data format's
    std::uint32_t inputs = 1;                 ///< conditioning views, unless they are given
    std::uint32_t novel = 0;                  ///< novel views of an object, evenly spread; 0: all
    std::uint32_t objects = 0;                ///< the first ones; 0: all
};

/// Scores the objects of a data set, one per call. Not thread-safe, except where a function says so; it locks
/// the context for each operation of the device.
class Evaluator {
  public:
    /// Score images of the caller.
    Evaluator(std::unique_ptr<predict::ViewSource> data, Protocol protocol, const Lpips& lpips,
              Evaluation evaluation);

    /// Let a predictor draw the images. It must outlive the evaluator, as the network of LPIPS. Errors: those of
    /// Predictor::checksum().
    Status use(vk::Context& context, predict::Predictor& predictor);

    /// Objects to score.
    [[nodiscard]] std::uint32_t objects() const { return objects_; }
    [[nodiscard]] const predict::ViewSource& data() const { return *data_; }
    /// A copy of the scores so far. Thread-safe, and never waits for score().
    [[nodiscard]] Evaluation evaluation() const {
        const std::lock_guard lock(*mutex_);
        return evaluation_;
    }

    /// The views of an object that are scored. Errors: kInvalidArgument for no such object; those of
    /// evaluated_views().
    Result<EvaluatedViews> views(std::uint32_t object) const;

    /// Read these views of the data set. Errors: those of views() and of ViewSource::read.
    Result<predict::Views> read(std::uint32_t object) const;

    /// Predict, draw and score an object. Errors: kInvalidState without a network; those of read() and
    /// of the device.
    Result<ObjectScores> score(std::uint32_t object);

    /// Score images [n,3,R,R] of views(object), conditioning ones first. Errors: kShape for another number
    /// of images; those of read() and of the device.
    Result<ObjectScores> score_images(std::uint32_t object, std::span<const float> images);

    /// Take over the objects of a saved evaluation, by their names. Errors: those of load_objects().
    Status load(const std::string& folder);

    /// What score() drew of its latest object, [n,3,R,R]; empty before.
    [[nodiscard]] const std::vector<float>& drawn() const { return drawn_; }
    [[nodiscard]] std::uint32_t drawn_object() const { return drawn_object_; }

  private:
    void keep(std::uint32_t object, const ObjectScores& scores);

    std::unique_ptr<predict::ViewSource> data_;
    Protocol protocol_;
    Lpips lpips_;
    vk::Context* context_ = nullptr;  ///< device of the network
    predict::Predictor* predictor_ = nullptr;
    std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();  ///< guards evaluation_
    Evaluation evaluation_;
    std::uint32_t objects_;
    std::vector<float> drawn_;
    std::uint32_t drawn_object_ = 0;
};

}  // namespace splat::eval
