#include "fuzz/target.h"
#include "io/maps/netpbm.h"
#include "io/maps/number_image.h"
#include "io/npy.h"

using namespace splat;

namespace {

/// Maps of numbers, also PFM and PGM, by the same bytes.
void check_maps(io::Bytes file) {
    const auto image = io::read_number_image(file);
    const auto size = io::read_number_image(file, io::NumberPart::kSize);
    fuzz::require(image.ok() == size.ok());
    if (fuzz::accepted(image.status()))
        fuzz::require(image.value().values.size() == std::size_t{image.value().width} *
                                                         image.value().height *
                                                         image.value().channels);
    (void)fuzz::accepted(io::read_netpbm(file).status());
}

}  // namespace

SPLAT_FUZZ_TARGET(io::Bytes file) {
    check_maps(file);
    const auto array = io::read_npy(file);
    if (!fuzz::accepted(array.status())) return;
    const auto written = io::write_npy(array.value());
    fuzz::require(written.ok());
    const auto again = io::read_npy(written.value());
    fuzz::require(again.ok() && again.value().shape == array.value().shape);
}
