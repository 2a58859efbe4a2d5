// What a pixel keeps while its list is blended front to back: equations and outputs of blend_forward.comp, also for
// blend_forward_gpu.comp. Include after the bindings, the constants and kBatch.

#ifndef SPLAT_BLEND_PIXEL_GLSL
#define SPLAT_BLEND_PIXEL_GLSL

// A batch of list entries: mean in tile coordinates, opacity, depth; l11, l21, l22, reach; colour, Gaussian.
shared vec4 batch_a[kBatch];
shared vec4 batch_b[kBatch];
shared vec4 batch_c[kBatch];
shared vec4 batch_e[kRays ? kBatch : 1];  // e of ray_form.glsl; its l takes the place of l11 to reach

void stage(uint place, uint item, uvec2 corner, uint view) {
    batch_a[place] = splats[item * 3] - vec4(corner, 0, 0);
    batch_b[place] = splats[kRays ? params.rays + item * 2 : item * 3 + 1];
    if (kRays) batch_e[place] = splats[params.rays + item * 2 + 1];
    batch_c[place] = kNormals ? normals[item] : splats[item * 3 + 2];
    if (kIds) batch_c[place].w = float(item - item_of_first(view, params.gaussians, TABLE4(background, 1 + view)));
}

struct Pixel {
    vec2 centre;
    uint index;           // in the images
    bool inside, drawn;   // inside its view; inside the image
    float t;
    bool stopped;
    uint entries, contributors;
    float most, id;
    float median;
    vec4 sum;  // rgb, depth
};

// `at`: in the tile at `corner`. `entries`: of the list up to the end of this part.
Pixel begin_pixel(uvec2 at, uvec2 corner, uint view, uint entries) {
    const uvec2 to = corner + at, image_size = uvec2(params.width, params.height);
    Pixel p;
    p.centre = vec2(at) + 0.5;
    p.index = (view * params.height + to.y) * params.width + to.x;
    p.inside = all(lessThan(to, kSizes ? uvec2(TABLE4(background, 1 + view).xy) : image_size));
    p.drawn = kSizes ? all(lessThan(to, image_size)) : p.inside;
    const bool carried = kParts && params.part_begin > 0 && p.drawn;
    const vec4 before = carried ? image[p.index] : vec4(0, 0, 0, p.inside ? 1.0 : -1.0);
    const vec4 more = carried && kExtra ? extra[p.index] : vec4(0, 0, 0, -1.0);
    p.t = abs(before.a);
    p.stopped = before.a < 0.0;
    p.entries = !p.stopped ? entries : carried && !kNormals ? uint(state[p.index].y) : 0;
    p.contributors = uint(more.z);
    p.most = more.y;
    p.id = more.w;
    p.median = carried && kMedian ? median[p.index] : 0.0;
    p.sum = vec4(before.rgb, more.x);
    return p;
}

// Blends entry `place` of the batch, which is number `entry` of the list.
void blend(uint place, uint entry, inout Pixel p) {
    const vec4 a = batch_a[place];
    float depth = a.w;
    precise float power;
    if (kRays)
        power = ray_maximum(a.xy - p.centre, batch_b[place], batch_e[place], a.w, params.near_plane, depth);
    else
        power = log2_weight(a.xy, batch_b[place].xyz, p.centre);
    precise float alpha = min(kAlphaMax, density(a.z, power, kCut));
    alpha = alpha >= kAlphaMin ? alpha : 0.0;
    const float next = p.t - p.t * alpha;
    const bool stops = !p.stopped && next < params.stop_below;
    p.entries = stops ? entry : p.entries;
    p.stopped = p.stopped || stops;
    const float w = p.stopped ? 0.0 : alpha * p.t;
    if (kMedian) p.median = w > 0.0 && p.t > kMedianTransmittance ? depth : p.median;
    p.t = p.stopped ? p.t : next;
    p.sum += w * vec4(batch_c[place].xyz, depth);
    p.contributors += w > 0.0 ? 1 : 0;
    if (kIds) {
        p.id = w > p.most ? batch_c[place].w : p.id;
        p.most = max(p.most, w);
    }
}

// `last`: no part of the list follows.
void write_pixel(Pixel p, bool last) {
    if (!p.drawn) return;
    if (!kNormals) state[p.index] = vec2(p.t, float(p.entries));
    if (kMedian) median[p.index] = p.median;
    if (!last) {
        image[p.index] = vec4(p.sum.rgb, p.stopped ? -p.t : p.t);
        if (kExtra) extra[p.index] = vec4(p.sum.a, p.most, float(p.contributors), p.id);
        return;
    }
    const vec3 behind = kNormals || (kSizes && !p.inside) ? vec3(0) : p.t * TABLE4(background, 0).rgb;
    image[p.index] = vec4(p.sum.rgb + behind, 1.0 - p.t);
    const float expected = p.sum.w / max(1.0 - p.t, kExpectedAlphaMin);
    if (kExtra) extra[p.index] = vec4(p.sum.w, expected, float(p.contributors), kIds ? p.id : 0.0);
}

#endif
