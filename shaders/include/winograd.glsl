// Winograd's minimal filtering F(m x m, 3 x 3), m = kTile in {2, 4}, after Lavin and Gray 2016:
//   y = A^T [ (G w G^T) * (B^T x B) ] A,   x a tile of m + 2 by m + 2 pixels, y its m by m outputs.
// Each function applies one of the matrices to a column in place: B^T maps m + 2 values to m + 2, A^T returns
// the first m, A (its transpose) takes the first m, the transpose of G returns 3; G is given row by row.
// Points of F(2x2): 0, 1, -1, infinity; of F(4x4): 0, p, -p, q, -q, infinity with p = 5/8 and q = 3/2, whose powers are
// exact in float32. Among pairs between 1/2 and 2 they have about the least error, half that of 1 and 2 (a fifth
// at the worst element).
// Arrays always have rows of kRow, so that the same code serves both tiles.

#ifndef SPLAT_WINOGRAD_GLSL
#define SPLAT_WINOGRAD_GLSL

layout(constant_id = kWinogradTileId) const uint kTile = 4;
const uint kSize = kTile + 2;
const uint kRow = 6;

const float kP = 0.625, kP2 = kP * kP, kP3 = kP2 * kP;
const float kQ = 1.5, kQ2 = kQ * kQ, kQ3 = kQ2 * kQ;
// The factors of G: of each point t, 1 over the product of its differences to the others.
const float kG0 = 1 / (kP2 * kQ2), kGp = 1 / (2 * kP2 * (kP2 - kQ2)), kGq = 1 / (2 * kQ2 * (kQ2 - kP2));

#define COLUMN inout vec4 a, inout vec4 b, inout vec4 c, inout vec4 d, inout vec4 e, inout vec4 f

void apply_bt(COLUMN) {
    if (kTile == 2) {
        const vec4 first = a - c, second = b + c, third = c - b;
        d = b - d, a = first, b = second, c = third;
        return;
    }
    const vec4 first = (kP2 * kQ2) * a - (kP2 + kQ2) * c + e;
    const vec4 even = e - kQ2 * c, odd = kP * (d - kQ2 * b);
    const vec4 even2 = e - kP2 * c, odd2 = kQ * (d - kP2 * b);
    f = (kP2 * kQ2) * b - (kP2 + kQ2) * d + f;
    a = first, b = even + odd, c = even - odd, d = even2 + odd2, e = even2 - odd2;
}

void apply_at(COLUMN) {
    const vec4 sum = b + c, difference = b - c;
    if (kTile == 2) {
        a += sum, b = difference - d;
        return;
    }
    const vec4 sum2 = d + e, difference2 = d - e;
    a += sum + sum2, b = kP * difference + kQ * difference2, c = kP2 * sum + kQ2 * sum2;
    d = kP3 * difference + kQ3 * difference2 + f;
}

void apply_a(COLUMN) {
    if (kTile == 2) {
        d = -b;
        const vec4 sum = a + b;
        c = a - b, b = sum;
        return;
    }
    const vec4 even = a + kP2 * c, odd = kP * b + kP3 * d, even2 = a + kQ2 * c, odd2 = kQ * b + kQ3 * d;
    f = d, b = even + odd, c = even - odd, d = even2 + odd2, e = even2 - odd2;
}

// Element (r, s) of G w G^T is factor_of_g(r, s) times row s of row r of G without factors: one rounding of
// constants and one of the product; factors on both sides would round twice each.
float factor_of_g(uint r, uint s) {
    if (kTile == 2) return ((r + 1) / 2 == 1 ? 0.5 : 1) * ((s + 1) / 2 == 1 ? 0.5 : 1);
    const vec4 row = r == 0  ? vec4(kG0 * kG0, kG0 * kGp, kG0 * kGq, kG0)
                     : r < 3 ? vec4(kG0 * kGp, kGp * kGp, kGp * kGq, kGp)
                     : r < 5 ? vec4(kG0 * kGq, kGp * kGq, kGq * kGq, kGq)
                             : vec4(kG0, kGp, kGq, 1);
    return row[(s + 1) / 2];
}

// Row r of G times (a, b, c), without its factor.
vec4 row_of_g(uint r, vec4 a, vec4 b, vec4 c) {
    if (r == 0) return a;
    if (r == kSize - 1) return c;
    const bool second = r > 2;
    const vec4 even = a + (kTile == 2 ? 1 : second ? kQ2 : kP2) * c;
    const vec4 odd = (kTile == 2 ? 1 : second ? kQ : kP) * b;
    return r % 2 == 1 ? even + odd : even - odd;
}

void apply_gt(COLUMN) {
    if (kTile == 2) {
        const vec4 half_sum = 0.5 * (b + c);
        a += half_sum, b = 0.5 * (b - c), c = half_sum + d;
        return;
    }
    const vec4 sum = kGp * (b + c), sum2 = kGq * (d + e);
    a = kG0 * a + sum + sum2;
    b = (kP * kGp) * (b - c) + (kQ * kGq) * (d - e);
    c = kP2 * sum + kQ2 * sum2 + f;
}

// Row and column r of an array x[kRow * kRow], as arguments.
#define ROW_OF(x, r) x[kRow * (r)], x[kRow * (r) + 1], x[kRow * (r) + 2], x[kRow * (r) + 3], x[kRow * (r) + 4], \
                     x[kRow * (r) + 5]
#define COLUMN_OF(x, r) x[r], x[(r) + kRow], x[(r) + 2 * kRow], x[(r) + 3 * kRow], x[(r) + 4 * kRow], x[(r) + 5 * kRow]

#endif
