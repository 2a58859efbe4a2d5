#pragma once

#include <map>
#include <string>
#include <vector>

#include "support/npz.h"

namespace splat::test {

/// Arrays of dtype f4, f8, i4 and u1 from numbers, row-major.
NpyArray npy_f32(const std::vector<std::size_t>& shape, const std::vector<double>& values);
NpyArray npy_f64(const std::vector<std::size_t>& shape, const std::vector<double>& values);
NpyArray npy_i32(const std::vector<std::int32_t>& values);
NpyArray npy_text(const std::string& text);

/// A .npz file with stored members, as numpy.savez writes it. Errors: kInvalidArgument if it cannot be
/// written.
Status write_npz(const std::string& path, const std::map<std::string, NpyArray>& arrays);

}  // namespace splat::test
