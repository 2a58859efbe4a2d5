#pragma once

#include "prior_models/prior_model.h"

namespace splat::api {

/// The object behind splat_prior_model. Never changes.
struct PriorModelObject {
    std::unique_ptr<prior_models::PriorModel> model;
    bool numbers = false;          ///< SPLAT_PRIOR_MODEL_NUMBERS
    std::uint32_t generation = 0;  ///< fork_generation() when it was made: threads do not fork
};

}  // namespace splat::api
