// Invocations of a workgroup, for sizes of shared arrays. gl_WorkGroupSize becomes a function constant in Metal's
// language, which refuses it there (SPIRV-Cross of before August 2025).

#ifndef SPLAT_WORKGROUP_GLSL
#define SPLAT_WORKGROUP_GLSL

#include "params/spec_ids.h"

layout(constant_id = kWorkgroupSizeId) const uint kWorkgroupSize = 256;

#endif
