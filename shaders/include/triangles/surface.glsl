// Base colours of points on triangles. Needs `corner_texcoords`, `attributes`, `texels`, `params`.

#ifndef SPLAT_TRIANGLES_SURFACE_GLSL
#define SPLAT_TRIANGLES_SURFACE_GLSL

float number_of(uint word) { return uintBitsToFloat(LD1(texels, word)); }
float attribute_at(uint word) { return uintBitsToFloat(LD1(attributes, word)); }

uint material_at(uint material) { return kByteValues + kMaterialWords * material; }

vec4 texel_of(uint word) {
    const uint bytes = LD1(texels, word);
    return vec4(number_of(bytes & 255u), number_of(bytes >> 8 & 255u), number_of(bytes >> 16 & 255u),
                float(bytes >> 24) / 255.0);
}

// u within 0 to 1. wrap: repeat, clamp, mirror.
float wrapped(float u, uint wrap) {
    if (wrap == 0) return u - floor(u);
    if (wrap == 1) return clamp(u, 0.0, 1.0);
    const float turn = u - 2 * floor(u / 2);
    return turn > 1 ? 2 - turn : turn;
}

// A texel that may lie one outside; any one for coordinates that are not finite.
int inside_of(int at, int size, uint wrap) {
    const int turned = wrap != 0 ? at : at < 0 ? at + size : at >= size ? at - size : at;
    return clamp(turned, 0, size - 1);
}

// `area`: of a sample, in those of u and v.
vec4 texture_at(uint material, vec2 uv, float area) {
    const uint texture_word = params.textures_at + kTextureWords * LD1(texels, material + kMaterialTexture);
    const uint bits = LD1(texels, material + kMaterialBits);
    const uint wrap_u = bits & 3u, wrap_v = bits >> kWrapVBit & 3u;
    uint begin = LD1(texels, texture_word);
    ivec2 size = ivec2(LD1(texels, texture_word + 1), LD1(texels, texture_word + 2));
    const uint levels = LD1(texels, texture_word + 3);
    float covered = area * float(size.x) * float(size.y);
    for (uint level = 1; level < levels; ++level) {  // the level whose texels are most like samples
        if (!(covered > 2)) break;
        begin += uint(size.x) * uint(size.y);
        size = max(size / 2, ivec2(1));
        covered /= 4;
    }
    const vec2 at = vec2(wrapped(uv.x, wrap_u), wrapped(uv.y, wrap_v)) * vec2(size);
    if ((bits >> kNearestBit & 1u) != 0) {
        const ivec2 texel = clamp(ivec2(at), ivec2(0), size - 1);
        return texel_of(begin + uint(texel.y) * uint(size.x) + uint(texel.x));
    }
    const vec2 low = floor(at - 0.5), part = at - 0.5 - low;
    const int x0 = inside_of(int(low.x), size.x, wrap_u), x1 = inside_of(int(low.x) + 1, size.x, wrap_u);
    const uint row0 = begin + uint(inside_of(int(low.y), size.y, wrap_v)) * uint(size.x);
    const uint row1 = begin + uint(inside_of(int(low.y) + 1, size.y, wrap_v)) * uint(size.x);
    return mix(mix(texel_of(row0 + uint(x0)), texel_of(row0 + uint(x1)), part.x),
               mix(texel_of(row1 + uint(x0)), texel_of(row1 + uint(x1)), part.x), part.y);
}

vec2 texcoord(uint index) {
    return vec2(attribute_at(params.texcoords_at + 2 * index), attribute_at(params.texcoords_at + 2 * index + 1));
}

vec4 vertex_color(uint vertex) {
    const uint word = params.colors_at + 2 * vertex;
    return vec4(unpackUnorm2x16(LD1(attributes, word)), unpackUnorm2x16(LD1(attributes, word + 1)));
}

// Linear RGB and opacity. `corners`: of triangle number `triangle`; `spread`: of a sample, as a multiple of twice the
// triangle's area.
vec4 base_color(uvec4 corners, uint triangle, vec3 weights, float spread) {
    const uint material = material_at(corners.w);
    vec4 color = vec4(number_of(material), number_of(material + 1), number_of(material + 2), number_of(material + 3));
    if ((params.mesh_bits & kMeshColors) != 0)
        color *= weights.x * vertex_color(corners.x) + weights.y * vertex_color(corners.y) +
                 weights.z * vertex_color(corners.z);
    if ((params.mesh_bits & kMeshTexcoords) == 0 || LD1(texels, material + kMaterialTexture) == kNoTriangle)
        return color;
    const uint word = ((params.mesh_bits & kMeshTexcoordIndices) != 0 ? 3 : 4) * triangle;
    const uvec3 index = uvec3(LD1(corner_texcoords, word), LD1(corner_texcoords, word + 1),
                              LD1(corner_texcoords, word + 2));
    if (max(max(index.x, index.y), index.z) == kNoTriangle) return color;
    const vec3 row_u = vec3(number_of(material + kMaterialPlace), number_of(material + kMaterialPlace + 1),
                            number_of(material + kMaterialPlace + 2));
    const vec3 row_v = vec3(number_of(material + kMaterialPlace + 3), number_of(material + kMaterialPlace + 4),
                            number_of(material + kMaterialPlace + 5));
    const vec2 a = texcoord(index.x), b = texcoord(index.y), c = texcoord(index.z);
    const vec2 given = weights.x * a + weights.y * b + weights.z * c;
    const vec2 uv = vec2(dot(row_u, vec3(given, 1)), dot(row_v, vec3(given, 1)));
    const vec2 side_b = b - a, side_c = c - a;
    const float twice = abs((side_b.x * side_c.y - side_b.y * side_c.x) * (row_u.x * row_v.y - row_u.y * row_v.x));
    return color * texture_at(material, uv, spread * twice);
}

// Area of a sample at depth z, as a multiple of twice the triangle's area, whose normal has that length.
float spread_of(vec3 normal, vec2 pixel, float z) {
    const vec3 ray = vec3((pixel.x - TABLE4(view, kViewUp).w) * TABLE4(view, kViewRight).w,
                          (pixel.y - TABLE4(view, kViewLight).w) * TABLE4(view, kViewDown).w, 1);
    const vec3 turned = vec3(dot(TABLE4(view, kViewRight).xyz, normal), dot(TABLE4(view, kViewDown).xyz, normal),
                             dot(TABLE4(view, kViewFront).xyz, normal));
    return z * z * TABLE4(view, kViewScale).z / abs(dot(turned, ray));
}

// Whether a point of this opacity is there, in sample number `place` of `count`.
bool is_there(uint material, float opacity, float place, float count) {
    const uint mode = LD1(texels, material + kMaterialBits) >> kAlphaBit & 3u;
    if (mode == 0) return true;
    if (mode == 1) return opacity >= number_of(material + kMaterialCutoff);
    return opacity > (place + 0.5) / count;
}

// Number of a sample of a pixel, spread: Bayer's order.
uint spread_place(uvec2 at, uint samples) {
    uint place = 0;
    for (uint bit = 1; bit < samples; bit *= 2)
        place = place << 2 | (((at.x ^ at.y) & bit) != 0 ? 2u : 0u) | ((at.y & bit) != 0 ? 1u : 0u);
    return place;
}

#endif
