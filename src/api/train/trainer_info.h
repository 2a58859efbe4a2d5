#pragma once

#include "splat.h"
#include "train/trainer.h"

namespace splat::api {

struct ModelObject;

splat_trainer_info info_of(const train::TrainStep& step);

/// The network of a trainer as a model, which keeps the trainer's memory alive.
std::shared_ptr<ModelObject> model_of(const std::shared_ptr<vk::Context>& context,
                                      const std::shared_ptr<train::Trainer>& trainer);

}  // namespace splat::api
