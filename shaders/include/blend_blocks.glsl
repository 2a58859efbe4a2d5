// Shared by the blending kernels that leave out what a box of pixels cannot see: those for CPU devices test 8 list
// entries at once and blend those that can reach a block of 8 x 8 pixels.

#ifndef SPLAT_BLEND_BLOCKS_GLSL
#define SPLAT_BLEND_BLOCKS_GLSL

// Arrays that ST4 and ST2 of store.glsl write. What a part of a list leaves for the next is read as name_plain.
#define CARRIED_AS(slot, name, T) layout(set = 0, binding = slot, std430) buffer name##_ { T name[]; }  // accumulates
#define CARRIED(slot, name, packed, plain) CARRIED_AS(slot, name, packed); CARRIED_AS(slot, name##_plain, plain)

// True if any pixel centre of a box may have alpha >= kAlphaMin; low and high: its corners less the mean. Tests
// the least |L^T p|^2 over the box of its centres: 0 if the mean is inside, else on an edge that faces it.
// shape: l11, l21, l22, reach.
bool reaches_box(vec2 low, vec2 high, vec4 shape) {
    const vec3 l = shape.xyz;
    const vec2 near = clamp(vec2(0), low, high);
    const float on_x = clamp(-l.x * l.y * near.x / (l.y * l.y + l.z * l.z), low.y, high.y);
    const float on_y = clamp(-l.y * near.y / l.x, low.x, high.x);
    const vec2 u = l.x * vec2(near.x, on_y) + l.y * vec2(on_x, near.y);
    const vec2 v = l.z * vec2(on_x, near.y);
    const vec2 power = u * u + v * v;
    return min(power.x, power.y) <= shape.w;
}

// True if a box of pixel centres may see a Gaussian whose pixels lie in another (ray_form.glsl).
bool boxes_meet(vec2 low, vec2 high, vec4 box) {
    return all(lessThanEqual(box.xy, high)) && all(lessThanEqual(low, box.zw));
}

// The same of the block that starts at the centre `corner`.
bool reaches_block(vec2 corner, vec2 mean, vec4 shape) {
    return reaches_box(corner - mean, corner + 7.0 - mean, shape);
}

// Pixel of an invocation in its tile: those of a subgroup that has consecutive ones make a box of 4 x 2, 4 x 4, 8 x 4
// or 8 x 8.
uvec2 pixel_of(uint lane) {
    return uvec2((lane & 1u) | (lane >> 1 & 2u) | (lane >> 2 & 4u) | (lane >> 3 & 8u),
                 (lane >> 1 & 1u) | (lane >> 2 & 2u) | (lane >> 3 & 4u) | (lane >> 4 & 8u));
}

#endif
