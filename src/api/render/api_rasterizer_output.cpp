#include <algorithm>

#include "api/api_guard.h"
#include "api/core/tensor_arguments.h"
#include "ops/strided_copy.h"

using namespace splat;

namespace {

using raster::Workspace;

/// Where an output lies in the workspace. Its elements are pixels or items.
struct OutputRow {
    const char* name;
    vk::Buffer Workspace::*buffer;  ///< null: the host computes it from others
    bool per_pixel;
    std::uint32_t flag;  ///< SPLAT_RASTERIZER_DEPTH or _NORMALS if required, else 0
    std::uint32_t channels;
    ops::Stride layout;
};

constexpr OutputRow kOutputs[] = {
    {"RGB", &Workspace::image, true, 0, 3, {4, 0}},
    {"ALPHA", &Workspace::image, true, 0, 1, {4, 3}},
    {"DEPTH", &Workspace::extra, true, SPLAT_RASTERIZER_DEPTH, 1, {4, 0}},
    {"EXPECTED_DEPTH", &Workspace::extra, true, SPLAT_RASTERIZER_DEPTH, 1, {4, 1}},
    {"CONTRIBUTORS", &Workspace::extra, true, SPLAT_RASTERIZER_DEPTH, 1, {4, 2}},
    {"MEANS2D", &Workspace::splats, false, 0, 2, {12, 0}},
    {"RADII", &Workspace::radii, false, 0, 2, {2, 0}},
    {"CONICS", nullptr, false, 0, 3, {}},
    {"DEPTHS", &Workspace::splats, false, 0, 1, {12, 3}},
    {"VISIBILITY", nullptr, false, 0, 1, {}},
    {"NORMALS", &Workspace::normal_image, true, SPLAT_RASTERIZER_NORMALS, 3, {4, 0}},
};
static_assert(std::size(kOutputs) == SPLAT_OUTPUT_NORMALS);

Result<const OutputRow*> find_output(const api::RasterizerObject& object, splat_output output) {
    if (output < 1 || output > SPLAT_OUTPUT_NORMALS)
        return error(Code::kInvalidArgument, "output is %d, expected 1 to %d", output,
                     SPLAT_OUTPUT_NORMALS);
    const OutputRow& row = kOutputs[output - 1];
    const raster::RasterDesc& desc = object.rasterizer->desc();
    const bool depth = row.flag == SPLAT_RASTERIZER_DEPTH;
    if (row.flag != 0 && !(depth ? desc.extra : desc.normals))
        return error(Code::kInvalidState, "output %s needs a rasterizer made with %s", row.name,
                     depth ? "SPLAT_RASTERIZER_DEPTH" : "SPLAT_RASTERIZER_NORMALS");
    return &row;
}

/// The context's mutex is held.
Status check_drawn(const api::RasterizerObject& object) {
    if (object.rasterizer->drawn()) return {};
    return error(Code::kInvalidState,
                 "the rasterizer has drawn nothing: call splat_rasterizer_forward first");
}

std::uint64_t elements_of(const raster::RasterDesc& desc, const OutputRow& row) {
    return row.per_pixel ? desc.pixels() : desc.items();
}

Result<std::vector<float>> download(vk::Context& context, const vk::Buffer& buffer,
                                    std::uint64_t floats) {
    std::vector<float> values(floats);
    if (floats > 0) SPLAT_TRY(context.read(buffer.range(), values.data(), floats * sizeof(float)));
    return values;
}

/// All values of an output. The context's mutex is held.
Result<std::vector<float>> output_values(const api::RasterizerObject& object,
                                         const OutputRow& row) {
    const Workspace& space = object.rasterizer->workspace();
    const std::uint64_t count = elements_of(object.rasterizer->desc(), row);
    if (row.buffer != nullptr) {
        SPLAT_ASSIGN(const std::vector<float> raw,
                     download(*object.context, space.*row.buffer, count * row.layout.stride));
        std::vector<float> values(count * row.channels);
        for (std::uint64_t i = 0; i < count; ++i)
            std::copy_n(&raw[i * row.layout.stride + row.layout.offset], row.channels,
                        &values[i * row.channels]);
        return values;
    }
    SPLAT_ASSIGN(const std::vector<float> radii, download(*object.context, space.radii, 2 * count));
    if (row.channels == 1) {
        std::vector<float> visible(count);
        for (std::uint64_t i = 0; i < count; ++i) visible[i] = radii[2 * i] > 0 ? 1.0F : 0.0F;
        return visible;
    }
    SPLAT_ASSIGN(const std::vector<float> splats,
                 download(*object.context, space.splats, 12 * count));
    return raster::conics_of(splats, radii);
}

/// The view of a tensor of the output's shape.
Status check_tensor(api::TensorArguments& arguments, const raster::RasterDesc& desc,
                    const OutputRow& row, splat_tensor tensor, vk::BufferView& view) {
    const std::int64_t v = desc.views;
    const std::int64_t c = row.channels;
    if (!row.per_pixel && c == 1)
        return arguments.write(tensor, "tensor", {v, desc.gaussians}, view);
    if (!row.per_pixel) return arguments.write(tensor, "tensor", {v, desc.gaussians, c}, view);
    if (c == 1) return arguments.write(tensor, "tensor", {v, desc.height, desc.width}, view);
    return arguments.write(tensor, "tensor", {v, desc.height, desc.width, c}, view);
}

Status copy_output(const api::RasterizerObject& object, const OutputRow& row,
                   const vk::BufferView& view) {
    vk::Context& context = *object.context;
    if (row.buffer == nullptr) {
        SPLAT_ASSIGN(const std::vector<float> values, output_values(object, row));
        return context.write(view, values.data(), values.size() * sizeof(float));
    }
    vk::Recorder recorder(context);
    SPLAT_TRY(ops::strided_copy(recorder,
                                {elements_of(object.rasterizer->desc(), row),
                                 row.channels,
                                 row.layout,
                                 {row.channels, 0},
                                 false},
                                (object.rasterizer->workspace().*row.buffer).range(), view));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    return context.run(list);
}

}  // namespace

splat_result splat_rasterizer_output(splat_rasterizer rasterizer, splat_output output,
                                     splat_tensor tensor) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::Rasterizers::find(rasterizer, "rasterizer"));
        SPLAT_TRY(api::Tensors::find(tensor, "tensor").status());
        SPLAT_ASSIGN(const OutputRow* row, find_output(*object, output));
        api::TensorArguments arguments(*object->context, "rasterizer");
        vk::BufferView view;
        SPLAT_TRY(check_tensor(arguments, object->rasterizer->desc(), *row, tensor, view));
        const std::lock_guard lock(object->context->mutex);
        SPLAT_TRY(arguments.check_unmapped());
        SPLAT_TRY(check_drawn(*object));
        return copy_output(*object, *row, view);
    });
}

splat_result splat_rasterizer_read(splat_rasterizer rasterizer, splat_output output, float* values,
                                   size_t bytes) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::Rasterizers::find(rasterizer, "rasterizer"));
        SPLAT_TRY(api::require(values, "values"));
        SPLAT_ASSIGN(const OutputRow* row, find_output(*object, output));
        const std::uint64_t needed =
            elements_of(object->rasterizer->desc(), *row) * row->channels * sizeof(float);
        if (bytes < needed)
            return error(Code::kInvalidArgument, "bytes is %zu, but output %s takes %llu", bytes,
                         row->name, static_cast<unsigned long long>(needed));
        const std::lock_guard lock(object->context->mutex);
        SPLAT_TRY(check_drawn(*object));
        SPLAT_ASSIGN(const std::vector<float> read, output_values(*object, *row));
        std::copy(read.begin(), read.end(), values);
        return {};
    });
}
