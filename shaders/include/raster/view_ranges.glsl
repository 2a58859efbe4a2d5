// Which Gaussians the views of a call see. Items, a Gaussian in a view each, are numbered view by view.
// With kFlagRanges a row of view_ranges per view says it (params/project_params.h), and one row of workgroups runs
// over the views' ranges, each of which begins with a workgroup of its own. Else each view sees all Gaussians.

#ifndef SPLAT_VIEW_RANGES_GLSL
#define SPLAT_VIEW_RANGES_GLSL

#include "params/project_params.h"
#include "table.glsl"

#define RANGE_WORD(view, word) TABLE1(view_ranges, (view) * kRangeWords + (word))

// The view that has number `at`, of an item or a workgroup. `word` says with which one each view begins; those without
// any begin with that of the next.
#define VIEW_AT(at, word, views, view) \
    { \
        uint end = views; \
        view = 0; \
        while (end - view > 1) { \
            const uint middle = (view + end) / 2; \
            const bool before = RANGE_WORD(middle, word) <= at; \
            view = before ? middle : view; \
            end = before ? end : middle; \
        } \
    }

#endif
