// Tests for NaN and infinity by bit pattern: GLSL lets a compiler assume that neither occurs.

#ifndef SPLAT_FINITE_GLSL
#define SPLAT_FINITE_GLSL

#include "keep_nan.glsl"

bool finite(float x) { return (floatBitsToUint(x) & 0x7F800000u) != 0x7F800000u; }
bool finite(vec3 v) { return finite(v.x) && finite(v.y) && finite(v.z); }
bool finite(vec4 v) { return finite(v.xyz) && finite(v.w); }

#endif
