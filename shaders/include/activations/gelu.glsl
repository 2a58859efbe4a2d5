// gelu(x) = x Phi(x), and its form by tanh, x s(v) with the sigmoid s and
// v = 2 sqrt(2 / pi) (x + 0.044715 x^3).
//
// Both are max(x, 0) - a w E with a = |x|; the slope is E (w - g) for x < 0, and 1 less that for others:
//   exact    E = exp(-a^2 / 2)   w = erfcx(a / sqrt 2) / 2   g = a / sqrt(2 pi)
//   by tanh  E = exp(-v(a))      w = 1 / (1 + E)             g = a v'(a) w^2
// Nothing cancels in the tails, and E is a product that does not underflow before the result does.
//
// (1 + a) w is a polynomial in (a - 2.75) / (a + 2.75), as in Shepherd & Laframboise 1981, Chebyshev
// approximation of (1 + 2x) exp(x^2) erfc x, Math. Comp. 36; here interpolated at Chebyshev's points
// for a <= 15, within 2e-8. Beyond, E is 0.

#ifndef SPLAT_GELU_GLSL
#define SPLAT_GELU_GLSL

#include "activations/exp.glsl"

struct GeluParts { vec4 a, w, g; ExpParts e; };

GeluParts gelu_exact(vec4 a) {
    const vec4 wide = uintBitsToFloat(floatBitsToUint(a) & 0xfffff000u);  // 12 bits: its square is exact
    GeluParts parts;
    parts.e = exp_parts(-0.5 * (wide * wide), -0.5 * ((a - wide) * (a + wide)));
    const vec4 u = (a - 2.75) / (a + 2.75);
    parts.a = a;
    parts.w = (0.490217753 + u * (-0.0946549802 + u * (-0.0266120017 + u * (0.0467205748 +
               u * (-0.0164825473 + u * (-0.00304427516 + u * (0.00272060395 + u * (0.000589992113 +
               u * (-0.000384876998 - u * 0.000152388727)))))))) ) / (1.0 + a);
    parts.g = a * 0.398942280;
    return parts;
}

GeluParts gelu_by_tanh(vec4 a) {
    const vec4 square = a * a;
    GeluParts parts;
    parts.e = exp_parts(-1.59576912 * a * (1.0 + 0.044715 * square), vec4(0.0));
    parts.a = a;
    parts.w = 1.0 / (1.0 + parts.e.mantissa * parts.e.first * parts.e.second);
    parts.g = a * (1.59576912 + 0.214064488 * square) * parts.w * parts.w;
    return parts;
}

GeluParts gelu_parts(vec4 x, bool by_tanh) {
    // min() may turn NaN into 15.
    const vec4 a = mix(min(abs(x), vec4(15.0)), x, greaterThan(floatBitsToUint(abs(x)), uvec4(0x7f800000u)));
    if (by_tanh) return gelu_by_tanh(a);
    return gelu_exact(a);
}

vec4 gelu(vec4 x, bool by_tanh) {
    const GeluParts p = gelu_parts(x, by_tanh);
    precise const vec4 tail = p.a * p.w * p.e.mantissa * p.e.first * p.e.second;
    return max(x, vec4(0.0)) - tail;
}

vec4 gelu_derivative(vec4 x, bool by_tanh) {
    const GeluParts p = gelu_parts(x, by_tanh);
    precise const vec4 slope = (p.w - p.g) * p.e.mantissa * p.e.first * p.e.second;
    return mix(1.0 - slope, slope, lessThan(x, vec4(0.0)));
}

#endif
