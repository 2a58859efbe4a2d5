#pragma once

#include <string>
#include <utility>

#include "core/checked_math.h"
#include "core/number_in.h"
#include "core/shown.h"
#include "core/status.h"
#include "io/bytes.h"

namespace splat::io {

/// A check of values that came from a file, with the error kFormat instead of kInvalidArgument.
inline Status from_file(const Status& checked) {
    return checked.code() == Code::kInvalidArgument ? Status(Code::kFormat, checked.message())
                                                    : checked;
}

/// The same of a value and its check.
template <class T>
Result<T> from_file(Result<T> checked) {
    if (checked.ok()) return checked;
    return from_file(checked.status());
}

/// An error with the name of what it is about before its sentence: "'NAME': ...".
inline Status in_file(const Status& status, const std::string& name) {
    return status.ok() ? status : Status(status.code(), "'" + name + "': " + status.message());
}

template <class T>
Result<T> in_file(Result<T> read, const std::string& name) {
    if (read.ok()) return read;
    return in_file(read.status(), name);
}

/// A cursor over untrusted bytes. All parsers read through it, so that every offset and count of a file
/// is compared with the available bytes before use.
class Reader {
  public:
    /// `what` names the bytes in messages, e.g. "spz".
    Reader(Bytes bytes, std::string what, std::endian order = std::endian::little)
        : bytes_(bytes), what_(std::move(what)), order_(order) {}

    [[nodiscard]] std::size_t position() const { return position_; }
    [[nodiscard]] std::size_t left() const { return bytes_.size() - position_; }
    [[nodiscard]] const std::string& what() const { return what_; }

    /// Advances over the next `count` bytes and returns them. Errors: kFormat with the field, the
    /// position, what it needs and what is left.
    Result<Bytes> take(std::uint64_t count, const char* field) {
        SPLAT_TRY(need(count, 1, field));
        const Bytes taken = bytes_.subspan(position_, static_cast<std::size_t>(count));
        position_ += taken.size();
        return taken;
    }

    /// Errors as take().
    template <class T>
    Status read(T& value, const char* field) {
        SPLAT_ASSIGN(const Bytes at, take(sizeof(T), field));
        value = number<T>(at.data(), order_);
        return {};
    }

    /// Checks that `count` items of `each` bytes are left. Call it before allocating memory for them.
    /// Errors as take().
    Status need(std::uint64_t count, std::uint64_t each, const char* field) const {
        const auto bytes = checked_mul(count, each);
        if (bytes && *bytes <= left()) return {};
        return damaged(
            "%s: '%s' at byte %zu needs %llu x %llu bytes, but %zu are left; the file is "
            "truncated or its header is damaged",
            what_.c_str(), field, position_, llu(count), llu(each), left());
    }

    /// Bytes up to a NUL; also advances over the NUL. Errors as take().
    Result<std::string_view> take_string(const char* field) {
        const std::string_view rest = as_text(bytes_.subspan(position_));
        const std::size_t end = rest.find('\0');
        if (end == std::string_view::npos) return need(left() + 1, 1, field);
        position_ += end + 1;
        return rest.substr(0, end);
    }

  private:
    Bytes bytes_;
    std::size_t position_ = 0;
    std::string what_;
    std::endian order_;
};

/// Lines of text, with numbers for messages.
class Lines {
  public:
    /// `what` names the text in messages, e.g. "OBJ".
    Lines(Bytes file, const char* what) : text_(as_text(file)), bytes_(file.size()), what_(what) {}

    /// The next line, or false at the end.
    bool next(std::string_view& line) {
        if (text_.empty()) return false;
        const std::size_t end = std::min(text_.find('\n'), text_.size());
        line = text_.substr(0, end);
        text_.remove_prefix(std::min(end + 1, text_.size()));
        ++number_;
        return true;
    }

    /// The next line that is neither empty nor a comment.
    bool next_record(std::string_view& line) {
        while (next(line)) {
            const std::size_t start = line.find_first_not_of(" \t\r");
            if (start != std::string_view::npos && line[start] != '#') return true;
        }
        return false;
    }

    [[nodiscard]] std::size_t number() const { return number_; }
    /// Bytes of the lines so far.
    [[nodiscard]] std::size_t position() const { return bytes_ - text_.size(); }

    /// kFormat, naming this line.
    [[nodiscard]] Status bad(const std::string& problem) const {
        return damaged("%s line %zu: %s", what_, number_, problem.c_str());
    }

  private:
    std::string_view text_;
    std::size_t bytes_;
    const char* what_;
    std::size_t number_ = 0;
};

/// Takes words and numbers from the front of a line.
class Words {
  public:
    Words(std::string_view line, const Lines& lines) : line_(line), lines_(lines) {}

    [[nodiscard]] bool done() const {
        return line_.find_first_not_of(" \t\r") == std::string_view::npos;
    }

    Result<std::string_view> word(const char* field) {
        const std::size_t start = line_.find_first_not_of(" \t\r");
        if (start == std::string_view::npos) return lines_.bad(std::string("there is no ") + field);
        line_.remove_prefix(start);
        const std::size_t end = std::min(line_.find_first_of(" \t\r"), line_.size());
        const std::string_view found = line_.substr(0, end);
        line_.remove_prefix(end);
        return found;
    }

    template <class T>
    Status read(T& value, const char* field) {
        SPLAT_ASSIGN(const std::string_view text, word(field));
        const std::optional<T> found = number_in<T>(text);
        if (!found)
            return lines_.bad(std::string(field) + " is '" + shown(text, 40) +
                              "', expected a number");
        value = *found;
        return {};
    }

    /// The rest of the line: names of images may hold blanks.
    [[nodiscard]] std::string rest() const {
        const std::size_t start = line_.find_first_not_of(" \t\r");
        if (start == std::string_view::npos) return "";
        return std::string(line_.substr(start, line_.find_last_not_of(" \t\r") - start + 1));
    }

  private:
    std::string_view line_;
    const Lines& lines_;
};

}  // namespace splat::io
