#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/number_type.h"
#include "io/reader.h"

namespace splat::io {

enum class PlyEncoding : std::uint8_t { kAscii, kLittleEndian, kBigEndian };

struct PlyProperty {
    std::string name;
    NumberType type = NumberType::kF32;
    std::optional<NumberType> list_count;  ///< the type of the count, if the property is a list
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;

    [[nodiscard]] std::optional<std::size_t> find(const std::string& property) const;
};

struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::kAscii;
    std::vector<PlyElement> elements;
    std::vector<std::string> comments;  ///< what follows the word, without blanks around it
    std::size_t bytes = 0;              ///< bytes of the header: the data starts here
    std::size_t lines = 0;              ///< lines of the header

    [[nodiscard]] const PlyElement* find(const std::string& element) const;
};

/// The file starts with the line "ply".
bool is_ply(Bytes file);

/// Lines end in LF or CR LF. Errors: kFormat with the line and what was expected;
/// kUnsupported above 1 MiB of header.
Result<PlyHeader> parse_ply_header(Bytes file);

/// Reads the data of a .ply file, one element after the other in the order of the header.
class PlyRows {
  public:
    /// `discard`: see LoadOptions; rows of binary files without lists are given back.
    PlyRows(const PlyHeader& header, Bytes file, bool discard = false);

    /// Called for each row with its index and one number per property (of a list, its length).
    using Row = std::function<void(std::size_t, const std::vector<double>&)>;

    /// Checks that the rows of an element fit into the bytes left. Call it before allocating memory for
    /// them. Errors: kFormat.
    Status need(const PlyElement& element) const;

    /// Errors: kFormat with element, property and byte or line, if a value is missing or is
    /// not a number.
    Status read(const PlyElement& element, const Row& row);

    /// Skip an element. Errors as read().
    Status skip(const PlyElement& element);

    /// What follows the last element, blanks of ascii excepted; empty if nothing. Errors: kFormat for anything,
    /// unless `lenient`.
    [[nodiscard]] Result<std::string> rest(bool lenient) const;

  private:
    Status read_fixed(const PlyElement& element, const Row& row);
    Status read_binary(const PlyProperty& property, double& value);
    Status read_ascii(const PlyProperty& property, double& value);
    Status read_word(const std::string& name, double& value);
    Status read_number(NumberType type, const std::string& name, double& value);
    std::string_view next_word();

    PlyEncoding encoding_;
    Reader reader_;
    std::string_view text_;  ///< ascii: what is left
    std::size_t line_;       ///< ascii: the line of the last word
    bool discard_;
};

}  // namespace splat::io
