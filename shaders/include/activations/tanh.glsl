// tanh(x) = (1 - e) / (1 + e) with e = exp(-2|x|), and its derivative 4e / (1 + e)^2, of which no digit is lost in the
// tails. Below 0.6, where 1 - e loses some, x times a polynomial in x^2, interpolated at Chebyshev's points, 3e-9 off.

#ifndef SPLAT_TANH_GLSL
#define SPLAT_TANH_GLSL

#include "activations/sigmoid.glsl"

vec4 hyperbolic_tangent(vec4 x) {
    const vec4 a = abs(x);
    const vec4 e = exponential(-2.0 * a);
    const vec4 square = a * a;
    const vec4 small = a * (0.999999997 + square * (-0.333332828 + square * (0.133316796 + square * (-0.0537679835 +
                       square * (0.0207513491 - square * 0.00584964391)))));
    const vec4 value = mix((1.0 - e) / (1.0 + e), small, lessThan(a, vec4(0.6)));
    return mix(value, -value, lessThan(x, vec4(0.0)));
}

vec4 hyperbolic_tangent_derivative(vec4 x) { return 4.0 * sigmoid_derivative(2.0 * x); }

#endif
