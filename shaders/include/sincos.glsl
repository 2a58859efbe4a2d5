// Sine and cosine within 2 ulp of 1: the built-in ones may be 2^-11 off. Polynomials of the Cephes library
// (Moshier) for |r| <= pi/4.

#ifndef SPLAT_SINCOS_GLSL
#define SPLAT_SINCOS_GLSL

// (sin, cos) of r + quadrant * pi/2.
vec2 sincos_reduced(float r, int quadrant) {
    precise const float z = r * r;
    precise const float s = r + r * z * (-1.6666654611e-1 + z * (8.3321608736e-3 - z * 1.9515295891e-4));
    precise const float c = 1.0 - 0.5 * z +
                            z * z * (4.166664568298827e-2 - z * (1.388731625493765e-3 - z * 2.443315711809948e-5));
    const vec2 turned = (quadrant & 1) != 0 ? vec2(c, -s) : vec2(s, c);
    return (quadrant & 3) >= 2 ? -turned : turned;
}

// (sin x, cos x) for |x| < 8192: reduction by pi/2 in three parts.
vec2 sincos(float x) {
    precise const float n = roundEven(x * 0.636619772);
    precise const float r = ((x - n * 1.5703125) - n * 4.837512969970703125e-4) - n * 7.54978995489188216e-8;
    return sincos_reduced(r, int(n));
}

// (sin, cos) of 2 pi a b for |a|, |b| < 2^60, over any number of turns: the product is exact as a sum of two
// floats (Dekker 1971; fma need not be one operation), and loses whole turns before it is multiplied by 2 pi.
vec2 sincos_turns(float a, float b) {
    precise const float product = a * b;
    precise const float wide_a = 4097 * a;
    precise const float wide_b = 4097 * b;
    precise const float high_a = wide_a - (wide_a - a);
    precise const float high_b = wide_b - (wide_b - b);
    precise const float low_a = a - high_a;
    precise const float low_b = b - high_b;
    precise const float rest =
        ((high_a * high_b - product) + high_a * low_b + low_a * high_b) + low_a * low_b;
    precise const float few = (product - roundEven(product)) + (rest - roundEven(rest));
    precise const float turns = few - roundEven(few);
    precise const float n = roundEven(4 * turns);
    precise const float r = (turns - 0.25 * n) * 6.28318530717958648;
    return sincos_reduced(r, int(n));
}

#endif
