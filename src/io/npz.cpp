#include "io/weights_formats.h"

#include <optional>

#include "io/npy.h"
#include "io/reader.h"
#include "io/zip.h"

namespace splat::io {
namespace {

constexpr std::string_view kExtension = ".npy";

bool is_text(const NpyHeader& header) {
    return header.dtype.starts_with('U') || header.dtype.starts_with('S');
}

Result<NamedTensor> read_member(Bytes file, const NpyHeader& header, const std::string& name,
                                DecodeBudget& budget) {
    NamedTensor tensor;
    tensor.name = name;
    const std::optional<NumberType> type = npy_type(header.dtype);
    if (!type)
        return unsupported("dtype '%s', expected floats, integers or booleans",
                           header.dtype.c_str());
    if (header.column_major)
        return unsupported("a column-major array; save it as numpy.ascontiguousarray gives it");
    tensor.type = *type;
    for (const std::uint64_t dim : header.shape)
        tensor.dims.push_back(dim <= INT64_MAX ? static_cast<std::int64_t>(dim) : -1);
    SPLAT_ASSIGN(const std::uint64_t count, from_file(count_elements(tensor.dims, name)));
    const Bytes data = file.subspan(header.start);
    if (data.size() != count * type_bytes(*type))
        return damaged("%zu bytes of data, its shape %s of %s needs %llu", data.size(),
                       dims_text(tensor.dims).c_str(), type_name(*type),
                       llu(count * type_bytes(*type)));
    SPLAT_TRY(budget.take(count, sizeof(float), name));
    tensor.values.own().resize(count);
    to_floats(*type, data, tensor.values.own().data(), header.order);
    return tensor;
}

Status npz_error(const Status& status, const std::string& name) {
    return {status.code(), "npz: '" + name + "': " + status.message()};
}

}  // namespace

Result<WeightsFile> read_npz(const Source& source, const DecodeLimits& limits) {
    SPLAT_ASSIGN(const Zip zip, Zip::open(source, "npz", limits));
    DecodeBudget budget(source.size(), limits);
    WeightsFile result;
    result.format = WeightsFormat::kNpz;
    Buffer bytes;
    for (const ZipEntry& entry : zip.entries()) {
        if (!entry.name.ends_with(kExtension))
            return unsupported("npz: '%s' is not a .npy array", entry.name.c_str());
        const std::string name = entry.name.substr(0, entry.name.size() - kExtension.size());
        SPLAT_TRY(budget.take(entry.bytes, 1, "npz: " + entry.name));
        SPLAT_TRY(zip.read(entry, bytes));
        const auto header = read_npy_header(bytes);
        if (!header.ok()) return npz_error(header.status(), name);
        if (is_text(header.value())) {
            result.warnings.push_back("'" + name + "' holds text and is ignored");
            continue;
        }
        auto tensor = read_member(bytes, header.value(), name, budget);
        if (!tensor.ok()) return npz_error(tensor.status(), name);
        SPLAT_TRY(from_file(result.tensors.add(std::move(tensor.value()))));
    }
    return result;
}

Result<FilePieces> write_npz(const NamedTensors& tensors, bool half) {
    std::vector<ZipMember> members;
    for (const NamedTensor& tensor : tensors) {
        ZipMember member;
        member.name = tensor.name + std::string(kExtension);
        member.head =
            write_npy_header(half ? "<f2" : "<f4", {tensor.dims.begin(), tensor.dims.end()});
        if (half)
            SPLAT_TRY(put_halves(member.head, tensor));
        else
            member.body = std::as_bytes(std::span(tensor.values));
        members.push_back(std::move(member));
    }
    return write_zip(std::move(members));
}

}  // namespace splat::io
