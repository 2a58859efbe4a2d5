// log(1 + exp(x)) = max(x, 0) + log(1 + e) with e = exp(-|x|), by log(1 + e) = 2 artanh(e / (2 + e)): the built-in log
// may be 2^-21 off near 1, beyond any small e.

#ifndef SPLAT_SOFTPLUS_GLSL
#define SPLAT_SOFTPLUS_GLSL

#include "activations/exp.glsl"

vec4 softplus(vec4 x) {
    const vec4 e = exponential(-abs(x)), s = e / (2.0 + e), q = s * s;  // q <= 1/9
    const vec4 odd = q * (0.333333333 + q * (0.2 + q * (0.142857143 + q * (0.111111111 + q * (0.0909090909 +
                     q * (0.0769230769 + q * 0.0666666667))))));
    return max(x, vec4(0.0)) + 2.0 * (s + s * odd);
}

#endif
