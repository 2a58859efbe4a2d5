// Corners of triangles as a view sees them, and their edge functions, exact. Needs `view`, `vertices`, `params`.
//
// A corner becomes whole numbers (X, Y, Z), of 21 to 24 bits: Z is the depth, 16 H (X, Y) / Z its subpixels, 1/16 of a
// pixel, right of and below the middle of the image (H is a power of two, about half its side). A sample at the
// subpixels (x, y) lies inside the triangle a, b, c if r.(a x b), r.(b x c) and r.(c x a) have one sign, with
// r = (x, y, 16 H): Olano and Greer 1997, doi:10.1145/258694.258723. These numbers have 64 bits and no rounding, and
// where one is 0 the sample counts as moved by (e, e^2), e > 0 without end small. So of the two triangles at an edge
// exactly one has the sample, whatever the numbers of their corners.

#ifndef SPLAT_TRIANGLES_SETUP_GLSL
#define SPLAT_TRIANGLES_SETUP_GLSL

#include "triangles/wide.glsl"

struct Corner {
    vec3 vertex;  // in the units of the mesh on the device
    ivec3 at;     // (X, Y, Z)
    float z;      // before it was rounded
};

float along(vec4 row, vec3 v) {
    precise float sum = row.x * v.x;
    sum = sum + row.y * v.y;
    sum = sum + row.z * v.z;
    sum = sum + row.w;
    return sum;
}

ivec3 vertex_of(uint vertex) { return ivec3(LDU4(vertices, vertex).xyz); }

Corner corner_of(uint vertex) {
    Corner corner;
    corner.vertex = vec3(vertex_of(vertex));
    corner.z = along(TABLE4(view, kViewZ), corner.vertex);
    corner.at = ivec3(roundEven(vec3(along(TABLE4(view, kViewX), corner.vertex),
                                     along(TABLE4(view, kViewY), corner.vertex), corner.z)));
    return corner;
}

// The subpixel in the middle of the image, from its corner.
ivec2 middle() { return ivec2(params.width / 2, params.height / 2) * int(kSubpixels); }

struct Edge {
    Wide at;  // less 1 where a 0 there counts as negative
    Wide right, down;  // what a subpixel adds
};

// The function of the edge from a to b, from a sample on.
Edge edge_of(ivec3 a, ivec3 b, ivec3 sample_at) {
    Edge edge;
    edge.right = wide_determinant(a.y, b.z, a.z, b.y);
    edge.down = wide_determinant(a.z, b.x, a.x, b.z);
    edge.at = wide_sum(wide_times(edge.right, sample_at.x), wide_times(edge.down, sample_at.y));
    edge.at = wide_sum(edge.at, wide_times(wide_determinant(a.x, b.y, a.y, b.x), sample_at.z));
    const bool zero = wide_is_zero(edge.right);
    const bool positive = zero ? edge.down.high >= 0 && !wide_is_zero(edge.down) : edge.right.high >= 0;
    if (!positive) edge.at = wide_difference(edge.at, Wide(1, 0));
    return edge;
}

Wide value_at(Edge edge, int right, int down) {
    return wide_sum(edge.at, wide_sum(wide_times(edge.right, right), wide_times(edge.down, down)));
}

struct Triangle {
    Edge ab, bc, ca;
    vec3 z;
};

Triangle triangle_of(Corner a, Corner b, Corner c, ivec2 subpixel) {
    const ivec3 at = ivec3(subpixel - middle(), int(TABLE4(view, kViewScale).y));
    return Triangle(edge_of(a.at, b.at, at), edge_of(b.at, c.at, at), edge_of(c.at, a.at, at), vec3(a.z, b.z, c.z));
}

struct Hit {
    bool inside;
    bool front;    // the corners turn counterclockwise
    vec3 weights;  // what corners count; their sum is 1
    float z;
};

Hit hit_at(Triangle triangle, int right, int down) {
    const Wide ab = value_at(triangle.ab, right, down);
    const Wide bc = value_at(triangle.bc, right, down);
    const Wide ca = value_at(triangle.ca, right, down);
    Hit hit;
    hit.front = ab.high < 0;
    hit.inside = (ab.high < 0) == (bc.high < 0) && (ab.high < 0) == (ca.high < 0);
    const vec3 sides = vec3(wide_magnitude(bc), wide_magnitude(ca), wide_magnitude(ab));
    hit.weights = sides / max(sides.x + sides.y + sides.z, 1.0);
    hit.z = hit.weights.x * triangle.z.x + hit.weights.y * triangle.z.y + hit.weights.z * triangle.z.z;
    hit.inside = hit.inside && hit.z >= TABLE4(view, kViewScale).x;
    return hit;
}

#endif
