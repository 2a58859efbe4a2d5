#include <algorithm>

#include "api/api_guard.h"
#include "core/json_writer.h"
#include "data/photograph.h"

using namespace splat;

namespace {

std::string text_of(const char* text) {
    return text == nullptr ? "" : text;
}

Result<data::PhotographDesc> photograph_desc(const splat_photo_desc& from) {
    SPLAT_TRY(api::require(from.image, "splat_photo_desc.image"));
    data::PhotographDesc desc;
    desc.image = from.image;
    desc.depth = text_of(from.depth);
    desc.normal = text_of(from.normal);
    desc.mask = text_of(from.mask);
    desc.resolution = from.resolution;
    if (desc.resolution < 8 || desc.resolution > 2048)
        return error(Code::kInvalidArgument,
                     "splat_photo_desc.resolution is %u, expected 8 to 2048", desc.resolution);
    desc.crop = (from.flags & SPLAT_PHOTO_WHOLE) == 0;
    if (from.foreground != 0) desc.foreground = static_cast<double>(from.foreground);
    std::copy_n(from.background, 3, desc.background.begin());
    return desc;
}

void give_plane(const std::vector<float>& from, float* to) {
    if (to != nullptr) std::copy(from.begin(), from.end(), to);
}

std::string report_of(const data::Photograph& photo) {
    JsonWriter json;
    json.begin_object().member("width", photo.width).member("height", photo.height);
    json.member("mask", photo.mask_from).key("square").begin_array();
    for (const auto value : {photo.x, photo.y, photo.side}) json.number(value, 6);
    json.end().end();
    return json.text();
}

}  // namespace

splat_result splat_photo_read(const splat_photo_desc* desc, splat_dataset_views* out, char* buffer,
                              size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [&](auto give) -> Status {
        SPLAT_TRY(
            api::check_desc(desc, "splat_photo_desc", sizeof(splat_photo_desc), SPLAT_PHOTO_WHOLE));
        SPLAT_TRY(api::require(out, "out"));
        SPLAT_TRY(api::check_size(*out, "splat_dataset_views", sizeof(splat_dataset_views)));
        SPLAT_ASSIGN(const data::PhotographDesc from, photograph_desc(*desc));
        SPLAT_ASSIGN(const data::Photograph photo, data::read_photograph(from));
        give_plane(photo.image, out->images);
        give_plane(photo.depth, out->depths);
        give_plane(photo.normal, out->normals);
        give_plane(photo.mask, out->masks);
        return give(report_of(photo));
    });
}
