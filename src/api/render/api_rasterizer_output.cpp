#include <algorithm>

#include "api/core/tensor_arguments.h"
#include "api/render/raster_calls.h"
#include "ops/strided_copy.h"
#include "scene/srgb.h"

using namespace splat;

namespace {

using raster::Workspace;

/// Where an output lies in the workspace. Its elements are pixels or items.
struct OutputRow {
    const char* name;
    vk::Buffer Workspace::*buffer;  ///< null: the host computes it from others
    bool per_pixel;
    std::uint32_t
        flag;  ///< SPLAT_RASTERIZER_DEPTH, _NORMALS, _IDS or _MEDIAN_DEPTH if required, else 0
    std::uint32_t channels;
    ops::Stride layout;
};

constexpr OutputRow kOutputs[] = {
    {"rgb", &Workspace::image, true, 0, 3, {4, 0}},
    {"alpha", &Workspace::image, true, 0, 1, {4, 3}},
    {"depth", &Workspace::extra, true, SPLAT_RASTERIZER_DEPTH, 1, {4, 0}},
    {"expected_depth", &Workspace::extra, true, SPLAT_RASTERIZER_DEPTH, 1, {4, 1}},
    {"contributors", &Workspace::extra, true, SPLAT_RASTERIZER_DEPTH, 1, {4, 2}},
    {"means2d", &Workspace::splats, false, 0, 2, {12, 0}},
    {"radii", &Workspace::radii, false, 0, 2, {2, 0}},
    {"conics", nullptr, false, 0, 3, {}},
    {"depths", &Workspace::splats, false, 0, 1, {12, 3}},
    {"visibility", nullptr, false, 0, 1, {}},
    {"normals", &Workspace::normal_image, true, SPLAT_RASTERIZER_NORMALS, 3, {4, 0}},
    {"ids", &Workspace::extra, true, SPLAT_RASTERIZER_IDS, 1, {4, 3}},
    {"median_depth", &Workspace::median, true, SPLAT_RASTERIZER_MEDIAN_DEPTH, 1, {1, 0}},
};
static_assert(std::size(kOutputs) == SPLAT_OUTPUT_MEDIAN_DEPTH);

Status not_made_for(const OutputRow& row, const char* flag) {
    return bad_state("output '%s' needs a rasterizer made with %s", row.name, flag);
}

Result<const OutputRow*> find_output(const raster::RasterDesc& desc, splat_output output) {
    if (output < 1 || output > SPLAT_OUTPUT_MEDIAN_DEPTH)
        return invalid("output is %d, expected 1 to %d", output, SPLAT_OUTPUT_MEDIAN_DEPTH);
    const OutputRow& row = kOutputs[output - 1];
    if (row.flag == SPLAT_RASTERIZER_DEPTH && !desc.extra)
        return not_made_for(row, "SPLAT_RASTERIZER_DEPTH");
    if (row.flag == SPLAT_RASTERIZER_NORMALS && !desc.normals)
        return not_made_for(row, "SPLAT_RASTERIZER_NORMALS");
    if (row.flag == SPLAT_RASTERIZER_IDS && !desc.ids)
        return not_made_for(row, "SPLAT_RASTERIZER_IDS");
    if (row.flag == SPLAT_RASTERIZER_MEDIAN_DEPTH && !desc.median)
        return not_made_for(row, "SPLAT_RASTERIZER_MEDIAN_DEPTH");
    if (output == SPLAT_OUTPUT_CONICS && desc.rays())
        return bad_state(
            "output 'conics' needs a convention that projects Gaussians to ellipses, not "
            "SPLAT_CONVENTION_RAY_MAXIMUM");
    return &row;
}

/// The context's mutex is held.
Status check_drawn(const api::RasterStateObject& object, bool per_pixel = true) {
    SPLAT_TRY(object.rasterizer->finish());
    if (!object.rasterizer->drawn())
        return bad_state("the rasterizer has drawn nothing: call splat_rasterizer_forward first");
    const std::uint64_t banded = object.rasterizer->stats().banded;
    if (per_pixel || banded == 0) return {};
    return bad_state(
        "%llu Gaussians are more than the device takes at a time: they were drawn band by band, "
        "and have no outputs each",
        llu(banded));
}

std::uint64_t elements_of(const raster::RasterDesc& desc, const OutputRow& row) {
    return row.per_pixel ? desc.pixels() : desc.items();
}

/// The first `floats` numbers of a buffer, in place where the device's memory is mapped, else in
/// `copy`. The context's mutex is held.
Result<const float*> numbers(vk::Context& context, const vk::BufferView& view, std::uint64_t floats,
                             std::vector<float>& copy) {
    const std::byte* host = vk::Memory::host(view);
    if (host == nullptr || floats == 0) {
        copy.resize(floats);
        if (floats > 0) SPLAT_TRY(context.read(view, copy.data(), floats * sizeof(float)));
        return static_cast<const float*>(copy.data());
    }
    SPLAT_TRY(context.device().alive());
    SPLAT_TRY(context.settle());
    SPLAT_TRY(context.flush());
    SPLAT_TRY(context.memory().invalidate(view));
    return reinterpret_cast<const float*>(host);
}

/// Write all values of an output to `to`. The context's mutex is held.
Status read_output(const api::RasterStateObject& object, const OutputRow& row, float* to) {
    vk::Context& context = *object.context;
    const Workspace& space = object.rasterizer->workspace();
    const std::uint64_t count = elements_of(object.rasterizer->drawn_desc(), row);
    std::vector<float> copy;
    if (row.buffer != nullptr) {
        SPLAT_ASSIGN(const float* from, numbers(context, (space.*row.buffer).range(),
                                                count * row.layout.stride, copy));
        for (std::uint64_t i = 0; i < count; ++i)
            std::copy_n(&from[i * row.layout.stride + row.layout.offset], row.channels,
                        &to[i * row.channels]);
        return {};
    }
    SPLAT_ASSIGN(const float* radii, numbers(context, space.radii.range(), 2 * count, copy));
    if (row.channels == 1) {
        for (std::uint64_t i = 0; i < count; ++i) to[i] = radii[2 * i] > 0 ? 1.0F : 0.0F;
        return {};
    }
    std::vector<float> splats_copy;
    SPLAT_ASSIGN(const float* splats,
                 numbers(context, space.splats.range(), 12 * count, splats_copy));
    const std::vector<float> conics = raster::conics_of({splats, 12 * count}, {radii, 2 * count});
    std::ranges::copy(conics, to);
    return {};
}

/// The view of a tensor of the output's shape.
Status check_tensor(api::TensorArguments& arguments, const raster::RasterDesc& desc,
                    const OutputRow& row, splat_tensor tensor, vk::BufferView& view) {
    const std::int64_t v = desc.views;
    const std::int64_t c = row.channels;
    const auto items = static_cast<std::int64_t>(desc.items());
    const bool ranged = items != v * desc.gaussians;
    if (!row.per_pixel && ranged && c == 1) return arguments.write(tensor, "tensor", {items}, view);
    if (!row.per_pixel && ranged) return arguments.write(tensor, "tensor", {items, c}, view);
    if (!row.per_pixel && c == 1)
        return arguments.write(tensor, "tensor", {v, desc.gaussians}, view);
    if (!row.per_pixel) return arguments.write(tensor, "tensor", {v, desc.gaussians, c}, view);
    if (c == 1) return arguments.write(tensor, "tensor", {v, desc.height, desc.width}, view);
    return arguments.write(tensor, "tensor", {v, desc.height, desc.width, c}, view);
}

Status copy_output(const api::RasterStateObject& object, const OutputRow& row,
                   const vk::BufferView& view) {
    vk::Context& context = *object.context;
    if (row.buffer == nullptr) {
        std::vector<float> values(elements_of(object.rasterizer->drawn_desc(), row) * row.channels);
        SPLAT_TRY(read_output(object, row, values.data()));
        return context.write(view, values.data(), values.size() * sizeof(float));
    }
    vk::Recorder recorder(context);
    SPLAT_TRY(ops::strided_copy(recorder,
                                {elements_of(object.rasterizer->drawn_desc(), row),
                                 row.channels,
                                 row.layout,
                                 {row.channels, 0},
                                 false},
                                (object.rasterizer->workspace().*row.buffer).range(), view));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    return context.run(list);
}

}  // namespace

Result<api::ImageView> api::image_of_output(splat_output output, const raster::RasterDesc& desc,
                                            const splat_image& image, const char* name) {
    SPLAT_ASSIGN(const OutputRow* row, find_output(desc, output));
    if (!row->per_pixel)
        return invalid("output '%s' is no image: use splat_rasterizer_read", row->name);
    const bool rgb = output == SPLAT_OUTPUT_RGB;
    SPLAT_ASSIGN(const ImageView view, image_to_fill(&image, name));
    const std::uint32_t channels = rgb && view.channels == 4 ? 4 : row->channels;
    SPLAT_TRY(check_image_size(view, name, desc.width, desc.height, channels));
    return view;
}

Status api::fill_images(const RasterStateObject& object, splat_output output, std::uint32_t first,
                        std::span<const ImageView> images) {
    SPLAT_ASSIGN(const OutputRow* row, find_output(object.rasterizer->desc(), output));
    const raster::RasterDesc& drawn = object.rasterizer->drawn_desc();
    const std::uint64_t floats = std::uint64_t{row->layout.stride} * drawn.width * drawn.height;
    const vk::BufferView& all = (object.rasterizer->workspace().*row->buffer).range();
    std::vector<float> copy;
    SPLAT_ASSIGN(const float* from,
                 numbers(*object.context, all.part(first * floats * 4, images.size() * floats * 4),
                         images.size() * floats, copy));
    const bool convert = object.linear_colors && output == SPLAT_OUTPUT_RGB;
    std::vector<float> converted;
    for (std::size_t i = 0; i < images.size(); ++i) {
        const float* view = from + i * floats;
        if (convert) {
            converted.assign(view, view + floats);
            for (std::size_t k = 0; k < converted.size(); ++k)
                if (k % 4 != 3) converted[k] = scene::srgb_of_linear(converted[k]);
            view = converted.data();
        }
        fill_pixels(images[i], view + row->layout.offset, row->layout.stride);
    }
    return {};
}

splat_result splat_rasterizer_output(splat_rasterizer rasterizer, splat_raster_state state,
                                     splat_output output, splat_tensor tensor) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::find_state(rasterizer, state));
        SPLAT_TRY(api::find(tensor).status());
        SPLAT_ASSIGN(const OutputRow* row, find_output(object->rasterizer->desc(), output));
        api::TensorArguments arguments(*object->context, "rasterizer");
        vk::BufferView view;
        const std::lock_guard lock(object->context->mutex);
        SPLAT_TRY(check_drawn(*object, row->per_pixel));
        SPLAT_TRY(check_tensor(arguments, object->rasterizer->drawn_desc(), *row, tensor, view));
        SPLAT_TRY(arguments.check_unmapped());
        return copy_output(*object, *row, view);
    });
}

splat_result splat_rasterizer_read(splat_rasterizer rasterizer, splat_raster_state state,
                                   splat_output output, float* values, size_t bytes) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::find_state(rasterizer, state));
        if (bytes > 0) SPLAT_TRY(api::require(values, "values"));
        SPLAT_ASSIGN(const OutputRow* row, find_output(object->rasterizer->desc(), output));
        const std::lock_guard lock(object->context->mutex);
        SPLAT_TRY(check_drawn(*object, row->per_pixel));
        const std::uint64_t needed =
            elements_of(object->rasterizer->drawn_desc(), *row) * row->channels * sizeof(float);
        if (bytes < needed)
            return invalid("bytes is %zu, but output '%s' takes %llu", bytes, row->name,
                           llu(needed));
        return read_output(*object, *row, values);
    });
}

splat_result splat_rasterizer_read_images(splat_rasterizer rasterizer, splat_raster_state state,
                                          splat_output output, uint32_t first,
                                          const splat_image* images, uint32_t count) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::find_state(rasterizer, state));
        if (count > 0) SPLAT_TRY(api::require(images, "images"));
        SPLAT_TRY(find_output(object->rasterizer->desc(), output).status());
        std::vector<api::ImageView> views;
        const std::lock_guard lock(object->context->mutex);
        SPLAT_TRY(check_drawn(*object));
        const raster::RasterDesc& drawn = object->rasterizer->drawn_desc();
        for (std::uint32_t i = 0; i < count; ++i) {
            SPLAT_ASSIGN(
                const api::ImageView view,
                api::image_of_output(output, drawn, images[i], format("images[%u]", i).c_str()));
            views.push_back(view);
        }
        if (std::uint64_t{first} + count > drawn.views)
            return invalid("views %u to %llu, but the last forward call drew %u", first,
                           llu(std::uint64_t{first} + count), drawn.views);
        return api::fill_images(*object, output, first, views);
    });
}
