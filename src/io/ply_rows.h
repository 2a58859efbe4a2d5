#pragma once

#include <functional>

#include "io/ply_header.h"
#include "io/reader.h"

namespace splat::io {

/// Reads the data of a .ply file, one element after the other in the order of the header.
class PlyRows {
  public:
    PlyRows(const PlyHeader& header, Bytes file);

    /// What to do with a row: its index and one number per property (a list: its length).
    using Row = std::function<void(std::size_t, const std::vector<double>&)>;

    /// Whether the rows of an element can be in the bytes that are left; to be asked before memory
    /// is allocated for them. Errors: kInvalidArgument.
    Status need(const PlyElement& element) const;

    /// Errors: kInvalidArgument with element, property and byte or line, if a value is missing or is
    /// no number.
    Status read(const PlyElement& element, const Row& row);

    /// Pass over an element. Errors as read().
    Status skip(const PlyElement& element);

    [[nodiscard]] std::size_t left() const { return reader_.left(); }

  private:
    Status read_binary(const PlyProperty& property, double& value);
    Status read_ascii(const PlyProperty& property, double& value);
    Status read_word(const std::string& name, double& value);
    Status read_number(PlyType type, const std::string& name, double& value);
    std::string_view next_word();

    PlyEncoding encoding_;
    Reader reader_;
    std::string_view text_;  ///< ascii: what is left
    std::size_t line_;       ///< ascii: the line of the last word
};

}  // namespace splat::io
