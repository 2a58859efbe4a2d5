// intrinsics.txt and pose/*.txt.

#include <cmath>

#include "fuzz/target.h"
#include "tables/srn_text.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const auto focal = tables::focal_of(io::as_text(file));
    if (fuzz::accepted(focal.status()))
        fuzz::require(std::isfinite(focal.value().x) && std::isfinite(focal.value().y));
    static_cast<void>(fuzz::accepted(tables::pose_of(io::as_text(file)).status()));
}
