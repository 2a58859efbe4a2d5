// What a fit does with maps of depth and normals.

#include <algorithm>

#include "fit/fitter.h"

namespace splat::fit {

bool Fitter::has_priors() const {
    return !photos_[0].nearness.empty() || !photos_[0].normals.empty();
}

PriorLossDesc Fitter::prior_desc(const Views& views, std::size_t i) const {
    PriorLossDesc desc;
    desc.camera = views[i]->camera;
    desc.view = static_cast<std::uint32_t>(i);
    desc.depth_weight = priors_.depth_weight * prior_decay_;
    desc.normal_weight = priors_.normal_weight * prior_decay_;
    const auto photo = static_cast<std::size_t>(views[i] - &truths_->at(0));
    if (photo < priors_.alignments.size()) desc.alignment = priors_.alignments[photo];
    return desc;
}

Status Fitter::make_priors(const raster::RasterDesc& desc, Canvas& canvas) {
    if (!has_priors()) return {};
    const auto make = [&](std::uint64_t bytes) {
        return context_.memory().allocate(bytes, vk::MemoryKind::kDevice, "losses of maps");
    };
    PriorLossDesc loss;
    loss.camera.width = desc.width;
    loss.camera.height = desc.height;
    SPLAT_ASSIGN(canvas.grad_depth, make(desc.pixels() * sizeof(float)));
    SPLAT_ASSIGN(canvas.prior_workspace, make(prior_loss_workspace(vk::Recorder(context_), loss)));
    for (std::uint32_t view = 0; view < desc.views; ++view) {
        SPLAT_ASSIGN(vk::Buffer sums, make(prior_loss_partial(loss)));
        canvas.prior_sums.push_back(std::move(sums));
    }
    return {};
}

Status Fitter::record_priors(vk::Recorder& recorder, const Views& views, Canvas& canvas) {
    if (!has_priors()) return {};
    const raster::Workspace& drawn = canvas.rasterizer->workspace();
    for (std::size_t i = 0; i < views.size(); ++i)
        SPLAT_TRY(prior_loss(recorder, prior_desc(views, i),
                             {.image = drawn.image.range(),
                              .extra = drawn.extra.range(),
                              .map = views[i]->map,
                              .workspace = canvas.prior_workspace.range(),
                              .grad_depth = canvas.grad_depth.range(),
                              .grad_image = canvas.grad_image.range(),
                              .partial = canvas.prior_sums[i].range()},
                             views[i]->map_counts, 1 / static_cast<double>(views.size())));
    return {};
}

Status Fitter::read_priors(const Views& views, const Canvas& canvas, FitStep& done) {
    if (!has_priors()) return {};
    const double share = 1 / static_cast<double>(views.size());
    std::vector<float> sums(canvas.prior_sums[0].bytes() / sizeof(float));
    for (std::size_t i = 0; i < views.size(); ++i) {
        SPLAT_TRY(
            context_.read(canvas.prior_sums[i].range(), sums.data(), sums.size() * sizeof(float)));
        const PriorLosses losses = prior_loss_sums(sums, views[i]->map_counts);
        const PriorLossDesc desc = prior_desc(views, i);
        done.priors.depth += share * losses.depth;
        done.priors.normal += share * losses.normal;
        done.loss +=
            share * (desc.depth_weight * losses.depth + desc.normal_weight * losses.normal);
    }
    return {};
}

}  // namespace splat::fit
