#include "ops/op_table.h"

#include <string>

#include "core/json_writer.h"

namespace splat::ops {

Status expect_shape(const char* op, const char* tensor, const Shape& got, const Shape& expected) {
    if (got == expected) return {};
    return error(Code::kShape, "%s: tensor '%s' has shape %s, expected %s", op, tensor,
                 got.text().c_str(), expected.text().c_str());
}

Status expect_images(const char* op, const char* tensor, const Shape& got) {
    if (got.rank() == 4) return {};
    return error(Code::kShape, "%s: tensor '%s' has shape %s, expected [N, C, H, W]", op, tensor,
                 got.text().c_str());
}

bool product_backward_reads(std::size_t i, const std::vector<bool>& wanted) {
    return (i == 0 && wanted[1]) || (i == 1 && wanted[0]);
}

bool no_backward_reads(std::size_t, const std::vector<bool>&) {
    return false;
}

bool backward_reads(const OpRow& row, std::size_t i, const std::vector<bool>& wanted) {
    return row.inputs[i].layout == Layout::kRowMajor || row.backward_reads == nullptr ||
           row.backward_reads(i, wanted);
}

void drop_unread(const OpRow& row, const std::vector<bool>& wanted, OpViews& views) {
    for (std::size_t i = 0; i < views.inputs.size(); ++i) {
        if (backward_reads(row, i, wanted)) continue;
        vk::BufferView unread;
        unread.shape = views.inputs[i].shape;
        views.inputs[i] = unread;
    }
}

Result<const OpRow*> find_op(std::string_view name) {
    std::string names;
    for (const OpRow* row : op_table()) {
        if (name == row->name) return row;
        names += (names.empty() ? "" : ", ") + std::string(row->name);
    }
    return invalid("no operator named '%s'; there are: %s", std::string(name).c_str(),
                   names.c_str());
}

namespace {

std::string text_of(const JsonScalar& scalar) {
    if (const auto* flag = std::get_if<bool>(&scalar.value)) return *flag ? "true" : "false";
    if (const auto* number = std::get_if<double>(&scalar.value)) return format("%.9g", *number);
    return std::to_string(std::get<std::int64_t>(scalar.value));
}

}  // namespace

Result<Attributes> complete_attributes(const OpRow& row, std::span<const JsonScalar> given) {
    std::vector<JsonScalar> complete;
    for (const Attribute& attribute : row.attributes) {
        JsonWriter json;
        json.begin_object().key(attribute.name).raw(attribute.fallback).end();
        SPLAT_ASSIGN(std::vector<JsonScalar> fallback,
                     parse_flat_json(json.text(), "attribute default"));
        complete.push_back(std::move(fallback[0]));
    }
    for (const JsonScalar& scalar : given) {
        std::size_t at = 0;
        while (at < complete.size() && complete[at].name != scalar.name) ++at;
        if (at == complete.size()) {
            std::string names;
            for (const Attribute& attribute : row.attributes)
                names += std::string(" ") + attribute.name;
            return invalid("%s: no attribute '%s'; there are:%s", row.name, scalar.name.c_str(),
                           names.empty() ? " none" : names.c_str());
        }
        const std::string_view expected = row.attributes[at].type;
        const bool is_integer = std::holds_alternative<std::int64_t>(scalar.value);
        const bool fits = expected == "integer"   ? is_integer
                          : expected == "boolean" ? std::holds_alternative<bool>(scalar.value)
                                                  : !std::holds_alternative<bool>(scalar.value);
        if (!fits)
            return invalid("%s: attribute '%s' is %s, expected type %s", row.name,
                           scalar.name.c_str(), text_of(scalar).c_str(), row.attributes[at].type);
        complete[at].value = scalar.value;
    }
    return Attributes(std::move(complete));
}

const JsonScalar& Attributes::find(std::string_view name) const {
    std::size_t at = 0;
    while (values_[at].name != name) ++at;  // operators ask for what their row lists
    return values_[at];
}

std::int64_t Attributes::integer(std::string_view name) const {
    return std::get<std::int64_t>(find(name).value);
}

double Attributes::number(std::string_view name) const {
    const auto& value = find(name).value;
    const auto* integer = std::get_if<std::int64_t>(&value);
    return integer != nullptr ? static_cast<double>(*integer) : std::get<double>(value);
}

bool Attributes::boolean(std::string_view name) const {
    return std::get<bool>(find(name).value);
}

}  // namespace splat::ops
