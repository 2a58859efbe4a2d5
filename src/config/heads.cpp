#include "config/heads.h"

namespace splat::config {

void take_head(const Head& head, ModelConfig& config) {
    config.head_name = head.name;
    config.positions = head.form.positions;
    config.offset = head.form.offset;
    config.scales = head.form.scales;
    config.isotropic = head.form.isotropic;
    config.sh_degree = head.form.sh_degree;
    config.direct = head.form.direct;
    config.per_pixel = head.form.per_pixel;
    config.init_depth = head.depth;
    config.init_offset = head.offset;
    config.init_opacity = head.opacity;
    config.init_scale = head.scale;
    config.opacity_threshold = head.opacity_threshold;
}

}  // namespace splat::config
