#include "predict/prediction.h"

#include <gtest/gtest.h>

#include <limits>

#include "scene/activate.h"
#include "support/expect_status.h"

namespace splat::predict {
namespace {

TEST(Prediction, LeavesOutWhatNoImageShows) {
    scene::Gaussians predicted;
    const double opacities[] = {0.5, 1.0 / 300, 0.9, 0.9, 1.0 / 200};
    for (int i = 0; i < 5; ++i) {
        predicted.means.insert(predicted.means.end(), {static_cast<float>(i), 0, 1});
        predicted.log_scales.insert(predicted.log_scales.end(), {-3, -3, -3});
        predicted.rotations.insert(predicted.rotations.end(), {1, 0, 0, 0});
        predicted.opacity_logits.push_back(static_cast<float>(scene::logit_of(opacities[i])));
        predicted.sh.insert(predicted.sh.end(), {0, 0, 0});
    }
    predicted.means[3 * 2] = std::numeric_limits<float>::quiet_NaN();
    predicted.log_scales[3 * 3] = std::numeric_limits<float>::infinity();
    const auto visible = visible_of(predicted);
    ASSERT_OK(visible.status());
    EXPECT_EQ(visible.value().not_finite, 2U);
    EXPECT_EQ(visible.value().faint, 1U);
    EXPECT_EQ(visible.value().gaussians.means, (std::vector<float>{0, 0, 1, 4, 0, 1}));
}

}  // namespace
}  // namespace splat::predict
