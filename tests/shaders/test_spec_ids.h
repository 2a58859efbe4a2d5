// Ids of the specialisation constants of these shaders.

#ifndef SPLAT_TEST_SPEC_IDS_H
#define SPLAT_TEST_SPEC_IDS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
namespace splat::test {
#endif

SPLAT_SPEC_ID kTestOffsetId = 10u;  // test_scale

#ifdef __cplusplus
}
#endif

#endif
