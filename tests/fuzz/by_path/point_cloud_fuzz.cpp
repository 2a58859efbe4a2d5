// Point clouds of CO3D: the vertices of any .ply file.

#include "data/co3d_cameras.h"
#include "fuzz/by_path/folder.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    static const fuzz::Folder folder({"points.ply"});
    folder.write(0, file);
    const auto points = data::read_points(folder.path("points.ply"));
    if (fuzz::accepted(points.status())) fuzz::require(!points.value().empty());
}
