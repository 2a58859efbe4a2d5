// Signed integers of 64 bits in two words: devices need not have them.

#ifndef SPLAT_TRIANGLES_WIDE_GLSL
#define SPLAT_TRIANGLES_WIDE_GLSL

struct Wide {
    uint low;
    int high;
};

Wide wide_sum(Wide a, Wide b) {
    uint carry;
    const uint low = uaddCarry(a.low, b.low, carry);
    return Wide(low, a.high + b.high + int(carry));
}

Wide wide_difference(Wide a, Wide b) {
    uint borrow;
    const uint low = usubBorrow(a.low, b.low, borrow);
    return Wide(low, a.high - b.high - int(borrow));
}

Wide wide_product(int a, int b) {
    int high, low;
    imulExtended(a, b, high, low);
    return Wide(uint(low), high);
}

// a b, for products that fit.
Wide wide_times(Wide a, int b) {
    uint high, low;
    umulExtended(a.low, uint(b), high, low);
    return Wide(low, int(high) + a.high * b - (b < 0 ? int(a.low) : 0));
}

// a b - c d
Wide wide_determinant(int a, int b, int c, int d) { return wide_difference(wide_product(a, b), wide_product(c, d)); }

bool wide_is_zero(Wide a) { return a.low == 0 && a.high == 0; }

float wide_magnitude(Wide a) {
    if (a.high < 0) a = wide_difference(Wide(0, 0), a);
    return float(a.high) * 4294967296.0 + float(a.low);
}

#endif
