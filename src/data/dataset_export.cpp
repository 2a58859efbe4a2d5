#include "data/dataset_export.h"

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <set>

#include "core/log.h"
#include "core/number_in.h"
#include "core/os/file.h"
#include "core/os/path.h"
#include "data/export_rows.h"
#include "data/folder.h"
#include "data/formats.h"
#include "data/object_lists.h"
#include "io/compress.h"
#include "io/file.h"
#include "tables/store.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using tables::Table;

Status check_name(const char* what, const std::string& name) {
    if (is_folder_name(name)) return {};
    return invalid("%s is '%s', expected the name of a folder", what, name.c_str());
}

Status check_export(const Dataset& dataset, const ExportDesc& desc) {
    if (desc.path.empty()) return invalid("path is empty, expected a folder");
    SPLAT_TRY(check_name("category", desc.category));
    if (desc.part.count > 1 && desc.layout != Layout::kStore)
        return invalid("%u shards, expected 1: only stores are written in more", desc.part.count);
    SPLAT_TRY(check_split(desc.split));
    std::set<std::uint32_t> seen;
    for (const std::uint32_t object : desc.objects)
        if (object >= dataset.index().names.size() || !seen.insert(object).second)
            return invalid("object %u occurs twice, or is not among the %zu objects", object,
                           dataset.index().names.size());
    return {};
}

/// A name, the file's bytes and the time of its last change.
std::string stamp_of(const std::string& name, const fs::path& file) {
    constexpr std::int64_t kSecond = 1'000'000'000;
    os::FileInfo info;
    const bool known = os::examine(os::text_of(file), info) == 0;
    return format("%s %lld %lld %lld\n", name.c_str(), known ? lld(info.bytes) : -1LL,
                  lld(info.changed_ns / kSecond), lld(info.changed_ns % kSecond));
}

/// The stamps of all files in a folder and those below, in the order of their names; without hidden ones, and those
/// in `out`.
Result<std::string> stamps_below(const fs::path& folder, const fs::path& out) {
    std::vector<std::string> stamps;
    std::error_code failed, none;
    const auto links = fs::directory_options::follow_directory_symlink;
    for (fs::recursive_directory_iterator entry(folder, links, failed), end;
         !failed && entry != end; entry.increment(failed)) {
        const fs::path& path = entry->path();
        const bool hidden = os::text_of(path.filename()).starts_with(".");
        if (entry->is_directory(none)) {
            if (hidden || fs::equivalent(path, out, none)) entry.disable_recursion_pending();
        } else if (!hidden) {
            stamps.push_back(stamp_of(os::text_of(path.lexically_relative(folder)), path));
        }
    }
    if (failed) return io::system_error(failed, "list the folder", os::text_of(folder));
    std::ranges::sort(stamps);
    return std::accumulate(stamps.begin(), stamps.end(), std::string());
}

/// The number of a stem of digits.
std::optional<std::int64_t> number_of(const std::string& stem) {
    const auto number = number_in<std::int64_t>(stem);
    return number && *number >= 0 && *number <= 0x7FFFFFFF ? number : std::nullopt;
}

}  // namespace

ExportRows::ExportRows(Dataset& dataset, const ExportDesc& desc, const tables::Progress& progress)
    : dataset_(dataset), progress_(progress), category_(desc.category), objects_(desc.objects) {
    if (objects_.empty()) {
        objects_.resize(dataset.index().names.size());
        std::iota(objects_.begin(), objects_.end(), 0U);
    }
    std::ranges::sort(objects_);
    for (const std::uint32_t object : objects_) rows_ += dataset.index().views_of[object];
}

std::vector<Table> ExportRows::maps() const {
    std::vector<Table> maps;
    for (const Table table : tables::kTables)
        if (tables::kind_of(table).map != nullptr &&
            (dataset_.index().maps & flag_of(map_of(table))) == flag_of(map_of(table)))
            maps.push_back(table);
    return maps;
}

const std::string& ExportRows::name(std::uint32_t object) const {
    return dataset_.index().names[object];
}

Result<std::string> ExportRows::source(const std::string& out) {
    const DatasetIndex& index = dataset_.index();
    std::uint32_t crc = 0, files = 0;
    for (const std::uint32_t object : objects_)
        crc = io::crc32_of(
            io::as_bytes(format("%s %u\n", name(object).c_str(), index.views_of[object])), crc);
    for (const std::string& file : index.files) {
        const std::string stamp = stamp_of(file.substr(os::name_start(file)), os::path_of(file));
        files = io::crc32_of(io::as_bytes(stamp), files);
    }
    std::string last;
    for (const std::uint32_t object : objects_) {
        const bool shared = index.folders.size() == 1;  // a store's
        const std::string& own = index.folders[shared ? 0 : object];
        if (own == last) continue;
        SPLAT_TRY(advance(0));
        last = own;
        SPLAT_ASSIGN(const std::string stamps, stamps_below(os::path_of(last), os::path_of(out)));
        files = io::crc32_of(io::as_bytes(stamps), files);
    }
    std::string text =
        format("%s, %zu objects, %llu views of %u pixels,", dataset_.index().format.c_str(),
               objects_.size(), llu(rows_), dataset_.resolution());
    for (const Table map : maps()) text += std::string(" ") + tables::kind_of(map).map;
    for (const float value : dataset_.background())
        text += format(" %g", static_cast<double>(value));
    return text + format(" behind, names %08x, files %08x", crc, files);
}

Result<ExportRows::Cameras> ExportRows::cameras(std::uint32_t object) {
    Cameras out;
    SPLAT_ASSIGN(out.text, dataset_.reader().text(object));
    std::set<std::int64_t> seen;
    for (const ObjectText::View& view : out.text.views) {
        const auto number = number_of(view.name);
        if (number && seen.insert(*number).second) out.frames.push_back(*number);
    }
    const bool numbered = out.frames.size() == out.text.views.size();
    if (numbered && std::ranges::is_sorted(out.frames)) return out;
    if (!warned_)
        log(LogLevel::kWarning,
            format("object '%s': names of views such as '%s' are no numbers of one length; the "
                   "views are numbered in the order of their names",
                   name(object).c_str(), out.text.views.front().name.c_str()));
    warned_ = true;
    out.frames.resize(out.text.views.size());
    std::iota(out.frames.begin(), out.frames.end(), 0);
    return out;
}

Result<io::Buffer> ExportRows::planes(std::uint32_t object, std::uint32_t view, Table map) {
    SPLAT_ASSIGN(const ImageCache::Pixels pixels, dataset_.pixels(object, view, map_of(map)));
    const std::size_t channels = tables::kind_of(map).channels;
    const std::size_t area = pixels->size() / channels;
    io::Buffer planes(pixels->size());
    for (std::size_t i = 0; i < area; ++i)
        for (std::size_t c = 0; c < channels; ++c)
            planes[c * area + i] = static_cast<std::byte>((*pixels)[i * channels + c]);
    return planes;
}

Status ExportRows::advance(std::uint64_t rows) {
    done_ += rows;
    if (!progress_) return {};
    return progress_(done_, rows_ * (maps().size() + 1));
}

/// Writes the rows of an object, the first of which is `row`, that the store does not hold.
static Status store_object(ExportRows& rows, tables::StoreWriter& store, std::uint32_t object,
                           std::uint64_t row) {
    SPLAT_ASSIGN(const ExportRows::Cameras cameras, rows.cameras(object));
    const std::vector<Table> maps = rows.maps();
    for (std::uint32_t view = 0; view < cameras.frames.size(); ++view) {
        SPLAT_TRY(
            store.put(Table::kPoses, row + view, io::as_bytes(cameras.text.views[view].pose)));
        for (const Table map : maps) {
            if (store.holds(map, row + view)) continue;
            SPLAT_ASSIGN(const io::Buffer planes, rows.planes(object, view, map));
            SPLAT_TRY(store.put(map, row + view, planes));
        }
    }
    return rows.advance(cameras.frames.size() * (maps.size() + 1));
}

Status export_store(ExportRows& rows, const ExportDesc& desc) {
    tables::StoreIndex index;
    index.split = desc.split;
    SPLAT_ASSIGN(index.source, rows.source(desc.path));
    index.resolution = rows.dataset().resolution();
    index.maps = rows.maps();
    for (const std::uint32_t object : rows.objects()) {
        SPLAT_ASSIGN(const ExportRows::Cameras cameras, rows.cameras(object));
        index.objects.push_back({rows.name(object), cameras.text.intrinsics,
                                 static_cast<std::uint32_t>(cameras.frames.size())});
        index.frames.insert(index.frames.end(), cameras.frames.begin(), cameras.frames.end());
    }
    SPLAT_ASSIGN(const auto store, tables::StoreWriter::open(desc.path + "/" + desc.split,
                                                             std::move(index), false, desc.part));
    if (store->complete()) return {};
    const std::vector<std::uint32_t>& objects = rows.objects();
    std::uint64_t row = 0;
    for (std::size_t i = 0; i < desc.part.end(objects.size()); ++i) {
        if (i >= desc.part.begin(objects.size()))
            SPLAT_TRY(store_object(rows, *store, objects[i], row));
        row += rows.dataset().index().views_of[objects[i]];
    }
    return store->finish();
}

Status export_dataset(Dataset& dataset, const ExportDesc& desc, const tables::Progress& progress) {
    ExportDesc own = desc;
    if (own.split.empty()) own.split = dataset.index().split;
    SPLAT_TRY(check_export(dataset, own));
    if (dataset.index().source_distance != 0)
        log(LogLevel::kWarning,
            format("scenes of the format %s are scaled when they are read; the export has them "
                   "unscaled",
                   dataset.index().format.c_str()));
    if (!dataset.index().source_views.empty())
        log(LogLevel::kWarning, "the list of source views for evaluations is not exported");
    if (dataset.index().format == "co3d")
        log(LogLevel::kWarning, "the distances of origins of CO3D are not exported");
    if ((dataset.index().maps & flag_of(MapKind::kPlane)) != 0)
        log(LogLevel::kWarning, own.layout == Layout::kSrn || own.layout == Layout::kImages
                                    ? "plane maps are not exported; 'vkrun priors plane' makes "
                                      "them again from the depth of the export"
                                    : "plane maps are not exported");
    ExportRows rows(dataset, own, progress);
    if (own.layout == Layout::kStore) return export_store(rows, own);
    if (own.layout == Layout::kImages) return export_images(rows, own);
    return own.layout == Layout::kSrn ? export_srn(rows, own) : export_tables(rows, own);
}

}  // namespace splat::data
