#include "io/weights_file.h"

#include <algorithm>
#include <charconv>
#include <iterator>

#include "io/npz.h"
#include "io/torch/pth.h"
#include "io/torch/pth_archive.h"
#include "io/zip.h"

namespace splat::io {
namespace {

constexpr std::size_t kHeadBytes = 64;

/// The shortest text that parses to the same number.
std::string number_text(double number) {
    char text[32];
    return {text, std::to_chars(std::begin(text), std::end(text), number).ptr};
}

Result<WeightsFile> from_pth(const Source& source, const DecodeLimits& limits) {
    SPLAT_ASSIGN(PthFile pth, read_pth(source, limits));
    WeightsFile file;
    file.format = WeightsFormat::kPth;
    file.tensors = std::move(pth.tensors);
    if (pth.scalars.iteration)
        file.metadata.emplace_back("iteration", std::to_string(*pth.scalars.iteration));
    if (pth.scalars.loss) file.metadata.emplace_back("loss", number_text(*pth.scalars.loss));
    if (pth.scalars.best_psnr)
        file.metadata.emplace_back("best_PSNR", number_text(*pth.scalars.best_psnr));
    return file;
}

/// A number of the metadata; none where it is not given.
template <class T>
Status read_scalar(const Metadata& metadata, const char* name, std::optional<T>& to) {
    for (const auto& [key, text] : metadata) {
        if (key != name) continue;
        T value{};
        const char* const end = text.data() + text.size();
        const auto [stopped, code] = std::from_chars(text.data(), end, value);
        if (code != std::errc() || stopped != end)
            return error(Code::kInvalidArgument, "metadata '%s' is '%s', expected a number", name,
                         text.c_str());
        to = value;
    }
    return {};
}

Result<PthScalars> scalars_of(const Metadata& metadata) {
    PthScalars scalars;
    SPLAT_TRY(read_scalar(metadata, "iteration", scalars.iteration));
    SPLAT_TRY(read_scalar(metadata, "loss", scalars.loss));
    SPLAT_TRY(read_scalar(metadata, "best_PSNR", scalars.best_psnr));
    return scalars;
}

Result<WeightsFile> from_npz(const Source& source, const DecodeLimits& limits) {
    SPLAT_ASSIGN(NpzFile npz, read_npz(source, limits));
    WeightsFile file;
    file.format = WeightsFormat::kNpz;
    file.tensors = std::move(npz.tensors);
    for (const std::string& name : npz.ignored)
        file.warnings.push_back("'" + name + "' holds text and is ignored");
    return file;
}

Result<WeightsFile> from_safetensors(const Source& source, const DecodeLimits& limits) {
    SPLAT_ASSIGN(SafetensorsFile read, read_safetensors(source, limits));
    WeightsFile file;
    file.tensors = std::move(read.tensors);
    file.metadata = std::move(read.metadata);
    return file;
}

Result<WeightsFile> from_any(const Source& source, const DecodeLimits& limits) {
    Buffer head(std::min<std::uint64_t>(source.size(), kHeadBytes));
    SPLAT_TRY(source.read(0, head));
    const std::string_view text = as_text(head);
    if (text.starts_with("PK\x05\x06")) return from_npz(source, limits);  // no entries
    if (text.starts_with("PK\x03\x04")) {
        SPLAT_ASSIGN(const Zip zip, Zip::open(source, "zip", limits));
        const bool pth = std::any_of(zip.entries().begin(), zip.entries().end(),
                                     [](const ZipEntry& e) { return is_pth_entry(e.name); });
        return pth ? from_pth(source, limits) : from_npz(source, limits);
    }
    if (is_safetensors(head)) return from_safetensors(source, limits);
    if (is_legacy_pth(head)) return from_pth(source, limits);
    return error(
        Code::kFormat,
        "not weights of a known format; expected .safetensors, .pth of torch.save(), .npz");
}

}  // namespace

const char* weights_format_name(WeightsFormat format) {
    switch (format) {
        case WeightsFormat::kSafetensors:
            return "safetensors";
        case WeightsFormat::kPth:
            return "pth";
        case WeightsFormat::kNpz:
            return "npz";
    }
    return "";
}

Result<WeightsFile> read_weights(const Source& source, const std::string& name,
                                 const DecodeLimits& limits) {
    auto file = from_any(source, limits);
    if (!file.ok())
        return Status(file.status().code(), "'" + name + "': " + file.status().message());
    return file;
}

Result<WeightsFile> load_weights(const std::string& path, const DecodeLimits& limits,
                                 bool in_place) {
    SPLAT_ASSIGN(const std::unique_ptr<Source> source, open_source(path, kMaxFileBytes, in_place));
    return read_weights(*source, path, limits);
}

Result<FilePieces> write_weights(const WeightsFile& weights, WeightsFormat format, bool half) {
    switch (format) {
        case WeightsFormat::kSafetensors:
            return write_safetensors(weights.tensors, weights.metadata, half);
        case WeightsFormat::kNpz:
            return write_npz(weights.tensors, half);
        case WeightsFormat::kPth: {
            SPLAT_ASSIGN(const PthScalars scalars, scalars_of(weights.metadata));
            return write_pth(weights.tensors, scalars, half);
        }
    }
    return FilePieces();
}

Status save_weights(const WeightsFile& weights, const std::string& path, bool half) {
    for (const WeightsFormat format :
         {WeightsFormat::kSafetensors, WeightsFormat::kPth, WeightsFormat::kNpz}) {
        if (!path.ends_with(std::string(".") + weights_format_name(format))) continue;
        SPLAT_ASSIGN(const FilePieces file, write_weights(weights, format, half));
        return write_file(path, file.pieces());
    }
    return error(Code::kUnsupported, "'%s': weights are written as .safetensors, .pth or .npz",
                 path.c_str());
}

}  // namespace splat::io
