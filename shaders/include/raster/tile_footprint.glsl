// Tiles that a projected Gaussian can reach, for counting and for emitting pairs.
//
// alpha(q) = opacity * exp2(-|L^T q|^2) for a pixel centre at offset q from the mean, with
// |L^T q|^2 = (l11 qx + l21 qy)^2 + (l22 qy)^2. A pixel sees the Gaussian only within the ellipse
// |L^T q|^2 <= log2(255 opacity) =: reach, with kFlagCut3Sigma at most kCutReach. Per row of tiles the
// ellipse's exact interval of columns: Hanson et al. 2024, Speedy-Splat (SnugBox and AccuTile), here for rows
// of pixel centres. With kFlagRayMaximum a box of pixels is given instead (ray_form.glsl).

#ifndef SPLAT_TILE_FOOTPRINT_GLSL
#define SPLAT_TILE_FOOTPRINT_GLSL

#include "params/project_params.h"
#include "raster_constants.h"

// Bound of the rounding error of |L^T q|^2 in log2 units, so that no pixel is lost. 4e-3 holds for
// offsets of 4096 pixels (l11 <= 1.56, 2^-23 each for two products and a sum, times 2 sqrt(8)).
const float kReachMargin = 4e-3;
// log2 units of kMaxSigma^2 / 2.
const float kReachMax = 7.9989;

struct Footprint {
    vec2 mean;
    float l11, l21, l22;
    float reach;
    ivec4 rect;   // tiles x0, y0, x1, y1, ends excluded; within the window
    bool exact;
};

// A footprint of up to 6 rows by 15 columns packs into uvec2. x: the key of its first column in its first row
// that has tiles (below max_window_tiles(), src/raster/raster_desc.h) | rows 4 and 5 << 16; y: rows 0 to 3, from
// that one on, 8 bits each, length | first column << 4. A larger footprint is (kNotPacked, number of tiles) and
// computed again.
const int kPackedRows = 6;
const int kPackedColumns = 15;
const uint kNotPacked = 0xFFFFu;

uint tiles_of(uvec2 packed) {
    const uint lengths = (packed.y & 0x0F0F0F0Fu) + (packed.x >> 16 & 0x0F0Fu);
    return packed.x == kNotPacked ? packed.y : lengths * 0x01010101u >> 24;
}

ivec2 clamped_tiles(vec2 first, vec2 last, ivec2 low, ivec2 high, out ivec2 end) {
    // Tiles of the pixel centres first <= i + 0.5 <= last. Clamps floats before converting them.
    const vec2 least = vec2(low) * float(kTileSize) - 1.0, most = vec2(high) * float(kTileSize) + 1.0;
    const ivec2 i0 = ivec2(clamp(ceil(first - 0.5), least, most));
    const ivec2 i1 = ivec2(clamp(floor(last - 0.5), least, most));
    end = clamp((i1 >> 4) + 1, low, high);
    return clamp(i0 >> 4, low, high);
}

// log2(255 opacity), or where a Gaussian is cut if that is less, with the margin.
float opacity_reach(float opacity, uint flags) {
    const float reach = log2(255.0 * opacity);
    return ((flags & kFlagCut3Sigma) != 0 ? min(reach, kCutReach) : reach) + kReachMargin;
}

// a: mean, opacity, depth; b: l11, l21, l22, reach, or the box; half_size: of the 3dgs square (gsplat: unread).
Footprint tile_footprint(vec4 a, vec4 b, float half_size, uint flags, ivec2 size, ivec2 rows) {
    Footprint f;
    f.mean = a.xy;
    f.l11 = b.x;
    f.l21 = b.y;
    f.l22 = b.z;
    f.exact = (flags & kFlagExactTiles) != 0;
    const ivec2 low = ivec2(0, rows.x);
    const ivec2 high = ivec2((size.x + 15) >> 4, rows.y);
    const vec2 corner = vec2(size) - 0.5;
    ivec2 end = high;
    ivec2 begin = low;
    if ((flags & kFlagRayMaximum) != 0) {
        const vec2 last = min(b.zw, corner);
        const bool between = any(greaterThan(ceil(b.xy - 0.5), floor(last - 0.5)));
        begin = clamped_tiles(b.xy, last, low, high, end);
        f.rect = ivec4(begin, f.exact && between ? begin : end);
        f.exact = false;
        return f;
    }
    const bool by_opacity = (flags & kFlagOpacityExtent) != 0;
    f.reach = by_opacity || f.exact ? b.w : kReachMax + kReachMargin;
    precise float root = sqrt(max(f.reach, 0.0));
    precise vec2 extent = vec2(root * length(b.yz) / (b.x * b.z), root / b.z);
    if (by_opacity || (flags & kFlagGsplat) != 0)
        begin = clamped_tiles(f.mean - extent, min(f.mean + extent, corner), low, high, end);
    if ((flags & kFlagGsplat) == 0) {
        // int((u - r) / 16) to int((u + r + 15) / 16) with u counted from the first pixel's centre.
        const vec2 u = f.mean - 0.5;
        const vec2 tiles = vec2(high);
        begin = max(begin, ivec2(clamp((u - half_size) / float(kTileSize), vec2(0), tiles)));
        end = min(end, ivec2(clamp((u + half_size + 15.0) / float(kTileSize), vec2(0), tiles)));
    }
    f.rect = ivec4(begin, end);
    return f;
}

// Columns [x, y) of tiles in one row of the footprint.
ivec2 tile_columns(Footprint f, int row, ivec2 size) {
    if (!f.exact) return f.rect.xz;
    precise float root = sqrt(max(f.reach, 0.0));
    precise float high = root / f.l22;
    // Offsets of the row's first and last pixel centres, within the ellipse.
    precise float q0 = max(float(row * 16) + 0.5 - f.mean.y, -high);
    precise float q1 = min(min(float(row * 16 + 16), float(size.y)) - 0.5 - f.mean.y, high);
    if (!(q0 <= q1)) return ivec2(0);
    precise float at = -f.l21 / f.l22 * root / length(vec2(f.l21, f.l22));
    precise float right_q = clamp(at, q0, q1);
    precise float left_q = clamp(-at, q0, q1);
    precise float right_w = f.l22 * right_q, left_w = f.l22 * left_q;
    precise float right = (sqrt(max(f.reach - right_w * right_w, 0.0)) - f.l21 * right_q) / f.l11;
    precise float left = (-sqrt(max(f.reach - left_w * left_w, 0.0)) - f.l21 * left_q) / f.l11;
    const float most = float(f.rect.z * 16 + 1), least = float(f.rect.x * 16 - 1);
    const int i0 = int(clamp(ceil(f.mean.x + left - 0.5), least, most));
    const int i1 = int(clamp(min(floor(f.mean.x + right - 0.5), float(size.x - 1)), least, most));
    if (i0 > i1) return ivec2(0);
    return clamp(ivec2(i0 >> 4, (i1 >> 4) + 1), f.rect.x, f.rect.z);
}

#endif
