#version 460
// Normals of the drawn surface against those of a map m. With P = E ray the place of a pixel, E = depth / alpha,
//   a = P(right) - P(left), b = P(below) - P(above), c = b x a, n = c / |c|, loss = 1 - n m
//   g = d loss / dc = -(m - n (n m)) / |c|;  d loss / da = g x b, d loss / db = a x g
// and slopes of the loss by E of the left, right, upper and lower neighbour. Pixels count whose map has a normal and
// whose neighbours are drawn. One workgroup computes one chunk of pixels and sums the loss.
// Bindings: image [V,H,W] quads, extra [V,H,W] quads, map [H,W] uvec2, slopes [H,W] quads, partial: the third plane.
#extension GL_GOOGLE_include_directive : require
#include "losses/prior_loss.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Image { vec4 image[]; };
layout(set = 0, binding = 1, std430) readonly buffer Extra { vec4 extra[]; };
layout(set = 0, binding = 2, std430) readonly buffer Map { uvec2 map[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Slopes { vec4 slopes[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Partial { vec4 partial[]; };

#include "reduce.glsl"

// Adds the loss of a pixel whose map has a normal, which is not at the border. Returns its slopes.
vec4 slopes_at(uint i, inout vec4 sum) {
    const uint at[4] = uint[4](i - 1, i + 1, i - dims.width, i + dims.width);
    vec3 place[4];
    for (uint k = 0; k < 4; ++k) {
        const float alpha = image[dims.image + at[k]].a;
        if (!(alpha > kLeastAlpha)) return vec4(0);
        place[k] = extra[dims.image + at[k]].x / alpha * ray_of(at[k]);
    }
    const vec3 a = place[1] - place[0], b = place[3] - place[2], c = cross(b, a);
    const float size = length(c);
    if (!(size > 0)) return vec4(0);
    const vec3 n = c / size, m = normal_of(map[i]);
    const float agrees = dot(n, m);
    const vec3 g = (n * agrees - m) / size;
    const vec3 by_a = cross(g, b), by_b = cross(a, g);
    sum.x += 1 - agrees;
    return vec4(-dot(by_a, ray_of(at[0])), dot(by_a, ray_of(at[1])), -dot(by_b, ray_of(at[2])),
                dot(by_b, ray_of(at[3])));
}

void main() {
    const uint pixels = dims.width * dims.height;
    const uint group = gl_WorkGroupID.y * dims.groups_x + gl_WorkGroupID.x;
    const uint last = min((group + 1) * dims.chunk, pixels);
    vec4 sum = vec4(0);
    for (uint i = group * dims.chunk + gl_LocalInvocationID.x; i < last; i += gl_WorkGroupSize.x)
        slopes[i] = has_normal(map[i]) ? slopes_at(i, sum) : vec4(0);
    sum = workgroup_sum(sum);
    if (gl_LocalInvocationID.x == 0 && group < dims.chunks) partial[2 * dims.chunks + group] = sum;
}
