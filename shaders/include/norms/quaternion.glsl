// Lengths of rotations, also where squares overflow.

#ifndef SPLAT_QUATERNION_GLSL
#define SPLAT_QUATERNION_GLSL

const float kMostSquare = 1e37;

float norm_of(vec4 q) {
    const float square = dot(q, q);
    if (square < kMostSquare) return sqrt(square);
    const vec4 small = q * 8.2718061e-25;  // 2^-80
    return sqrt(dot(small, small)) / 8.2718061e-25;
}

vec4 unit_of(vec4 q) { return dot(q, q) < kMostSquare ? normalize(q) : q / norm_of(q); }

#endif
