#include <algorithm>

#include "api/api_guard.h"
#include "api/core/image_view.h"
#include "api/predict/picture_arguments.h"

using namespace splat;

namespace {

/// A square to fill; empty where the caller wants none.
Result<std::optional<api::ImageView>> cut_target(const splat_image& image, const char* name,
                                                 std::uint32_t side, std::uint32_t channels) {
    if (image.pixels == nullptr) return std::optional<api::ImageView>();
    SPLAT_ASSIGN(const api::ImageView view, api::image_to_fill(&image, name));
    SPLAT_TRY(api::check_image_size(view, name, side, side, channels));
    return std::optional(view);
}

/// One of the squares of splat_picture_cut_desc.
struct CutTarget {
    const char* name;
    splat_image splat_picture_cut_desc::*image;
    std::uint32_t channels;
    std::vector<float> data::Photograph::*planes;
    std::optional<data::NamedImage> data::Picture::*map;  ///< map that it needs; nullptr: none
};

constexpr CutTarget kTargets[] = {
    {"desc.image", &splat_picture_cut_desc::image, 3, &data::Photograph::image, nullptr},
    {"desc.mask", &splat_picture_cut_desc::mask, 1, &data::Photograph::mask, nullptr},
    {"desc.depth", &splat_picture_cut_desc::depth, 1, &data::Photograph::depth,
     &data::Picture::depth},
    {"desc.normal", &splat_picture_cut_desc::normal, 3, &data::Photograph::normal,
     &data::Picture::normal}};

}  // namespace

splat_result splat_picture_cut(const splat_picture* picture, const splat_picture_cut_desc* desc,
                               splat_picture_info* info) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(picture, "picture"));
        SPLAT_TRY(api::check_desc(desc, 0));
        if (desc->resolution < 8 || desc->resolution > 2048)
            return invalid("splat_picture_cut_desc.resolution is %u, expected 8 to 2048",
                           desc->resolution);
        SPLAT_ASSIGN(const predict::PictureInput input, api::picture_input(*picture, "picture"));
        std::vector<std::optional<api::ImageView>> views;
        for (const CutTarget& target : kTargets) {
            SPLAT_ASSIGN(const auto view, cut_target(desc->*target.image, target.name,
                                                     desc->resolution, target.channels));
            if (view && target.map != nullptr && !(input.picture.*target.map))
                return invalid("%s has pixels, but the picture has no such map", target.name);
            views.push_back(view);
        }
        data::CutOptions options{desc->resolution, input.crop, input.foreground, {}};
        std::copy_n(desc->background, 3, options.background.begin());
        SPLAT_ASSIGN(const data::Photograph photo, data::cut_photograph(input.picture, options));
        for (std::size_t i = 0; i < std::size(kTargets); ++i)
            if (views[i]) api::fill_planes(*views[i], (photo.*kTargets[i].planes).data());
        if (info != nullptr) *info = api::info_of(predict::facts_of(photo, input), false);
        return {};
    });
}
