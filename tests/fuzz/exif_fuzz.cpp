// Exif of any bytes: an orientation from 1 to 8 and a finite focal length.

#include <cmath>

#include "fuzz/target.h"
#include "io/photo/photo.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const io::Exif exif = io::exif_of(file, 6000, 4000);
    fuzz::require(exif.orientation >= 1 && exif.orientation <= 8);
    fuzz::require(std::isfinite(exif.focal) && exif.focal >= 0);
}
