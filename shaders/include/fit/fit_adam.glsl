// Adam on a quad of parameters: the new moments, and how far the parameters move for a step size of 1. Gradients that
// are not finite count as zeros.
#ifndef SPLAT_FIT_ADAM_GLSL
#define SPLAT_FIT_ADAM_GLSL

#include "finite.glsl"
#include "params/fit_params.h"

vec4 fit_adam(FitAdam adam, vec4 grad, inout vec4 m, inout vec4 v) {
    if (!finite(grad)) grad = vec4(0);
    m = adam.beta1 * m + adam.rest1 * grad;
    v = adam.beta2 * v + adam.rest2 * grad * grad;
    return m / (adam.root_scale * sqrt(v) + adam.eps);
}

#endif
