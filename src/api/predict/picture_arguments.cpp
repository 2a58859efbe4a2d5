#include "api/predict/picture_arguments.h"

#include <algorithm>
#include <cmath>

#include "api/api_guard.h"
#include "api/core/image_view.h"
#include "core/json_writer.h"

namespace splat::api {
namespace {

enum class Content { kImage, kMask, kDepth, kNormal };

/// The first channels, which are read of such a picture.
std::uint32_t channels_read(Content content, std::uint32_t channels) {
    if (content == Content::kImage) return channels;
    return content == Content::kNormal && channels >= 3 ? 3 : 1;
}

const char* advice(Content content, float most) {
    if (content == Content::kNormal)
        return ": (normal + 1) / 2; bring normals of -1 to 1 into this range";
    if (most > 2) return "; divide values of 0 to 255 by 255, or pass 8-bit pixels";
    return "; scale or clamp the values";
}

/// Brings floats of any scale to 0 to 1; equal ones to 0.
void scale_range(std::vector<float>& values, float least, float most) {
    const double low = static_cast<double>(least);
    const double range = static_cast<double>(most) - low;
    for (float& value : values)
        value = range > 0 ? static_cast<float>((static_cast<double>(value) - low) / range) : 0;
}

/// The caller's pixels as an image of 8 bits. Float depths are scaled to their range. Other floats
/// must lie within 0 to 1, give or take kRounding.
Result<io::Image> eight_bits_of(const ImageView& view, const char* name, Content content) {
    if (view.type == SPLAT_PIXEL_U8) return image_of(view);
    constexpr float kRounding = 1e-3F;
    std::vector<float> values = interleaved_of(view);
    const std::uint32_t read = channels_read(content, view.channels);
    std::size_t least = 0, most = 0;
    const auto place_of = [&](std::size_t i) {
        return format("%s at row %zu, column %zu, channel %zu is %g", name,
                      i / view.channels / view.width, i / view.channels % view.width,
                      i % view.channels, static_cast<double>(values[i]));
    };
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (i % view.channels >= read) continue;
        if (!std::isfinite(values[i]))
            return invalid(
                "%s, expected a finite number; give pixels without a value a finite one, "
                "in a depth map the farthest",
                place_of(i).c_str());
        if (values[i] < values[least]) least = i;
        if (values[i] > values[most]) most = i;
    }
    const float low = values[least], high = values[most];
    if (content == Content::kDepth)
        scale_range(values, low, high);
    else if (low < -kRounding || high > 1 + kRounding)
        return invalid("%s, expected 0 to 1 (it has %g to %g)%s",
                       place_of(low < -kRounding ? least : most).c_str(), static_cast<double>(low),
                       static_cast<double>(high), advice(content, high));
    return io::image_from_floats(values, view.width, view.height, view.channels);
}

/// The decoded image of a source, if there is one.
Status read_source(const splat_picture_source& source, const std::string& name, Content content,
                   std::optional<data::NamedImage>& to) {
    if (source.path != nullptr && source.pixels.pixels != nullptr)
        return invalid("%s has a path and pixels, expected one of them", name.c_str());
    if (source.path != nullptr) {
        SPLAT_ASSIGN(to, data::load_picture(source.path));
    } else if (source.pixels.pixels != nullptr) {
        const std::string pixels = name + ".pixels";
        SPLAT_ASSIGN(const ImageView view, image_to_read(&source.pixels, pixels.c_str()));
        SPLAT_ASSIGN(io::Image image, eight_bits_of(view, pixels.c_str(), content));
        to = data::NamedImage{std::move(image), name, {}};
        if (content == Content::kDepth && view.type != SPLAT_PIXEL_U8) {
            const std::vector<float> all = interleaved_of(view);
            for (std::size_t i = 0; i < all.size(); i += view.channels) to->exact.push_back(all[i]);
        }
    }
    return {};
}

Status read_array(const float* values, std::uint64_t count, const std::string& name,
                  std::vector<float>& to) {
    if (count == 0 && values != nullptr)
        return invalid("%s is given with a count of 0, expected its numbers", name.c_str());
    if (count == 0) return {};
    SPLAT_TRY(require(values, name.c_str()));
    to.assign(values, values + count);
    return {};
}

}  // namespace

Result<predict::PictureInput> picture_input(const splat_picture& from, const std::string& name) {
    if ((from.flags & ~std::uint32_t{SPLAT_PICTURE_WHOLE}) != 0)
        return invalid("%s.flags has unknown bits %#x", name.c_str(),
                       from.flags & ~std::uint32_t{SPLAT_PICTURE_WHOLE});
    predict::PictureInput input;
    std::optional<data::NamedImage> image;
    SPLAT_TRY(read_source(from.image, name + ".image", Content::kImage, image));
    if (!image) return invalid("%s.image has neither a path nor pixels", name.c_str());
    input.picture.image = std::move(*image);
    SPLAT_TRY(read_source(from.mask, name + ".mask", Content::kMask, input.picture.mask));
    SPLAT_TRY(read_source(from.depth, name + ".depth", Content::kDepth, input.picture.depth));
    SPLAT_TRY(read_source(from.normal, name + ".normal", Content::kNormal, input.picture.normal));
    input.crop = (from.flags & SPLAT_PICTURE_WHOLE) == 0;
    if (!input.crop && from.foreground != 0)
        return invalid(
            "%s.foreground is %g, but with SPLAT_PICTURE_WHOLE nothing is cut out: "
            "expected 0",
            name.c_str(), static_cast<double>(from.foreground));
    if (from.foreground != 0) input.foreground = static_cast<double>(from.foreground);
    input.focal = from.focal != 0 ? from.focal : input.picture.image.image.focal;
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
    if ((info.warnings & SPLAT_PICTURE_AT_BORDER) != 0)
        warnings.emplace_back(
            "the object reaches the border of the picture, and networks are trained with whole "
            "objects: what is missing will be missing, or guessed badly");
    return warnings;
}

Result<std::string> prediction_text(const splat_prediction& prediction) {
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
        if (info.found < SPLAT_FOUND_BY_MASK || info.found > SPLAT_FOUND_NOTHING)
            return invalid(
                "prediction.pictures[%u].found is %d, expected %d to %d: pass what a "
                "prediction has filled",
                i, info.found, SPLAT_FOUND_BY_MASK, SPLAT_FOUND_NOTHING);
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
    if (facts.at_border && !facts.whole) info.warnings |= SPLAT_PICTURE_AT_BORDER;
    if (field_of_view_differs) info.warnings |= SPLAT_PICTURE_FIELD_OF_VIEW;
    return info;
}

}  // namespace splat::api
