// The numbers of accessors: their types, where they lie, and the checks that all of them do.

#include <algorithm>

#include "core/shown.h"
#include "io/reader.h"
#include "io/scenes/gltf.h"

namespace splat::io::gltf {
namespace {

/// Elements of numbers T, `stride` bytes apart. `most`: what normalised integers are divided by; 0 for others.
template <class T>
void copy_elements(const std::byte* from, std::uint64_t stride, const Accessor& accessor,
                   std::uint64_t count, double most, float* to, std::size_t step) {
    for (std::uint64_t i = 0; i < count; ++i, from += stride, to += step)
        for (std::size_t k = 0; k < accessor.components; ++k) {
            const T value = number<T>(from + k * sizeof(T));
            to[k] = most == 0
                        ? static_cast<float>(value)
                        : static_cast<float>(std::max(static_cast<double>(value) / most, -1.0));
        }
}

struct ComponentType {
    std::uint32_t code;
    std::size_t bytes;
    const char* name;
    double most;  ///< largest integer; 0: cannot be normalised
    decltype(&copy_elements<float>) copy;
};
constexpr ComponentType kTypes[] = {
    {5120, 1, "byte", 127, copy_elements<std::int8_t>},
    {5121, 1, "unsigned byte", 255, copy_elements<std::uint8_t>},
    {5122, 2, "short", 32767, copy_elements<std::int16_t>},
    {5123, 2, "unsigned short", 65535, copy_elements<std::uint16_t>},
    {5125, 4, "unsigned int", 0, copy_elements<std::uint32_t>},
    {5126, 4, "float", 0, copy_elements<float>}};

const ComponentType* find_type(std::uint64_t code) {
    const auto* const found = std::ranges::find(kTypes, code, &ComponentType::code);
    return found == std::end(kTypes) ? nullptr : found;
}

/// Numbers of an element; 0 for a matrix and for an unknown type.
std::size_t components_of(const JsonTree& type) {
    if (type.text() == nullptr) return 0;
    const std::string& name = *type.text();
    if (name == "SCALAR") return 1;
    return name == "VEC2" ? 2 : name == "VEC3" ? 3 : name == "VEC4" ? 4 : 0;
}

struct Elements {
    Bytes bytes;
    std::uint64_t stride = 0;
};

/// `count` elements of `each` bytes that lie in the buffer view which `json` names. Errors: kFormat.
Result<Elements> elements_of(Document& document, const JsonTree& json, std::uint64_t count,
                             std::size_t each, std::size_t number_bytes, const std::string& where) {
    SPLAT_ASSIGN(const std::uint64_t index, whole_number(json, "bufferView", where));
    SPLAT_ASSIGN(const std::uint64_t offset, whole_number(json, "byteOffset", where, 0));
    SPLAT_ASSIGN(const View view, document.view(index));
    const std::uint64_t stride = view.stride == 0 ? each : view.stride;
    if (stride < each)
        return damaged(
            "gltf: %s: elements of %zu bytes, but bufferViews[%llu] has a byteStride of %llu",
            where.c_str(), each, llu(index), llu(stride));
    const auto before_last = checked_mul(count - 1, stride);
    const auto needed =
        before_last ? checked_add(*before_last, offset + each) : std::optional<std::uint64_t>();
    if (!needed || *needed > view.bytes.size())
        return damaged(
            "gltf: %s: %llu elements, %llu bytes apart from byte %llu on, but bufferViews[%llu] "
            "has %zu bytes",
            where.c_str(), llu(count), llu(stride), llu(offset), llu(index), view.bytes.size());
    SPLAT_ASSIGN(const JsonTree* const view_json, document.element("bufferViews", index));
    SPLAT_ASSIGN(const std::uint64_t view_offset, whole_number(*view_json, "byteOffset", where, 0));
    if ((offset % number_bytes) != 0 || (view_offset + offset) % number_bytes != 0)
        return damaged(
            "gltf: %s: byteOffset %llu in a bufferView from byte %llu on, expected multiples of "
            "%zu",
            where.c_str(), llu(offset), llu(view_offset), number_bytes);
    return Elements{view.bytes.subspan(static_cast<std::size_t>(offset)), stride};
}

Result<Accessor::Sparse> sparse_of(Document& document, const JsonTree& json,
                                   const Accessor& accessor, const ComponentType& type) {
    const std::string where = accessor.where + ".sparse";
    Accessor::Sparse sparse;
    SPLAT_SET(sparse.count, whole_number(json, "count", where));
    if (sparse.count < 1 || sparse.count > accessor.count)
        return damaged("gltf: %s: count %llu, expected 1 to %llu", where.c_str(), llu(sparse.count),
                       llu(accessor.count));
    const JsonTree& indices = json["indices"];
    SPLAT_ASSIGN(const std::uint64_t code, whole_number(indices, "componentType", where));
    const ComponentType* const index_type = find_type(code);
    if (index_type == nullptr || (code != 5121 && code != 5123 && code != 5125))
        return damaged("gltf: %s: indices of componentType %llu, expected 5121, 5123 or 5125",
                       where.c_str(), llu(code));
    sparse.index_type = index_type->code;
    SPLAT_ASSIGN(const Elements places, elements_of(document, indices, sparse.count,
                                                    index_type->bytes, index_type->bytes, where));
    const std::size_t each = accessor.components * type.bytes;
    SPLAT_ASSIGN(const Elements values,
                 elements_of(document, json["values"], sparse.count, each, type.bytes, where));
    if (places.stride != index_type->bytes || values.stride != each)
        return damaged("gltf: %s: a byteStride, expected none", where.c_str());
    sparse.indices = places.bytes;
    sparse.values = values.bytes;
    return sparse;
}

std::uint64_t index_at(const Accessor::Sparse& sparse, std::uint64_t i) {
    const std::size_t bytes = find_type(sparse.index_type)->bytes;
    const std::byte* const at = sparse.indices.data() + i * bytes;
    if (bytes == 1) return number<std::uint8_t>(at);
    return bytes == 2 ? number<std::uint16_t>(at) : number<std::uint32_t>(at);
}

}  // namespace

std::string Accessor::encoding() const {
    return (normalized ? "normalized " : "") + std::string(find_type(type)->name);
}

Result<Accessor> accessor_at(Document& document, std::uint64_t index) {
    SPLAT_ASSIGN(const JsonTree* const json, document.element("accessors", index));
    Accessor accessor;
    accessor.where = format("accessors[%llu]", llu(index));
    const char* const where = accessor.where.c_str();
    SPLAT_SET(accessor.count, whole_number(*json, "count", accessor.where));
    SPLAT_ASSIGN(const std::uint64_t code, whole_number(*json, "componentType", accessor.where));
    const ComponentType* const type = find_type(code);
    if (type == nullptr)
        return damaged("gltf: %s: componentType %llu, expected 5120 to 5126", where, llu(code));
    accessor.type = type->code;
    accessor.components = components_of((*json)["type"]);
    if (accessor.components == 0)
        return damaged("gltf: %s: its type is none of SCALAR, VEC2, VEC3 and VEC4", where);
    if (accessor.count == 0) return damaged("gltf: %s: count 0, expected at least 1", where);
    const JsonTree& normalized = (*json)["normalized"];
    if (const bool* const flag = std::get_if<bool>(&normalized.value))
        accessor.normalized = *flag;
    else if (!normalized.is_null())
        return damaged("gltf: %s: normalized is neither true nor false", where);
    if (accessor.normalized && type->most == 0)
        return damaged("gltf: %s: a normalized %s, expected a byte or a short", where, type->name);
    const std::size_t each = accessor.components * type->bytes;
    if (json->find("bufferView") != nullptr) {
        SPLAT_ASSIGN(const Elements elements, elements_of(document, *json, accessor.count, each,
                                                          type->bytes, accessor.where));
        accessor.bytes = elements.bytes;
        accessor.stride = elements.stride;
        if (accessor.stride % type->bytes != 0)
            return damaged("gltf: %s: byteStride %llu, expected a multiple of %zu", where,
                           llu(accessor.stride), type->bytes);
    }
    if (const JsonTree* const sparse = json->find("sparse"))
        SPLAT_SET(accessor.sparse, sparse_of(document, *sparse, accessor, *type));
    return accessor;
}

Encodings quantized_or(bool quantized, Encodings otherwise) {
    static constexpr std::string_view kQuantized[] = {"float",
                                                      "byte",
                                                      "normalized byte",
                                                      "unsigned byte",
                                                      "normalized unsigned byte",
                                                      "short",
                                                      "normalized short",
                                                      "unsigned short",
                                                      "normalized unsigned short"};
    return quantized ? Encodings(kQuantized) : otherwise;
}

Result<Accessor> attribute_at(Document& document, const JsonTree& attributes,
                              const std::string& name, std::size_t components, Encodings encodings,
                              std::uint64_t count, const std::string& where) {
    const std::string what = where + ": " + name;
    SPLAT_ASSIGN(const std::uint64_t index, whole_number(attributes, name.c_str(), where));
    auto found = accessor_at(document, index);
    if (!found.ok()) return Status(found.status().code(), what + ": " + found.status().message());
    const Accessor& accessor = found.value();
    if (accessor.components != components)
        return damaged("gltf: %s: %zu numbers each, expected %zu", what.c_str(),
                       accessor.components, components);
    if (std::ranges::find(encodings, accessor.encoding()) == encodings.end())
        return damaged("gltf: %s: numbers of type '%s', expected %s", what.c_str(),
                       accessor.encoding().c_str(), joined(encodings).c_str());
    if (count != 0 && accessor.count != count)
        return damaged("gltf: %s: %llu elements, but there are %llu positions", what.c_str(),
                       llu(accessor.count), llu(count));
    return found;
}

Status copy_indices(const Accessor& accessor, std::uint32_t* to) {
    if (accessor.sparse)
        return unsupported("gltf: %s: sparse indices, which are not read; write them as a list",
                           accessor.where.c_str());
    const std::byte* from = accessor.bytes.data();
    const bool is_index = accessor.components == 1 && !accessor.normalized && from != nullptr &&
                          (accessor.type == 5121 || accessor.type == 5123 || accessor.type == 5125);
    if (!is_index)
        return damaged(
            "gltf: %s: indices of %zu numbers of type '%s', expected one unsigned byte, short or "
            "int each, in a bufferView",
            accessor.where.c_str(), accessor.components, accessor.encoding().c_str());
    for (std::uint64_t i = 0; i < accessor.count; ++i, from += accessor.stride) {
        if (accessor.type == 5121) *to++ = number<std::uint8_t>(from);
        if (accessor.type == 5123) *to++ = number<std::uint16_t>(from);
        if (accessor.type == 5125) *to++ = number<std::uint32_t>(from);
    }
    return {};
}

Result<bool> check_extensions(const JsonTree& json, const ExtensionRules& rules,
                              std::set<std::string>& ignored) {
    bool quantized = false;
    for (const char* const list : {"extensionsRequired", "extensionsUsed"})
        for (const JsonTree& item : json[list].items()) {
            if (item.text() == nullptr) return damaged("gltf: %s holds no text", list);
            const std::string& name = *item.text();
            const bool compresses = name.find("compression") != name.npos;
            if (compresses ||
                (list == std::string_view("extensionsRequired") && !rules.may_be_required(name)))
                return unsupported("gltf: the file %s %s, which is not read; write it %s",
                                   compresses ? "is packed by" : "requires",
                                   shown(name, 80).c_str(),
                                   compresses ? "without compression" : "without it");
            quantized = quantized || name == "KHR_mesh_quantization";
            if (!rules.is_read(name)) ignored.insert("extension " + shown(name, 80));
        }
    return quantized;
}

Status copy_numbers(const Accessor& accessor, float* to, std::size_t step) {
    const ComponentType& type = *find_type(accessor.type);
    const double most = accessor.normalized ? type.most : 0;
    if (!accessor.bytes.empty())
        type.copy(accessor.bytes.data(), accessor.stride, accessor, accessor.count, most, to, step);
    else
        for (std::uint64_t i = 0; i < accessor.count; ++i)
            std::fill_n(to + i * step, accessor.components, 0.0F);
    if (!accessor.sparse) return {};
    const std::size_t each = accessor.components * type.bytes;
    for (std::uint64_t i = 0; i < accessor.sparse->count; ++i) {
        const std::uint64_t place = index_at(*accessor.sparse, i);
        if (place >= accessor.count || (i > 0 && place <= index_at(*accessor.sparse, i - 1)))
            return damaged("gltf: %s.sparse: index %llu is %llu, expected growing ones below %llu",
                           accessor.where.c_str(), llu(i), llu(place), llu(accessor.count));
        type.copy(accessor.sparse->values.data() + i * each, each, accessor, 1, most,
                  to + place * step, step);
    }
    return {};
}

}  // namespace splat::io::gltf
