#include "predict/prediction.h"

#include "scene/select.h"

namespace splat::predict {

Result<Visible> visible_of(const scene::Gaussians& predicted) {
    Visible visible;
    SPLAT_ASSIGN(const scene::Gaussians finite, scene::remove_invalid(predicted));
    SPLAT_ASSIGN(visible.gaussians, scene::filter_by_opacity(finite, kLeastOpacity));
    visible.not_finite = predicted.count() - finite.count();
    visible.faint = finite.count() - visible.gaussians.count();
    return visible;
}

}  // namespace splat::predict
