#include <filesystem>
#include <map>
#include <numeric>

#include "core/log.h"
#include "core/os/path.h"
#include "core/path_name.h"
#include "core/shown.h"
#include "data/export_rows.h"
#include "data/folder.h"
#include "data/formats.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/transforms_json.h"

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
    return io::write_new_file(os::text_of(path), file);
}

std::string view_name(std::int64_t frame) {
    return format("%06lld", lld(frame));
}

/// Write images and maps of an object's views.
Status write_images(ExportRows& rows, std::uint32_t object, const std::vector<std::int64_t>& frames,
                    const fs::path& folder) {
    for (const Table map : rows.maps())
        SPLAT_TRY(io::make_folders(folder / tables::kind_of(map).map));
    for (std::uint32_t view = 0; view < frames.size(); ++view) {
        for (const Table map : rows.maps())
            SPLAT_TRY(write_image(
                rows, object, view, map,
                folder / tables::kind_of(map).map / (view_name(frames[view]) + ".png")));
        SPLAT_TRY(rows.advance(rows.maps().size() + 1));
    }
    return {};
}

/// Write an object in SRN's layout to a folder that does not exist.
Status write_srn_files(ExportRows& rows, std::uint32_t object, const fs::path& folder) {
    SPLAT_ASSIGN(const ExportRows::Cameras cameras, rows.cameras(object));
    SPLAT_TRY(write_images(rows, object, cameras.frames, folder));
    SPLAT_TRY(io::make_folders(folder / "pose"));
    for (std::size_t view = 0; view < cameras.frames.size(); ++view)
        SPLAT_TRY(io::write_new_file(
            os::text_of(folder / "pose" / (view_name(cameras.frames[view]) + ".txt")),
            io::as_bytes(cameras.text.views[view].pose)));
    return io::write_new_file(os::text_of(folder / "intrinsics.txt"),
                              io::as_bytes(cameras.text.intrinsics));
}

/// Write an object with transforms.json.
Status write_image_files(ExportRows& rows, std::uint32_t object, const fs::path& folder) {
    SPLAT_ASSIGN(const std::vector<StoredView> views, rows.dataset().reader().cameras(object));
    const auto numbered =
        rows.cameras(object);  // an error: several focal lengths, which do no harm here
    std::vector<std::int64_t> frames(views.size());
    std::iota(frames.begin(), frames.end(), 0);
    if (numbered.ok()) frames = numbered.value().frames;
    SPLAT_TRY(write_images(rows, object, frames, folder));
    const std::uint32_t side = rows.dataset().resolution();
    std::vector<scene::Camera> cameras;
    for (std::size_t view = 0; view < views.size(); ++view) {
        SPLAT_ASSIGN(const scene::Mat4 pose, inverse_pose(views[view].camera_to_world));
        cameras.push_back({"rgb/" + view_name(frames[view]) + ".png", side, side,
                           views[view].focal_x * side, views[view].focal_y * side, side / 2.0,
                           side / 2.0, pose});
    }
    SPLAT_ASSIGN(const io::Buffer file, io::write_transforms_json(cameras));
    return io::write_new_file(os::text_of(folder / "transforms.json"), file);
}

using WriteFiles = Status (*)(ExportRows& rows, std::uint32_t object, const fs::path& folder);

/// The folder of an object appears whole or not at all.
Status export_object(ExportRows& rows, std::uint32_t object, const fs::path& folder,
                     const PathName& name, WriteFiles write_files) {
    SPLAT_ASSIGN(const io::PathKind there, io::kind_of(os::text_of(folder / name)));
    if (there != io::PathKind::kNothing)
        return rows.advance(rows.dataset().index().views_of[object] * (rows.maps().size() + 1));
    return io::write_folder(folder / name, folder / ("." + name.text() + ".tmp"),
                            [&](const fs::path& to) { return write_files(rows, object, to); });
}

/// The folders of the objects. Errors: kFormat if two would have one, as "A" and "a" on systems that ignore case.
Result<std::vector<PathName>> folder_names(const ExportRows& rows) {
    std::vector<PathName> names;
    std::map<std::string, std::string> used;
    std::size_t changed = 0;
    for (const std::uint32_t object : rows.objects()) {
        const std::string& name = rows.name(object);
        names.emplace_back(name);
        const auto [other, fresh] = used.emplace(os::one_name(names.back().text()), name);
        if (!fresh)
            return damaged("the objects '%s' and '%s' would have the same folder '%s'",
                           shown(other->second).c_str(), shown(name).c_str(),
                           names.back().text().c_str());
        if (names.back().text() != name && changed++ == 0)
            log(LogLevel::kWarning,
                format("the object '%s' and others like it get a folder of another name, '%s'",
                       shown(name).c_str(), names.back().text().c_str()));
    }
    return names;
}

Status export_folders(ExportRows& rows, const ExportDesc& desc, const fs::path& folder,
                      WriteFiles write_files) {
    SPLAT_ASSIGN(const std::vector<PathName> names, folder_names(rows));
    SPLAT_ASSIGN(std::string source, rows.source(desc.path));
    SPLAT_ASSIGN(const tables::Journal journal,
                 tables::Journal::of_export(desc.path, desc.split, std::move(source),
                                            {os::text_of(folder)}));
    SPLAT_TRY(io::make_folders(folder));
    for (std::size_t i = 0; i < names.size(); ++i)
        SPLAT_TRY(export_object(rows, rows.objects()[i], folder, names[i], write_files));
    return {};
}

}  // namespace

Status export_srn(ExportRows& rows, const ExportDesc& desc) {
    return export_folders(
        rows, desc,
        os::path_of(desc.path) / ("srn_" + desc.category) / (desc.category + "_" + desc.split),
        write_srn_files);
}

Status export_images(ExportRows& rows, const ExportDesc& desc) {
    return export_folders(rows, desc, os::path_of(desc.path) / desc.split, write_image_files);
}

}  // namespace splat::data
