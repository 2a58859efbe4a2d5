#include "api/predict/picture_arguments.h"

#include <algorithm>

#include "api/api_guard.h"
#include "api/core/image_view.h"
#include "core/json_writer.h"

namespace splat::api {
namespace {

/// The decoded image of a source, if there is one.
Status read_source(const splat_picture_source& source, const std::string& name,
                   std::optional<data::NamedImage>& to) {
    if (source.path != nullptr && source.pixels.pixels != nullptr)
        return error(Code::kInvalidArgument, "%s has a path and pixels, expected one of them",
                     name.c_str());
    if (source.path != nullptr) {
        SPLAT_ASSIGN(to, data::load_picture(source.path));
    } else if (source.pixels.pixels != nullptr) {
        SPLAT_ASSIGN(const ImageView view,
                     image_to_read(&source.pixels, (name + ".pixels").c_str()));
        to = data::NamedImage{image_of(view), name};
    }
    return {};
}

Status read_array(const float* values, std::uint64_t count, const std::string& name,
                  std::vector<float>& to) {
    if (count == 0) return {};
    SPLAT_TRY(require(values, name.c_str()));
    to.assign(values, values + count);
    return {};
}

}  // namespace

Result<predict::PictureInput> picture_input(const splat_picture& from, const std::string& name) {
    if ((from.flags & ~std::uint32_t{SPLAT_PICTURE_WHOLE}) != 0)
        return error(Code::kInvalidArgument, "%s.flags has unknown bits %#x", name.c_str(),
                     from.flags & ~std::uint32_t{SPLAT_PICTURE_WHOLE});
    predict::PictureInput input;
    std::optional<data::NamedImage> image;
    SPLAT_TRY(read_source(from.image, name + ".image", image));
    if (!image)
        return error(Code::kInvalidArgument, "%s.image has neither a path nor pixels",
                     name.c_str());
    input.picture.image = std::move(*image);
    SPLAT_TRY(read_source(from.mask, name + ".mask", input.picture.mask));
    SPLAT_TRY(read_source(from.depth, name + ".depth", input.picture.depth));
    SPLAT_TRY(read_source(from.normal, name + ".normal", input.picture.normal));
    input.crop = (from.flags & SPLAT_PICTURE_WHOLE) == 0;
    if (from.foreground != 0) input.foreground = static_cast<double>(from.foreground);
    input.focal = from.focal;
    input.origin_distance = from.origin_distance;
    const auto* const pose = from.world_to_camera;
    if (std::any_of(pose, pose + 16, [](double value) { return value != 0; })) {
        input.world_to_camera.emplace();
        std::copy_n(pose, 16, input.world_to_camera->begin());
    }
    SPLAT_TRY(
        read_array(from.embedding, from.embedding_count, name + ".embedding", input.embedding));
    SPLAT_TRY(read_array(from.tokens, from.token_count, name + ".tokens", input.tokens));
    return input;
}

std::vector<std::string> picture_warnings(const splat_picture_info& info) {
    std::vector<std::string> warnings;
    if ((info.warnings & SPLAT_PICTURE_NO_OBJECT) != 0)
        warnings.emplace_back(
            "no object was found in the picture, so all of it counts as the object: give a mask "
            "or a picture with a plain border, or take it whole");
    if ((info.warnings & SPLAT_PICTURE_FIELD_OF_VIEW) != 0)
        warnings.push_back(format(
            "the square has a field of view of %.3g degrees, unlike the network's training: its "
            "perspective will be wrong",
            info.fov_degrees));
    return warnings;
}

std::string prediction_text(const splat_prediction& prediction) {
    JsonWriter json;
    json.begin_object().member("gaussians", prediction.gaussians);
    json.member("not_finite", prediction.not_finite).member("faint", prediction.faint);
    json.key("read_ms").number(prediction.read_ms, 6);
    json.key("network_ms").number(prediction.network_ms, 6).key("pictures").begin_array();
    const std::uint32_t count =
        prediction.pictures == nullptr
            ? 0
            : std::min(prediction.picture_count, prediction.picture_capacity);
    for (std::uint32_t i = 0; i < count; ++i) {
        const splat_picture_info& info = prediction.pictures[i];
        json.newline(1).begin_object().member("width", info.width).member("height", info.height);
        json.member("mask", data::mask_from_name(static_cast<data::MaskFrom>(info.found)));
        json.key("square").begin_array();
        for (const double value : info.square) json.number(value, 6);
        json.end().key("focal").number(info.focal, 6).key("fov").number(info.fov_degrees, 6);
        json.key("warnings").list(picture_warnings(info)).end();
    }
    return json.end().end().text();
}

Result<std::vector<predict::PictureInput>> picture_inputs(const splat_picture* pictures,
                                                          std::uint32_t count) {
    if (count > 0) SPLAT_TRY(require(pictures, "pictures"));
    std::vector<predict::PictureInput> inputs;
    for (std::uint32_t i = 0; i < count; ++i) {
        SPLAT_ASSIGN(predict::PictureInput input,
                     picture_input(pictures[i], format("pictures[%u]", i)));
        inputs.push_back(std::move(input));
    }
    return inputs;
}

splat_picture_info info_of(const predict::PictureFacts& facts, bool field_of_view_differs) {
    splat_picture_info info{};
    info.width = facts.width;
    info.height = facts.height;
    info.found = static_cast<splat_found>(facts.found);
    info.square[0] = facts.x;
    info.square[1] = facts.y;
    info.square[2] = facts.side;
    info.focal = facts.focal;
    info.fov_degrees = facts.fov_degrees;
    if (facts.found == data::MaskFrom::kNothing && !facts.whole)
        info.warnings |= SPLAT_PICTURE_NO_OBJECT;
    if (field_of_view_differs) info.warnings |= SPLAT_PICTURE_FIELD_OF_VIEW;
    return info;
}

}  // namespace splat::api
