#pragma once

#include "ref/blend_backward_ref.h"
#include "ref/blend_ref.h"
#include "ref/project_backward_ref.h"
#include "ref/project_ref.h"
#include "ref/raster_scene_ref.h"

/// Runs the stages in order.
namespace splat::ref {

template <class Real>
BlendForward<Real> rasterize_forward(const RasterScene<Real>& scene) {
    return blend_forward(scene, project_forward(scene));
}

template <class Real>
RasterBackward<Real> rasterize_backward(const RasterScene<Real>& scene,
                                        const RasterLoss<Real>& loss) {
    const ProjectForward<Real> projected = project_forward(scene);
    return project_backward(scene, projected, blend_backward(scene, projected, loss));
}

}  // namespace splat::ref
