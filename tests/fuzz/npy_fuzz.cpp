#include "fuzz/target.h"
#include "io/npy.h"

namespace {

using namespace splat;

void check(io::Bytes file) {
    const auto array = io::read_npy(file);
    if (!fuzz::accepted(array.status())) return;
    const auto written = io::write_npy(array.value());
    fuzz::require(written.ok());
    const auto again = io::read_npy(written.value());
    fuzz::require(again.ok() && again.value().shape == array.value().shape);
}

}  // namespace

SPLAT_FUZZ_TARGET(check)
