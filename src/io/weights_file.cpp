#include "io/weights_file.h"

#include <algorithm>

#include "io/reader.h"
#include "io/torch/pth_archive.h"
#include "io/weights_formats.h"
#include "io/zip.h"

namespace splat::io {
namespace {

constexpr std::size_t kHeadBytes = 64;

/// What programs put before the names of a network's tensors: PyTorch's DataParallel, and F3D-Gaus.
constexpr const char* kWrappers[] = {"module.", "gaussian_predictor."};

struct FormatOfWeights {
    const char* name;
    Result<WeightsFile> (*read)(const Source& source, const DecodeLimits& limits);
    Result<FilePieces> (*write)(const WeightsFile& weights, bool half);
};

/// In the order of WeightsFormat.
constexpr FormatOfWeights kWeightsFormats[] = {
    {"safetensors", read_safetensors,
     [](const WeightsFile& weights, bool half) {
         return write_safetensors(weights.tensors, weights.metadata, half);
     }},
    {"pth", read_pth,
     [](const WeightsFile& weights, bool half) {
         return write_pth(weights.tensors, weights.metadata, half);
     }},
    {"npz", read_npz,
     [](const WeightsFile& weights, bool half) { return write_npz(weights.tensors, half); }}};

const FormatOfWeights& row_of(WeightsFormat format) {
    return kWeightsFormats[static_cast<std::size_t>(format)];
}

Result<WeightsFormat> format_of(const Source& source, const DecodeLimits& limits) {
    Buffer head(std::min<std::uint64_t>(source.size(), kHeadBytes));
    SPLAT_TRY(source.read(0, head));
    const std::string_view text = as_text(head);
    if (text.starts_with("PK\x05\x06")) return WeightsFormat::kNpz;  // no entries
    if (text.starts_with("PK\x03\x04")) {
        SPLAT_ASSIGN(const Zip zip, Zip::open(source, "zip", limits));
        const bool pth = std::ranges::any_of(
            zip.entries(), [](const ZipEntry& e) { return is_pth_entry(e.name); });
        return pth ? WeightsFormat::kPth : WeightsFormat::kNpz;
    }
    if (is_safetensors(head)) return WeightsFormat::kSafetensors;
    if (is_legacy_pth(head)) return WeightsFormat::kPth;
    return damaged(
        "not weights of a known format; expected .safetensors, .pth of torch.save(), .npz");
}

}  // namespace

const char* weights_format_name(WeightsFormat format) {
    return row_of(format).name;
}

bool is_weights_file(const std::string& path) {
    const auto source = open_source(path, kMaxFileBytes, false);
    if (!source.ok()) return false;
    for (const char* extension : {".safetensors", ".pt", ".pth"})
        if (path.ends_with(extension)) return true;
    return format_of(*source.value(), decode_limits()).ok();
}

Result<WeightsFile> read_weights(const Source& source, const std::string& name,
                                 const DecodeLimits& limits) {
    const auto format = format_of(source, limits);
    if (!format.ok()) return in_file(format.status(), name);
    Result<WeightsFile> file = in_file(row_of(format.value()).read(source, limits), name);
    for (const char* start : kWrappers)
        if (file.ok() && file.value().tensors.drop_start(start))
            file.value().warnings.push_back(splat::format(
                "'%s', with which the names of all its tensors begin, is left out", start));
    return file;
}

Result<WeightsFile> load_weights(const std::string& path, const DecodeLimits& limits,
                                 bool in_place) {
    SPLAT_ASSIGN(const auto source, open_source(path, kMaxFileBytes, in_place));
    return read_weights(*source, path, limits);
}

Result<FilePieces> write_weights(const WeightsFile& weights, WeightsFormat format, bool half) {
    return row_of(format).write(weights, half);
}

Status save_weights(const WeightsFile& weights, const std::string& path, bool half) {
    for (const FormatOfWeights& format : kWeightsFormats) {
        if (!path.ends_with(std::string(".") + format.name)) continue;
        SPLAT_ASSIGN(const FilePieces file, format.write(weights, half));
        return write_file(path, file.pieces());
    }
    return unsupported("'%s': weights are written as .safetensors, .pth or .npz", path.c_str());
}

}  // namespace splat::io
