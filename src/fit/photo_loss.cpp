#include "fit/photo_loss.h"

#include <algorithm>

#include "core/checked_math.h"
#include "params/fit_params.h"
#include "vk/launch.h"

namespace splat::fit {
namespace {

/// Pixels per workgroup of a plain kernel that sums.
constexpr std::uint32_t kChunk = 1024;
/// Kernels for CPU devices have so many lanes, and the last of them so many rows of a lane.
constexpr std::uint32_t kLanes = 8;
constexpr std::uint32_t kRows = 16;
constexpr double kTaps = 11;
constexpr double kChannels = 3;

std::uint64_t pixels(const PhotoLossDesc& desc) {
    return std::uint64_t{desc.width} * desc.height;
}

bool on_cpu(const vk::Recorder& recorder) {
    return recorder.kernels() == vk::Kernels::kCpu;
}

/// Parts of the workspace and of the partial sums, in bytes and in quads.
struct Layout {
    std::uint64_t moments = 0;  ///< plain alone: and, later, the slopes' rows
    std::uint64_t slopes = 0;   ///< for CPU devices: the window along rows over them
    std::uint64_t rest = 0;     ///< for CPU devices alone: their ninth number
    std::uint32_t unlike = 0;   ///< quads that hold sums of 1 - SSIM
    std::uint32_t errors =
        0;  ///< quads that hold sums of |d| and d^2; three times as many, of the exposure
};

Layout layout_of(const vk::Recorder& recorder, const PhotoLossDesc& desc) {
    const std::uint64_t alignment = recorder.device().limits.offset_alignment;
    Layout layout;
    if (on_cpu(recorder)) {
        const std::uint64_t rows = round_up(desc.height, kLanes);
        const std::uint64_t pairs = ceil_div(desc.width, 2) * rows;
        layout = {0, round_up(pairs * 64, alignment), round_up(pairs * 8, alignment),
                  static_cast<std::uint32_t>(rows),
                  static_cast<std::uint32_t>(round_up(desc.width, kLanes) *
                                             ceil_div(desc.height, kRows))};
    } else {
        const auto chunks = static_cast<std::uint32_t>(ceil_div(pixels(desc), kChunk));
        layout = {round_up(pixels(desc) * 64, alignment), pixels(desc) * 48, 0, chunks, chunks};
    }
    return layout;
}

/// What the kernels of one call share.
struct Call {
    vk::Recorder& recorder;
    const PhotoLossDesc& desc;
    const PhotoLossViews& views;
    params::PhotoLossParams push;
    Layout layout;
    vk::BufferView moments, slopes, rest;

    /// `planes`: those that the window goes over, for the estimate of the work.
    [[nodiscard]] vk::Dispatch dispatch(const char* kernel, std::vector<vk::Access> accesses,
                                        double planes) const {
        const double numbers = kChannels * static_cast<double>(pixels(desc)) * planes;
        vk::Dispatch dispatch;
        dispatch.op = kernel;
        dispatch.shader = kernel;
        dispatch.accesses = std::move(accesses);
        dispatch.work = {.flops = 2 * kTaps * numbers, .bytes = 8 * numbers};
        return dispatch;
    }

    [[nodiscard]] std::vector<vk::SpecConstant> constants(std::uint32_t size) const {
        return {{params::kWorkgroupSizeId, size},
                {params::kPhotoLossExposureId, desc.exposure ? 1U : 0U}};
    }

    /// A plain kernel: an invocation per pixel, or a workgroup per chunk.
    [[nodiscard]] Status plain(vk::Dispatch dispatch, bool chunks, std::uint32_t first = 0) {
        const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
        dispatch.groups = chunks ? vk::groups_for(recorder.device(), layout.unlike, 1)
                                 : vk::groups_for(recorder.device(), pixels(desc), size);
        push.groups_x = dispatch.groups[0];
        push.first = first;
        dispatch.constants = constants(size);
        dispatch.push = push;
        return recorder.dispatch(dispatch);
    }

    [[nodiscard]] Status cpu(vk::Dispatch dispatch, vk::Groups groups, std::uint32_t first = 0) {
        push.first = first;
        dispatch.constants = constants(kLanes);
        dispatch.push = push;
        dispatch.groups = groups;
        return recorder.dispatch(dispatch);
    }
};

Status record_plain(Call& call) {
    const PhotoLossViews& v = call.views;
    const vk::BufferView slope_rows = call.moments.part(0, call.slopes.bytes);
    SPLAT_TRY(call.plain(
        call.dispatch("photo_loss_moments",
                      {vk::read(v.image), vk::read(v.truth), vk::write(call.moments)}, 4),
        false));
    SPLAT_TRY(call.plain(call.dispatch("photo_loss_slopes",
                                       {vk::read(call.moments), vk::read(v.truth),
                                        vk::write(call.slopes), vk::write(v.partial)},
                                       4),
                         true));
    SPLAT_TRY(call.plain(
        call.dispatch("photo_loss_slope_rows", {vk::read(call.slopes), vk::write(slope_rows)}, 3),
        false));
    return call.plain(call.dispatch("photo_loss_gradient",
                                    {vk::read(v.image), vk::read(v.truth), vk::read(slope_rows),
                                     vk::write(v.grad_image), vk::write(v.partial)},
                                    3),
                      true, call.layout.unlike);
}

Status record_cpu(Call& call) {
    const PhotoLossViews& v = call.views;
    const auto columns = static_cast<std::uint32_t>(ceil_div(call.desc.width, kLanes));
    const auto rows = static_cast<std::uint32_t>(ceil_div(call.desc.height, kLanes));
    const auto blocks = static_cast<std::uint32_t>(ceil_div(call.desc.height, kRows));
    SPLAT_TRY(call.cpu(call.dispatch("photo_loss_slopes",
                                     {vk::read(v.image), vk::read(v.truth), vk::write(call.slopes),
                                      vk::write(call.rest), vk::write(v.partial)},
                                     7),
                       {rows, 1, 1}));
    return call.cpu(
        call.dispatch("photo_loss_gradient",
                      {vk::read(v.image), vk::read(v.truth), vk::read(call.slopes),
                       vk::read(call.rest), vk::write(v.grad_image), vk::write(v.partial)},
                      3),
        {columns, blocks, 1}, call.layout.unlike);
}

Status check(const vk::Recorder& recorder, const PhotoLossDesc& desc, const PhotoLossViews& views,
             std::uint32_t valid) {
    if (desc.width == 0 || desc.height == 0)
        return invalid("photo_loss: a view of %u x %u pixels", desc.width, desc.height);
    if (!(desc.ssim_weight >= 0 && desc.ssim_weight <= 1))
        return invalid("photo_loss: ssim_weight is %g, expected 0 to 1", desc.ssim_weight);
    if (valid > pixels(desc))
        return invalid("photo_loss: %u valid pixels in a view of %u x %u", valid, desc.width,
                       desc.height);
    const struct {
        const char* name;
        std::uint64_t bytes, least;
    } needs[] = {{"image", views.image.bytes, 16 * pixels(desc) * (desc.view + 1)},
                 {"truth", views.truth.bytes, 4 * pixels(desc)},
                 {"workspace", views.workspace.bytes, photo_loss_workspace(recorder, desc)},
                 {"grad_image", views.grad_image.bytes, 16 * pixels(desc) * (desc.view + 1)},
                 {"partial", views.partial.bytes, photo_loss_partial(recorder, desc)}};
    for (const auto& [name, bytes, least] : needs)
        if (bytes < least)
            return error(Code::kShape, "photo_loss: '%s' has %llu bytes, expected %llu", name,
                         llu(bytes), llu(least));
    return {};
}

}  // namespace

std::uint64_t photo_loss_workspace(const vk::Recorder& recorder, const PhotoLossDesc& desc) {
    const Layout layout = layout_of(recorder, desc);
    return layout.moments + layout.slopes + layout.rest;
}

std::uint64_t photo_loss_partial(const vk::Recorder& recorder, const PhotoLossDesc& desc) {
    const Layout layout = layout_of(recorder, desc);
    return (layout.unlike + std::uint64_t{layout.errors} * (desc.exposure ? 4 : 1)) * 16;
}

Status photo_loss(vk::Recorder& recorder, const PhotoLossDesc& desc, const PhotoLossViews& views,
                  std::uint32_t valid, double share) {
    SPLAT_TRY(check(recorder, desc, views, valid));
    const Layout layout = layout_of(recorder, desc);
    const double scale = valid > 0 ? share / (kChannels * valid) : 0;
    Call call{recorder,
              desc,
              views,
              {desc.width,
               desc.height,
               kChunk,
               0,
               0,
               layout.unlike + layout.errors,
               static_cast<std::uint32_t>(desc.view * pixels(desc)),
               static_cast<float>((1 - desc.ssim_weight) * scale),
               static_cast<float>(desc.ssim_weight * scale),
               {}},
              layout,
              views.workspace.part(0, layout.moments),
              views.workspace.part(layout.moments, layout.slopes),
              views.workspace.part(layout.moments + layout.slopes, layout.rest)};
    std::ranges::copy(desc.exposure.value_or(kNoExposure), call.push.exposure);
    return on_cpu(recorder) ? record_cpu(call) : record_plain(call);
}

PhotoLossSums photo_loss_sums(const vk::Recorder& recorder, const PhotoLossDesc& desc,
                              std::span<const float> partial) {
    const Layout layout = layout_of(recorder, desc);
    const std::size_t sums_end = 4 * (std::size_t{layout.unlike} + layout.errors);
    PhotoLossSums sums;
    for (std::size_t i = sums_end; i < partial.size(); ++i)
        sums.exposure[(i - sums_end) % 12] += static_cast<double>(partial[i]);
    for (std::size_t i = 0; i < sums_end; i += 4) {
        sums.absolute += static_cast<double>(partial[i]);
        sums.dissimilarity += static_cast<double>(partial[i + 1]);
        sums.squared += static_cast<double>(partial[i + 2]);
    }
    return sums;
}

double PhotoLossSums::loss(const PhotoLossDesc& desc, std::uint32_t valid) const {
    if (valid == 0) return 0;
    return ((1 - desc.ssim_weight) * absolute + desc.ssim_weight * dissimilarity) /
           (kChannels * valid);
}

double PhotoLossSums::squared_error(std::uint32_t valid) const {
    return valid == 0 ? 0 : squared / (kChannels * valid);
}

}  // namespace splat::fit
