// silu(t) = t / (1 + exp(-t)); with s = sigmoid(t) its derivative is s + t * s * (1 - s).
//
// Beyond 89 exp(-t) or s is 0 in float32. Inputs are bounded there, so that no infinity meets a 0. The bounds
// compare bits: drivers may turn NaN into a bound of min() and max().

#ifndef SPLAT_SILU_GLSL
#define SPLAT_SILU_GLSL

float sigmoid(float t) {
    const bool least = floatBitsToUint(t) - 0xC2B00000u <= 0xFF800000u - 0xC2B00000u;  // -infinity to -88
    return 1.0 / (1.0 + exp(least ? 88.0 : -t));
}

// -89 for numbers from -infinity to there.
vec4 bounded_below(vec4 t) {
    return mix(t, vec4(-89.0), lessThanEqual(floatBitsToUint(t) - 0xC2B20000u, uvec4(0xFF800000u - 0xC2B20000u)));
}

// +-89 for larger numbers of either sign.
vec4 bounded(vec4 t) {
    const uvec4 bits = floatBitsToUint(t), size = bits & 0x7FFFFFFFu;
    return mix(t, uintBitsToFloat((bits & 0x80000000u) | 0x42B20000u),
               lessThanEqual(size - 0x42B20000u, uvec4(0x7F800000u - 0x42B20000u)));
}

vec4 silu(vec4 t) {
    const vec4 u = bounded_below(t);
    return u / (1.0 + exp(-u));
}
float silu(float t) { return silu(vec4(t)).x; }

vec4 silu_derivative(vec4 t) {
    const vec4 u = bounded(t);
    const vec4 s = 1.0 / (1.0 + exp(-u));
    return s + u * s * (1.0 - s);
}
float silu_derivative(float t) { return silu_derivative(vec4(t)).x; }

#endif
