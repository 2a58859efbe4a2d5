// Sine and cosine within 2 ulp of 1 for |x| < 8192: the built-in ones may be 2^-11 off. Reduction by
// pi/2 in three parts, polynomials of the Cephes library (Moshier) for |r| <= pi/4.

#ifndef SPLAT_SINCOS_GLSL
#define SPLAT_SINCOS_GLSL

// (sin x, cos x).
vec2 sincos(float x) {
    precise const float n = roundEven(x * 0.636619772);
    precise const float r = ((x - n * 1.5703125) - n * 4.837512969970703125e-4) - n * 7.54978995489188216e-8;
    precise const float z = r * r;
    precise const float s = r + r * z * (-1.6666654611e-1 + z * (8.3321608736e-3 - z * 1.9515295891e-4));
    precise const float c = 1.0 - 0.5 * z +
                            z * z * (4.166664568298827e-2 - z * (1.388731625493765e-3 - z * 2.443315711809948e-5));
    const int quadrant = int(n) & 3;
    const vec2 turned = (quadrant & 1) != 0 ? vec2(c, -s) : vec2(s, c);
    return quadrant >= 2 ? -turned : turned;
}

#endif
