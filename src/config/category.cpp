#include "config/category.h"

namespace splat::config {
namespace {

struct Category {
    const char* name;
    float znear, zfar, fov;
    bool white_background;
    std::uint32_t resolution;
    std::uint32_t attention;  ///< the level with attention, pixels
    bool co3d;
};

constexpr float kShapeNetFov = 51.98948897809546F;    // 131.25 pixels of 128
constexpr float kObjaverseFov = 49.134342641202636F;  // 140 pixels of 128
constexpr float kNmrFov = 29.999999290482176F;

constexpr Category kCategories[] = {
    {"cars", 0.8F, 1.8F, kShapeNetFov, true, 128, 16, false},
    {"cars_priors", 0.8F, 1.8F, kShapeNetFov, true, 128, 16, false},
    {"chairs", 1.25F, 2.75F, kShapeNetFov, true, 128, 16, false},
    {"nmr", 1.2F, 4.0F, kNmrFov, true, 64, 8, false},
    {"objaverse", 0.8F, 3.2F, kObjaverseFov, true, 128, 16, false},
    {"gso", 0.8F, 3.2F, kObjaverseFov, true, 128, 16, false},
    {"hydrants", -2.0F, 2.0F, 0.0F, false, 128, 16, true},
    {"teddybears", -2.0F, 2.0F, 0.0F, false, 128, 16, true},
};

constexpr const char* kCategoryKeys[] = {"data.znear",
                                         "data.zfar",
                                         "data.fov",
                                         "data.white_background",
                                         "data.origin_distances",
                                         "data.training_resolution",
                                         "model.attention_resolutions",
                                         "opt.scale_terms"};

const Category* find_category(const std::string& name) {
    for (const Category& category : kCategories)
        if (name == category.name) return &category;
    return nullptr;
}

}  // namespace

bool is_co3d_category(const std::string& category) {
    const Category* found = find_category(category);
    return found != nullptr && found->co3d;
}

void take_category_defaults(const std::string& category, Settings& settings) {
    const Category* found = find_category(category);
    if (found == nullptr) return;
    settings.network.znear = found->znear;
    settings.network.zfar = found->zfar;
    settings.network.fov_degrees = found->fov;
    settings.network.origin_distance = found->co3d;
    settings.network.resolution = found->resolution;
    settings.network.attention_resolutions = {found->attention};
    settings.training.white_background = found->white_background;
    settings.training.scale_terms = found->co3d;
}

std::span<const char* const> category_keys() {
    return kCategoryKeys;
}

}  // namespace splat::config
