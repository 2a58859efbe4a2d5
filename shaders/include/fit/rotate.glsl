// A vector turned by a quaternion (w, x, y, z) of length 1.
#ifndef SPLAT_ROTATE_GLSL
#define SPLAT_ROTATE_GLSL

vec3 rotate(vec4 q, vec3 v) {
    return v + 2 * cross(q.yzw, cross(q.yzw, v) + q.x * v);
}

#endif
