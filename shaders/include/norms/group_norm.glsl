// Shared by the passes of group_norm. The mean of a group is stored as two floats, rounded mean and rest: at
// |mean| = 1e4 std the rounding alone is 5e-4 of std. The means come first, [N,G], then the rests.

#ifndef SPLAT_GROUP_NORM_GLSL
#define SPLAT_GROUP_NORM_GLSL

#include "finite.glsl"

// Inputs are multiplied with it where their squares overflow; 2^-100 keeps the squares of the largest float and
// sums of 2^26 of them.
const float kShrink = 7.88860905e-31;

// guess + residual as a rounded number and the rest.
vec2 split_mean(float guess, float residual) {
    precise const float mean = guess + residual;
    precise const float rest = residual - (mean - guess);
    return vec2(mean, rest);
}

// Takes a mean out of units of 1 / unit. Not a quotient: one by 1 may be 2.5 ulp off, and then the rest tells nothing.
float per_unit(float unit) { return unit == 1.0 ? 1.0 : 1.0 / kShrink; }

// 1 / sqrt(var + eps) in units of 1 / unit, `variance` in units of unit^2. Where unit is kShrink, eps would
// underflow, and is far below any variance but 0.
float inverse_deviation(float variance, float eps, float unit) {
    if (unit == 1.0) return 1.0 / sqrt(max(variance, 0.0) + eps);
    return 1.0 / max(sqrt(max(variance, 0.0)), unit * sqrt(eps));
}

#endif
