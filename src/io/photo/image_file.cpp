#include "io/photo/image_file.h"

#include <algorithm>
#include <cctype>

#include "io/file.h"
#include "io/photo/jpeg.h"
#include "io/photo/webp.h"

namespace splat::io {
namespace {

constexpr std::uint64_t kMaxImageBytes = std::uint64_t{1} << 30;

struct Format {
    std::size_t offset;
    std::string_view signature;
    Result<Image> (*read)(Bytes file, const ImageOptions& options);
};

constexpr Format kFormats[] = {
    {0, "\x89PNG", read_png}, {0, "\xFF\xD8\xFF", read_jpeg}, {8, "WEBP", read_webp}};

}  // namespace

bool is_image_name(const std::string& path) {
    const std::size_t dot = path.rfind('.');
    if (dot == std::string::npos) return false;
    std::string extension = path.substr(dot);
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension == ".png" || extension == ".jpg" || extension == ".jpeg" ||
           extension == ".webp";
}

Result<Image> load_image(const std::string& path, const ImageOptions& options) {
    SPLAT_ASSIGN(const Buffer file, read_file(path, kMaxImageBytes));
    auto image = read_image(file, options);
    if (image.ok()) return image;
    return Status(image.status().code(), "'" + path + "': " + image.status().message());
}

Result<Image> read_image(Bytes file, const ImageOptions& options) {
    for (const Format& format : kFormats)
        if (as_text(file).substr(std::min(format.offset, file.size()), format.signature.size()) ==
            format.signature)
            return format.read(file, options);
    return error(Code::kFormat, "not a PNG, JPEG or WebP file");
}

}  // namespace splat::io
