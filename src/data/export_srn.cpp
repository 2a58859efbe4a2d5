#include <filesystem>

#include "data/export_rows.h"
#include "data/folder.h"
#include "io/file.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using tables::Table;

Status write_image(ExportRows& rows, std::uint32_t object, std::uint32_t view, Table map,
                   const fs::path& path) {
    SPLAT_ASSIGN(const ImageCache::Pixels pixels, rows.dataset().pixels(object, view, map_of(map)));
    const std::uint32_t side = rows.dataset().resolution();
    const io::Image image{
        side, side, tables::kind_of(map).channels, 8, {pixels->begin(), pixels->end()}};
    SPLAT_ASSIGN(const io::Buffer file, io::write_png(image, io::PngEffort::kFast));
    return io::write_new_file(path.string(), file);
}

/// Write an object to a folder that does not exist.
Status write_files(ExportRows& rows, std::uint32_t object, const fs::path& folder) {
    SPLAT_ASSIGN(const ExportRows::Cameras cameras, rows.cameras(object));
    SPLAT_TRY(make_folders(folder / "pose"));
    for (const Table map : rows.maps()) SPLAT_TRY(make_folders(folder / tables::kind_of(map).map));
    for (std::uint32_t view = 0; view < cameras.frames.size(); ++view) {
        const std::string name = format("%06lld", static_cast<long long>(cameras.frames[view]));
        SPLAT_TRY(io::write_new_file((folder / "pose" / (name + ".txt")).string(),
                                     io::as_bytes(cameras.text.views[view].pose)));
        for (const Table map : rows.maps())
            SPLAT_TRY(write_image(rows, object, view, map,
                                  folder / tables::kind_of(map).map / (name + ".png")));
        SPLAT_TRY(rows.advance(rows.maps().size() + 1));
    }
    return io::write_new_file((folder / "intrinsics.txt").string(),
                              io::as_bytes(cameras.text.intrinsics));
}

/// The folder of an object appears whole or not at all.
Status export_object(ExportRows& rows, std::uint32_t object, const fs::path& folder) {
    const std::string& name = rows.name(object);
    if (name.empty() || name[0] == '.' || name.find('/') != std::string::npos)
        return error(Code::kFormat, "object '%s' cannot be the name of a folder", name.c_str());
    std::error_code failed;
    if (fs::exists(folder / name, failed))
        return rows.advance(rows.dataset().index().views_of[object] * (rows.maps().size() + 1));
    const fs::path temporary = folder / ("." + name + ".tmp");
    fs::remove_all(temporary, failed);
    Status status = write_files(rows, object, temporary);
    if (status.ok()) {
        fs::rename(temporary, folder / name, failed);
        if (failed) status = io::system_error(failed.value(), "create the folder", folder / name);
    }
    if (!status.ok()) fs::remove_all(temporary, failed);
    return status;
}

}  // namespace

Status export_srn(ExportRows& rows, const ExportDesc& desc) {
    const fs::path folder =
        fs::path(desc.path) / ("srn_" + desc.category) / (desc.category + "_" + desc.split);
    SPLAT_ASSIGN(
        const tables::ExportJournal journal,
        tables::ExportJournal::open(desc.path, desc.split, rows.source(), {folder.string()}));
    SPLAT_TRY(make_folders(folder));
    for (const std::uint32_t object : rows.objects())
        SPLAT_TRY(export_object(rows, object, folder));
    return {};
}

}  // namespace splat::data
