#version 460
// Normal of every Gaussian in every view: the axis of its smallest scale (the first of equals), in
// camera coordinates, facing the camera. One invocation computes one item (project_items.glsl). Items
// that reach no tile get 0.
// Bindings: gaussians [N][3], cameras [V][6], counts [V*N]; normals [V*N] vec4; view_ranges.
// Specialisation: kFlags.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "finite.glsl"
#include "projection.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kProjectFlagsId) const uint kFlags = 0;
QUADS(0, gaussians);
TABLE(1, cameras);
UINTS(2, counts);
QUADS_OUT(3, normals);
UINT_TABLE(4, view_ranges);
layout(push_constant) uniform Push { ProjectParams params; };

#include "raster/project_items.glsl"

void main() {
    uint index, view_index, item;
    if (!item_of_invocation(index, view_index, item)) return;
    const vec3 scale = LD4(gaussians, index * 3 + 1).xyz;
    const vec4 q = LD4(gaussians, index * 3 + 2);
    View view;
    LOAD_VIEW(view, cameras, view_index);
    const mat3 axes = quaternion_matrix((kFlags & kFlagGsplat) != 0 ? normalize(shrunk(q)) : q);
    const vec3 axis = scale.x <= scale.y && scale.x <= scale.z ? axes[0]
                      : scale.y <= scale.z                     ? axes[1]
                                                               : axes[2];
    const vec3 normal = normalize(view.rotation * axis);
    const vec3 mean = view.rotation * LD4(gaussians, index * 3).xyz + view.translation;
    const bool known = LD1(counts, item) > 0 && finite(normal);
    ST4(normals, item, known ? vec4(dot(normal, mean) > 0.0 ? -normal : normal, 0) : vec4(0));
}
