#include "core/json_writer.h"

#include <cmath>

namespace splat {

void JsonWriter::separate() {
    if (has_key_) {
        has_key_ = false;
        return;
    }
    if (!first_) text_ += ',';
    if (indent_ >= 0)
        text_.append(1, '\n').append(static_cast<std::size_t>(indent_), ' ');
    else if (!first_ && !compact_)
        text_ += ' ';
    indent_ = -1;
    first_ = false;
}

JsonWriter& JsonWriter::open(char begin, char end) {
    SPLAT_ASSERT(open_.empty() || open_.back() == ']' || has_key_);
    separate();
    text_ += begin;
    open_ += end;
    first_ = true;
    return *this;
}

JsonWriter& JsonWriter::end() {
    SPLAT_ASSERT(!open_.empty() && !has_key_);
    if (indent_ >= 0) text_.append(1, '\n').append(static_cast<std::size_t>(indent_), ' ');
    text_ += open_.back();
    open_.pop_back();
    first_ = false;
    indent_ = -1;
    return *this;
}

JsonWriter& JsonWriter::key(std::string_view name) {
    SPLAT_ASSERT(!open_.empty() && open_.back() == '}' && !has_key_);
    separate();
    text_ += json_quote(name);
    text_ += compact_ ? ":" : ": ";
    has_key_ = true;
    return *this;
}

JsonWriter& JsonWriter::raw(std::string_view json) {
    SPLAT_ASSERT(open_.empty() || open_.back() == ']' || has_key_);
    separate();
    text_ += json;
    return *this;
}

JsonWriter& JsonWriter::number(double value, int digits) {
    return raw(std::isfinite(value) ? format("%.*g", digits, value) : "null");
}

JsonWriter& JsonWriter::newline(int indent) {
    indent_ = indent;
    return *this;
}

std::string JsonWriter::text() {
    SPLAT_ASSERT(open_.empty() && !has_key_);
    return std::move(text_);
}

}  // namespace splat
