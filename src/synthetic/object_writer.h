#pragma once

#include <cstdint>
#include <string>

#include "core/status.h"
#include "scene/camera.h"

namespace splat::synthetic {

enum class Split { kTrain, kVal, kTest };
const char* split_name(Split split);

/// A data set of procedural objects, seen by cameras at distance 1.3 that look at the origin; the
/// objects lie in the ball of radius 0.5 around it, z up. Focal length 131.25 pixels at 128.
struct WriterDesc {
    std::string path;
    std::string category = "cars";  ///< "cars", "chairs", or "mixed": either at random
    std::uint64_t seed = 0;
    std::uint32_t resolution = 128;
    std::uint32_t train_views = 50;  ///< from random points on the sphere
    std::uint32_t test_views = 251;  ///< val and test: on a spiral on the upper half
    std::uint32_t train_objects = 0, val_objects = 0, test_objects = 0;
};

/// Errors: kInvalidArgument, naming the field; kUnsupported for a resolution above 2048.
Status check_desc(const WriterDesc& desc);

/// The camera of one view of an object; view counts from 0.
scene::Camera view_camera(const WriterDesc& desc, Split split, std::uint32_t object,
                          std::uint32_t view);

/// Write one object, counted over all splits (train, then val, then test), in the layout of SRN with
/// depth, normal and mask beside rgb. Its folder appears whole or not at all; an existing one is kept.
/// An object depends only on the seed, its split and its number in the split.
///
/// Errors        kInvalidArgument for an index beyond the objects, and a path that holds data made with
///               other values (numbers of objects may differ); as io::write_file()
/// Determinism   the same bytes for the same fields, from any number of threads, for the same zlib
/// Thread-safe   also for the same object at the same time
Status write_object(const WriterDesc& desc, std::uint32_t index);

}  // namespace splat::synthetic
