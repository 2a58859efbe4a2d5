// With e = exp(-|x|) the sigmoid is 1 / (1 + e), or e / (1 + e) for x < 0, and its derivative e / (1 + e)^2: nothing
// overflows, and no digit is lost in the tails.

#ifndef SPLAT_SIGMOID_GLSL
#define SPLAT_SIGMOID_GLSL

#include "activations/exp.glsl"

vec4 sigmoid(vec4 x) {
    const vec4 e = exponential(-abs(x));
    return mix(vec4(1.0), e, lessThan(x, vec4(0.0))) / (1.0 + e);
}

float sigmoid(float x) { return sigmoid(vec4(x)).x; }

vec4 sigmoid_derivative(vec4 x) {
    const vec4 e = exponential(-abs(x));
    return e / ((1.0 + e) * (1.0 + e));
}

#endif
