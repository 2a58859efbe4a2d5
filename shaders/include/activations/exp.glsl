// exp(x) as a product of three numbers, so that it neither overflows nor underflows before the result does.

#ifndef SPLAT_EXP_GLSL
#define SPLAT_EXP_GLSL

#include "keep_nan.glsl"

// exp(x) = mantissa * first * second, the last two powers of two.
struct ExpParts { vec4 mantissa, first, second; };

// exp(high + low) / 2^k, k about high / ln 2, by exp(r) for |r| < 0.44, a polynomial within 1e-8. The built-in exp may
// be 3 + 2|x| ulp off.
vec4 exp_mantissa(vec4 high, vec4 low, vec4 k) {
    precise const vec4 r = ((high - k * 0.693359375) + k * 2.12194440e-4) + low;  // ln 2 in two parts
    return 1.0 + r * (1.0 + r * (0.499999525 + r * (0.166663143 +
                 r * (0.0416765657 + r * (0.00838197238 + r * 0.00134111677)))));
}

ExpParts exp_parts(vec4 high, vec4 low) {
    const vec4 k = clamp(roundEven(high * 1.44269504), vec4(-252.0), vec4(254.0));
    const vec4 first = clamp(k, vec4(-126.0), vec4(127.0));
    return ExpParts(exp_mantissa(high, low, k), uintBitsToFloat(uvec4(ivec4(first) + 127) << 23),
                    uintBitsToFloat(uvec4(ivec4(k - first) + 127) << 23));
}

// exp(x): 0 below -104, infinity above 89.
vec4 exponential(vec4 x) {
    // clamp() may turn NaN into a bound.
    const bvec4 nan = greaterThan(floatBitsToUint(abs(x)), uvec4(0x7f800000u));
    const ExpParts e = exp_parts(mix(clamp(x, vec4(-104.0), vec4(89.0)), x, nan), vec4(0.0));
    precise const vec4 product = e.mantissa * e.first * e.second;
    return product;
}

#endif
