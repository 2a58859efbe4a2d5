// What both passes of resize2d need along one axis. The middle of pixel i of y lies at step * (2i + 1) pixels of x, by
// 64 bits of fraction: a float would lose those that the weights need. Weights are the filter at the distance from the
// middle of a pixel of x, in units of `stretch`; with kAntialias divided by their sum.
// Needs `params` (Resize2dParams). Constants: kCubic: two pixels to each side, else one; kAntialias.

#ifndef SPLAT_RESIZE2D_GLSL
#define SPLAT_RESIZE2D_GLSL

layout(constant_id = kResize2dCubicId) const bool kCubic = false;
layout(constant_id = kResize2dAntialiasId) const bool kAntialias = false;

const int kReach = kCubic ? 2 : 1;
const uint kFixedTaps = kCubic ? 4 : 2;  // without antialias

struct Taps {
    int first, last;  // pixels of x; without antialias they may lie outside
    int whole;        // the middle is whole + part
    float part;
};

Taps taps_of(uint i) {
    uint carried, rest, high, low, carry;
    umulExtended(params.step_low, 2 * i + 1, carried, rest);
    umulExtended(params.step_high, 2 * i + 1, high, low);
    const float part = float(uaddCarry(low, carried, carry)) * 2.3283064365386963e-10;  // 2^-32
    Taps taps;
    taps.whole = int(params.step_whole * (2 * i + 1) + high + carry);
    taps.part = part;
    if (kAntialias) {
        const float reach = float(kReach) * params.stretch;
        taps.first = max(taps.whole + int(floor(part - reach - 0.5)), 0);
        taps.last = min(taps.whole + int(ceil(part + reach - 0.5)), int(params.from) - 1);
    } else {
        taps.first = taps.whole + (part < 0.5 ? -kReach : 1 - kReach);
        taps.last = taps.first + 2 * kReach - 1;
    }
    return taps;
}

// Filter of Keys 1981, with a = -1/2 as PIL has it, and -3/4 without antialias, in the form of its roots.
float weight_at(Taps taps, int pixel) {
    const float d = abs(float(pixel - taps.whole) + (0.5 - taps.part));
    const float x = kAntialias ? d / params.stretch : d;
    if (!kCubic) return max(1.0 - x, 0.0);
    const float a = kAntialias ? -0.5 : -0.75;
    const float inner = (x - 1.0) * (((a + 2.0) * x - 1.0) * x - 1.0);
    return x < 1.0 ? inner : x < 2.0 ? a * (x - 1.0) * ((x - 2.0) * (x - 2.0)) : 0.0;
}

int inside(int pixel) { return clamp(pixel, 0, int(params.from) - 1); }

// Weight of a pixel of x in a pixel of y; pixels outside of x are the nearest one.
float weight_of(uint i, int pixel) {
    const Taps taps = taps_of(i);
    if (kAntialias) {
        float total = 0;
        for (int at = taps.first; at <= taps.last; ++at) total += weight_at(taps, at);
        return weight_at(taps, pixel) / total;
    }
    float weight = 0;
    for (uint k = 0; k < kFixedTaps; ++k) {
        const int at = taps.first + int(k);
        weight += inside(at) == pixel ? weight_at(taps, at) : 0.0;
    }
    return weight;
}

#endif
