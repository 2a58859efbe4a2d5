// MTL: numbers of accepted materials are finite and within their ranges.

#include <cmath>

#include "fuzz/target.h"
#include "io/mesh/textures.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    std::set<std::string> ignored;
    const auto read = io::read_mtl(file, ignored);
    if (!fuzz::accepted(read.status())) return;
    for (const io::MtlMaterial& material : read.value()) {
        fuzz::require(!material.name.empty());
        for (const float value : material.material.color) fuzz::require(value >= 0 && value <= 1);
        for (const float value : material.material.at) fuzz::require(std::isfinite(value));
    }
}
