// A real network: IS-Net on renders whose alpha is the true mask.
#include <gtest/gtest.h>

#include <cstdlib>

#include "io/photo/image_file.h"
#include "prior_models/prior_model.h"
#include "support/expect_status.h"
#include "support/real_data.h"

namespace splat::prior_models {
namespace {

TEST(IsNet, CutsTheCarOutOfFiveViews) {
    SPLAT_NEEDS_REAL_DATA();
    const auto model =
        need(PriorModel::create({"isnet-imgly", std::getenv("SPLAT_ISNET_MODEL"), "", 0}));
    WantedMaps wanted;
    wanted[data::MapKind::kMask] = MapForm::kBytes;
    for (const char* view : {"00", "03", "08", "12", "22"}) {
        const std::string path = *test::real_data_folder() + "/shapenet_views/rgb/" + view + ".png";
        const io::Image picture = io::load_image(path).value();
        ASSERT_EQ(picture.channels, 4U) << path;
        const auto maps = need(model->run({&picture, 1}, {&wanted, 1}));
        const std::vector<float>& mask = maps[0][data::MapKind::kMask]->values;
        double both = 0, either = 0, found = 0, truth = 0, error = 0;
        for (std::size_t i = 0; i < mask.size(); ++i) {
            const bool object = picture.samples[4 * i + 3] > 0, inside = mask[i] > 127.5F;
            both += object && inside ? 1 : 0;
            either += object || inside ? 1 : 0;
            found += inside ? 1 : 0;
            truth += object ? 1 : 0;
            error += std::abs(static_cast<double>(mask[i]) / 255 - (object ? 1 : 0));
        }
        const double precision = both / found, recall = both / truth;
        EXPECT_GE(both / either, 0.93) << view;
        EXPECT_GE(1.3 * precision * recall / (0.3 * precision + recall), 0.98) << view;
        EXPECT_LE(error / static_cast<double>(mask.size()), 0.008) << view;
    }
}

}  // namespace
}  // namespace splat::prior_models
