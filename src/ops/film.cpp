#include "ops/film.h"

#include "params/film_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

params::FilmParams film_params(const FilmDesc& desc, std::uint32_t groups_x) {
    return {desc.x.n, desc.x.c, desc.x.p, desc.scaled ? 0U : 1U, groups_x};
}

/// A kernel with one invocation per quad of x.
Status record(vk::Recorder& recorder, const char* kernel, const FilmDesc& desc,
              std::vector<vk::Access> accesses) {
    const double bytes = static_cast<double>(desc.x.bytes());
    return record_each(recorder,
                       {.kernel = kernel,
                        .items = desc.x.quads(),
                        .accesses = std::move(accesses),
                        .work = {.flops = bytes / 2, .bytes = 2 * bytes},
                        .may_alias = true},
                       [&](std::uint32_t groups_x) { return film_params(desc, groups_x); });
}

}  // namespace

Status film_check(const vk::DeviceInfo& device, const FilmDesc& desc) {
    if ((desc.x.c + 3) / 4 > device.limits.max_groups[0] || desc.x.n > device.limits.max_groups[1])
        return unsupported(
            "film: %u channels in batch %u, but the device takes at most %u quads of "
            "channels and %u images",
            desc.x.c, desc.x.n, device.limits.max_groups[0], device.limits.max_groups[1]);
    return {};
}

namespace {

Status film_backward_modulation(vk::Recorder& recorder, const FilmDesc& desc,
                                const vk::BufferView& x, const vk::BufferView& grad_y,
                                const vk::BufferView& grad_modulation) {
    // One subgroup on CPU devices, as in group_norm.cpp.
    const std::uint32_t lanes = recorder.kernels() == vk::Kernels::kCpu ? 8 : 64;
    const double bytes = static_cast<double>(desc.x.bytes());
    return recorder.dispatch({
        .op = "film_backward_modulation",
        .shader = "film_backward_modulation",
        .constants = {{params::kWorkgroupSizeId,
                       vk::workgroup_size(recorder.device(), lanes, desc.x.p)}},
        .push = film_params(desc, 0),
        .accesses = {vk::read(x), vk::read(grad_y), vk::write(grad_modulation)},
        .groups = {(desc.x.c + 3) / 4, desc.x.n, 1},
        .work = {.flops = bytes, .bytes = 2 * bytes},
    });
}

constexpr Port kFilmInputs[] = {{"x"}, {"modulation"}};

Result<FilmDesc> film_desc(const Shape& x, const Shape& modulation) {
    FilmDesc desc;
    SPLAT_ASSIGN(desc.x, quad_dims(x));
    const auto [n, c, p] = desc.x;
    desc.scaled = modulation == Shape{n, 2 * c};
    if (!desc.scaled && !(modulation == Shape{n, c}))
        return error(Code::kShape,
                     "film: tensor 'modulation' has shape %s, expected [%u, %u] or "
                     "[%u, %u] for x of shape %s",
                     modulation.text().c_str(), n, 2 * c, n, c, x.text().c_str());
    return desc;
}

Result<OpPlan> film_plan(const vk::Recorder& recorder, const Attributes&,
                         std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const FilmDesc desc, film_desc(inputs[0], inputs[1]));
    SPLAT_TRY(film_check(recorder.device(), desc));
    return OpPlan{.outputs = {inputs[0]}};
}

Status film_row_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const FilmDesc desc, film_desc(v.inputs[0].shape, v.inputs[1].shape));
    return record(recorder, "film_forward", desc,
                  {vk::read(v.inputs[0]), vk::read(v.inputs[1]), vk::write(v.outputs[0])});
}

Status film_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const FilmDesc desc, film_desc(v.inputs[0].shape, v.inputs[1].shape));
    if (present(v.grad_inputs[1]))
        SPLAT_TRY(film_backward_modulation(recorder, desc, v.inputs[0], v.grad_outputs[0],
                                           v.grad_inputs[1]));
    if (!present(v.grad_inputs[0])) return {};
    return record(
        recorder, "film_backward_input", desc,
        {vk::read(v.inputs[1]), vk::read(v.grad_outputs[0]), vk::write(v.grad_inputs[0])});
}

}  // namespace

const OpRow kFilmRow = {
    .name = "film",
    .equation = "y = gamma * x + beta, modulation [N, 2C] = (gamma, beta); [N, C]: y = x + beta",
    .inputs = kFilmInputs,
    .outputs = kOutputY,
    .plan = film_plan,
    .forward = film_row_forward,
    .backward = film_row_backward,
    .backward_reads = product_backward_reads};

}  // namespace splat::ops
