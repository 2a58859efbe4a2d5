// Winograd's minimal filtering F(m x m, 3 x 3), m = kTile in {2, 4}, after Lavin and Gray 2016:
//   y = A^T [ (G w G^T) * (B^T x B) ] A,   x a tile of m + 2 by m + 2 pixels, y its m by m outputs.
// Each function applies one of the matrices to a column in place: B^T takes and gives m + 2 values, A^T
// gives the first m, A (its transpose) takes the first m, G and its transpose 3. Points 0, 1, -1 (and 2,
// -2), infinity. Arrays always have rows of kRow, so that one code serves both tiles.

#ifndef SPLAT_WINOGRAD_GLSL
#define SPLAT_WINOGRAD_GLSL

layout(constant_id = 10) const uint kTile = 4;
const uint kSize = kTile + 2;
const uint kRow = 6;

#define COLUMN inout vec4 a, inout vec4 b, inout vec4 c, inout vec4 d, inout vec4 e, inout vec4 f

void apply_bt(COLUMN) {
    if (kTile == 2) {
        const vec4 first = a - c, second = b + c, third = c - b;
        d = b - d, a = first, b = second, c = third;
        return;
    }
    const vec4 first = 4 * a - 5 * c + e;
    const vec4 even = e - 4 * c, odd = d - 4 * b;
    const vec4 even2 = e - c, odd2 = 2 * (d - b);
    f = 4 * b - 5 * d + f;
    a = first, b = even + odd, c = even - odd, d = even2 + odd2, e = even2 - odd2;
}

void apply_at(COLUMN) {
    const vec4 sum = b + c, difference = b - c;
    if (kTile == 2) {
        a += sum, b = difference - d;
        return;
    }
    const vec4 sum2 = d + e, difference2 = d - e;
    a += sum + sum2, b = difference + 2 * difference2, c = sum + 4 * sum2, d = difference + 8 * difference2 + f;
}

void apply_a(COLUMN) {
    if (kTile == 2) {
        d = -b;
        const vec4 sum = a + b;
        c = a - b, b = sum;
        return;
    }
    const vec4 even = a + c, odd = b + d, even2 = a + 4 * c, odd2 = 2 * b + 8 * d;
    f = d, b = even + odd, c = even - odd, d = even2 + odd2, e = even2 - odd2;
}

void apply_g(COLUMN) {
    const vec4 ends = a + c;
    if (kTile == 2) {
        d = c, c = 0.5 * (ends - b), b = 0.5 * (ends + b);
        return;
    }
    const vec4 wide = a * (1.0 / 24) + c * (1.0 / 6), middle = b * (1.0 / 12);
    f = c, d = wide + middle, e = wide - middle;
    c = (ends - b) * (-1.0 / 6), b = (ends + b) * (-1.0 / 6), a *= 0.25;
}

void apply_gt(COLUMN) {
    if (kTile == 2) {
        const vec4 half_sum = 0.5 * (b + c);
        a += half_sum, b = 0.5 * (b - c), c = half_sum + d;
        return;
    }
    const vec4 sum = b + c, sum2 = d + e;
    a = 0.25 * a - sum * (1.0 / 6) + sum2 * (1.0 / 24);
    b = (c - b) * (1.0 / 6) + (d - e) * (1.0 / 12);
    c = (sum2 - sum) * (1.0 / 6) + f;
}

// Row and column r of an array x[kRow * kRow], as arguments.
#define ROW_OF(x, r) x[kRow * (r)], x[kRow * (r) + 1], x[kRow * (r) + 2], x[kRow * (r) + 3], x[kRow * (r) + 4], \
                     x[kRow * (r) + 5]
#define COLUMN_OF(x, r) x[r], x[(r) + kRow], x[(r) + 2 * kRow], x[(r) + 3 * kRow], x[(r) + 4 * kRow], x[(r) + 5 * kRow]

#endif
