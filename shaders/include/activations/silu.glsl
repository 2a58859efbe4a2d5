// silu(t) = t * s, s = sigmoid(t); its derivative s + t * s * (1 - s). Overflow of exp is harmless: s
// becomes exactly 0.

#ifndef SPLAT_SILU_GLSL
#define SPLAT_SILU_GLSL

float sigmoid(float t) { return 1.0 / (1.0 + exp(min(-t, 88.0))); }
vec4 sigmoid(vec4 t) { return 1.0 / (1.0 + exp(min(-t, vec4(88.0)))); }

float silu(float t) { return t * sigmoid(t); }
vec4 silu(vec4 t) { return t * sigmoid(t); }

float silu_derivative(float t) {
    const float s = sigmoid(t);
    return s + t * s * (1.0 - s);
}
vec4 silu_derivative(vec4 t) {
    const vec4 s = sigmoid(t);
    return s + t * s * (1.0 - s);
}

#endif
