#include "io/photo/image_file.h"

#include <algorithm>

#include "io/file.h"
#include "io/maps/netpbm.h"
#include "io/photo/photo.h"
#include "io/reader.h"

namespace splat::io {
namespace {

constexpr std::uint64_t kMaxImageBytes = std::uint64_t{1} << 30;

struct Format {
    std::size_t offset;
    std::string_view signature;
    Result<Image> (*read)(Bytes file, const ImageOptions& options);
};

constexpr Format kFormats[] = {{0, "\x89PNG", read_png},
                               {0, "\xFF\xD8\xFF", read_jpeg},
                               {8, "WEBP", read_webp},
                               {0, "P5", read_netpbm},
                               {0, "P6", read_netpbm}};

/// Formats that are not read, by a signature at a place of the file.
struct UnreadImage {
    std::size_t offset;
    std::string_view signature;
    const char* name;
    const char* remedy;
};

constexpr const char* kOfHeic = "convert it: 'heif-convert IN.heic OUT.jpg'";
constexpr const char* kOfAvif = "convert it: 'avifdec IN.avif OUT.png'";
constexpr const char* kOfTiff =
    "convert it: 'magick IN.tif OUT.png' keeps whole numbers of 8 or 16 bits; for others, "
    "python3 -c \"import numpy, tifffile; numpy.save('OUT.npy', tifffile.imread('IN.tif'))\"";
constexpr const char* kOfExr =
    "convert it: python3 -c \"import numpy, OpenEXR; numpy.save('OUT.npy', "
    "OpenEXR.File('IN.exr').channels()['Z'].pixels)\", where the channels are Z or RGB";
constexpr const char* kOfNpz =
    "save its array itself: python3 -c \"import numpy; numpy.save('OUT.npy', "
    "list(numpy.load('IN.npz').values())[0])\"";
constexpr const char* kByMagick = "convert it: 'magick IN OUT.png'";
constexpr std::size_t kBrandAt = 8;  ///< behind "ftyp"

constexpr UnreadImage kUnreadFormats[] = {
    {kBrandAt, "heic", "a HEIC file", kOfHeic},
    {kBrandAt, "heix", "a HEIC file", kOfHeic},
    {kBrandAt, "hevc", "a HEIC file", kOfHeic},
    {kBrandAt, "mif1", "a HEIC file", kOfHeic},
    {kBrandAt, "msf1", "a HEIC file", kOfHeic},
    {kBrandAt, "avif", "an AVIF file", kOfAvif},
    {kBrandAt, "avis", "an AVIF file", kOfAvif},
    {0, std::string_view("II*\0", 4), "a TIFF file", kOfTiff},
    {0, std::string_view("MM\0*", 4), "a TIFF file", kOfTiff},
    {0, "\x76\x2F\x31\x01", "an OpenEXR file", kOfExr},
    {0, "PK\x03\x04", "an archive, such as .npz", kOfNpz},
    {0, "\xFF\x0A", "a JPEG XL file", "convert it: 'djxl IN.jxl OUT.png'"},
    {4, "JXL ", "a JPEG XL file", "convert it: 'djxl IN.jxl OUT.png'"},
    {0, "P2", "a PGM file of text", kByMagick},
    {0, "P3", "a PPM file of text", kByMagick},
    {0, "GIF8", "a GIF file", kByMagick},
    {0, "BM", "a BMP file", kByMagick}};

bool has_signature(Bytes file, std::size_t offset, std::string_view signature) {
    return as_text(file).substr(std::min(offset, file.size()), signature.size()) == signature;
}

}  // namespace

bool has_extension(const std::string& path, std::initializer_list<std::string_view> extensions) {
    return std::ranges::find(extensions, extension_of(path)) != extensions.end();
}

bool is_image_name(const std::string& path) {
    return has_extension(path, {".png", ".jpg", ".jpeg", ".webp", ".pgm", ".ppm"});
}

std::string unread_image(Bytes head) {
    for (const UnreadImage& format : kUnreadFormats)
        if (has_signature(head, format.offset, format.signature) &&
            (format.offset != kBrandAt || has_signature(head, 4, "ftyp")))
            return std::string(format.name) + "; " + format.remedy;
    return "";
}

std::string unread_image_file(const std::string& path) {
    constexpr std::uint64_t kHeadBytes = 16;
    const auto source = open_source(path);
    if (!source.ok()) return "";
    Buffer head(std::min(kHeadBytes, source.value()->size()));
    return source.value()->read(0, head).ok() ? unread_image(head) : "";
}

Result<Image> load_image(const std::string& path, const ImageOptions& options) {
    SPLAT_ASSIGN(const Buffer file, read_file(path, kMaxImageBytes));
    return in_file(read_image(file, options), path);
}

Result<Image> read_image(Bytes file, const ImageOptions& options) {
    for (const Format& format : kFormats)
        if (has_signature(file, format.offset, format.signature)) return format.read(file, options);
    const std::string other = unread_image(file);
    return damaged("%s", other.empty() ? "not a PNG, JPEG, WebP, PGM or PPM file" : other.c_str());
}

}  // namespace splat::io
