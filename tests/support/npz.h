#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/status.h"

namespace splat::test {

/// One array of a .npz file, row-major.
struct NpyArray {
    std::string dtype;  ///< "f4", "f8", "i4", "i8", "u1", "b1", "U12": little-endian
    std::vector<std::size_t> shape;
    std::vector<std::byte> bytes;

    [[nodiscard]] std::size_t elements() const;

    /// The values as numbers. Errors: kInvalidArgument for a dtype that does not fit (f32() takes
    /// f4 only).
    [[nodiscard]] Result<std::vector<float>> f32() const;
    [[nodiscard]] Result<std::vector<double>> f64() const;
    [[nodiscard]] Result<std::vector<std::int64_t>> ints() const;
    [[nodiscard]] Result<std::vector<std::string>> strings() const;
};

/// A .npz file: a zip of .npy members, stored or deflated, as numpy.savez(_compressed) writes it; read() also takes
/// one that is compressed as a whole, .npz.xz.
class Npz {
  public:
    /// Errors: kInvalidArgument, naming file, member and what is wrong: truncated, bad CRC, unknown
    /// method or dtype, sizes that do not fit. Every offset is checked before it is used.
    static Result<Npz> read(const std::string& path);
    static Result<Npz> parse(std::span<const std::byte> file, const std::string& what);

    [[nodiscard]] bool has(const std::string& name) const { return arrays_.contains(name); }

    /// Errors: kInvalidArgument if there is no such array; the message lists those that exist.
    [[nodiscard]] Result<const NpyArray*> find(const std::string& name) const;
    [[nodiscard]] std::vector<std::string> names() const;

  private:
    std::string what_;
    std::map<std::string, NpyArray> arrays_;
};

/// Errors as Npz::parse.
Result<NpyArray> parse_npy(std::span<const std::byte> bytes, const std::string& what);

}  // namespace splat::test
