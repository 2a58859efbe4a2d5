// The two resamplings by 2 with F = gain * outer(f, f) / sum(f)^2, p = (taps - 1) / 2:
//   down  y[i][j] = sum_rs F[r][s] x[2i + r - p][2j + s - p]
//   up    y[i][j] = sum_rs F[r][s] x[(i + p - r) / 2][(j + p - s) / 2]   where both divide evenly
// zero outside the image. Each is the adjoint of the other, so forward and backward share them.
// Needs `params` (Resample2dParams), and the buffers x of quads and filter_taps of float. Constants, because lavapipe
// executes branches that are not taken: kBox: the filter is [1,1], kUp: to twice the size, else to half.

#ifndef SPLAT_RESAMPLE2D_GLSL
#define SPLAT_RESAMPLE2D_GLSL

layout(constant_id = kResample2dBoxId) const bool kBox = true;
layout(constant_id = kResample2dUpId) const bool kUp = false;

vec4 resample_box(uint plane, uint row, uint column) {
    if (kUp)
        return 0.25 * params.gain * LD4(x, (plane * params.height + row / 2) * params.width + column / 2);
    const uint at = (plane * params.height + 2 * row) * params.width + 2 * column;
    return 0.25 * params.gain *
           ((LD4(x, at) + LD4(x, at + 1)) + (LD4(x, at + params.width) + LD4(x, at + params.width + 1)));
}

// Position that tap `tap` of output `i` reads along one axis; -1 for none.
int resample_source(uint i, uint tap, uint extent) {
    const int pad = int(params.taps - 1) / 2;
    if (!kUp) {
        const int at = 2 * int(i) + int(tap) - pad;
        return at >= 0 && at < int(extent) ? at : -1;
    }
    const int twice = int(i) + pad - int(tap);
    return twice >= 0 && (twice & 1) == 0 && twice / 2 < int(extent) ? twice / 2 : -1;
}

vec4 resample(uint plane, uint row, uint column) {
    if (kBox) return resample_box(plane, row, column);
    float sum = 0;
    for (uint t = 0; t < params.taps; ++t) sum += filter_taps[t];
    vec4 value = vec4(0);
    for (uint r = 0; r < params.taps; ++r) {
        const int from_row = resample_source(row, r, params.height);
        if (from_row < 0) continue;
        vec4 line = vec4(0);
        for (uint s = 0; s < params.taps; ++s) {
            const int from = resample_source(column, s, params.width);
            if (from >= 0)
                line += filter_taps[s] * LD4(x, (plane * params.height + uint(from_row)) * params.width + uint(from));
        }
        value += filter_taps[r] * line;
    }
    return params.gain / (sum * sum) * value;
}

// The quad of invocation i, for an output of twice or half the size of x.
bool resample_place(uint i, out uint plane, out uint row, out uint column) {
    const uint width = kUp ? 2 * params.width : params.width / 2;
    const uint height = kUp ? 2 * params.height : params.height / 2;
    const uint line = i / width;
    column = i - line * width;
    plane = line / height;
    row = line - plane * height;
    return plane < params.planes;
}

#endif
