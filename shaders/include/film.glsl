// Shared by the kernels of film: the quad of an invocation, and its scale and shift.
// Needs `params` (FilmParams) and the buffer modulation of quads.

#ifndef SPLAT_FILM_GLSL
#define SPLAT_FILM_GLSL

#include "channels.glsl"

// Channels first, ..., first + 3 of image n, first being any number.
vec4 modulation_quad(uint first, uint n) {
    const uint quad = first / 4;
    const uint last = ((params.shift != 0 ? params.c : 2 * params.c) - 1) / 4;
    return shifted(LD4(modulation, min(quad, last) * params.n + n),
                   LD4(modulation, min(quad + 1, last) * params.n + n), first % 4);
}

#endif
