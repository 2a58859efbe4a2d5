// Which quads of `count` entries a lane of the radix sort owns: [x, y).

#ifndef SPLAT_LANE_QUADS_GLSL
#define SPLAT_LANE_QUADS_GLSL

uvec2 lane_quads(uint lane, uint count, uint lanes) {
    const uint quads = (count + 3) / 4;
    const uint chunk = (quads + lanes - 1) / lanes;
    const uint begin = min(lane * chunk, quads);
    return uvec2(begin, min(begin + chunk, quads));
}

#endif
