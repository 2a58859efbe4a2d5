// silu(t) = t s with s = 1 / (1 + exp(-t)); its derivative is s + t s (1 - s).
//
// With a = |t|, e = exp(-a) and r = 1 / (1 + e), s is r, or e r for t < 0, and 1 - s the other one. Nothing cancels but
// where the derivative has its root, and e in units of 2^-32 does not underflow before the result does.

#ifndef SPLAT_SILU_GLSL
#define SPLAT_SILU_GLSL

#include "activations/exp.glsl"

const float kSiluUnit = 2.3283064365386963e-10;  // 2^-32

struct SiluParts { vec4 a, e, r; };  // e in units of kSiluUnit

SiluParts silu_parts(vec4 t) {
    // At 109 the results are 0 or t in float32: no infinity meets a 0. By bits: min() may turn NaN into 109.
    const uvec4 size = floatBitsToUint(t) & 0x7FFFFFFFu;
    SiluParts parts;
    parts.a = mix(abs(t), vec4(109.0), lessThanEqual(size - 0x42DA0000u, uvec4(0x7F800000u - 0x42DA0000u)));
    const vec4 k = roundEven(parts.a * -1.44269504);
    parts.e = exp_mantissa(-parts.a, vec4(0.0), k) * uintBitsToFloat(uvec4(ivec4(k) + 159) << 23);
    parts.r = 1.0 / (1.0 + parts.e * kSiluUnit);
    return parts;
}

vec4 silu(vec4 t) {
    const SiluParts p = silu_parts(t);
    precise const vec4 tail = -p.a * p.r * p.e * kSiluUnit;
    return mix(t * p.r, tail, lessThan(t, vec4(0.0)));
}
float silu(float t) { return silu(vec4(t)).x; }

vec4 silu_derivative(vec4 t) {
    const SiluParts p = silu_parts(t);
    precise const vec4 below = p.r * p.e * (1.0 - p.a * p.r) * kSiluUnit;
    const vec4 above = p.r + p.a * p.r * p.r * (p.e * kSiluUnit);
    return mix(above, below, lessThan(t, vec4(0.0)));
}
float silu_derivative(float t) { return silu_derivative(vec4(t)).x; }

#endif
