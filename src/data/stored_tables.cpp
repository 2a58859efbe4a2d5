#include "data/formats.h"

#include <filesystem>

#include "core/os/path.h"
#include "data/folder.h"
#include "io/folder.h"
#include "tables/import.h"
#include "tables/srn_text.h"
#include "tables/store.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using tables::Table;

constexpr const char* kCacheFolder = ".splat";

class StoreReader : public DatasetReader {
  public:
    StoreReader(const ReaderDesc& desc, const char* format, std::string folder)
        : DatasetReader(format, desc, Filter::kBicubic), folder_(std::move(folder)) {}

    Status open() {
        SPLAT_ASSIGN(store_, tables::Store::open(folder_));
        const std::string& split = store_->index().split;
        if (split != desc_.split && folder_ == desc_.path)
            return no_split(
                desc_,
                not_found("'%s' is a store of the split %s, not of %s: ask for the "
                          "split %s, or name the folder above it",
                          folder_.c_str(), split.c_str(), desc_.split.c_str(), split.c_str()));
        index_.resolution = store_->index().resolution;
        index_.maps = 0;
        for (const MapKind kind : kMaps)
            for (const Table map : store_->index().maps)
                if (map == table_of(kind)) index_.maps |= flag_of(kind);
        std::uint64_t row = 0;
        index_.folders = {folder_};
        for (tables::StoreObject& object : store_->take_objects()) {
            if (is_full()) break;
            SPLAT_TRY(
                index_.add_stored(std::move(object.name), object.views, folder_, desc_.lenient));
            rows_.push_back(row);
            row += object.views;
        }
        return {};
    }

    [[nodiscard]] Result<std::vector<StoredView>> cameras(std::uint32_t object) const override {
        SPLAT_ASSIGN(const ObjectText texts, text(object));
        const std::string place = folder_ + " " + index_.names[object];
        SPLAT_ASSIGN(const auto focal, in_file(tables::focal_of(texts.intrinsics), place));
        std::vector<StoredView> views;
        for (const ObjectText::View& view : texts.views) {
            const std::string name = place + " " + view.name;
            SPLAT_ASSIGN(const scene::Mat4 pose, pose_of_text(view.pose, name));
            views.push_back({pose, focal.x, focal.y, 0});
        }
        return views;
    }

    [[nodiscard]] Result<io::Image> image(std::uint32_t object, std::uint32_t view, MapKind kind,
                                          bool header_only) const override {
        const std::uint32_t side = index_.resolution;
        const std::uint32_t channels = channels_of(kind);
        io::Image image{side, side, channels, 8, {}};
        if (header_only) return image;
        const Table map = table_of(kind);
        std::vector<std::uint8_t> planes(store_->index().image_bytes(map));
        SPLAT_TRY(
            store_->image(map, rows_[object] + view, std::as_writable_bytes(std::span(planes))));
        const std::size_t area = std::size_t{side} * side;
        image.samples.resize(planes.size());
        for (std::size_t i = 0; i < area; ++i)
            for (std::uint32_t c = 0; c < channels; ++c)
                image.samples[i * channels + c] = planes[c * area + i];
        return image;
    }

    [[nodiscard]] Result<ObjectText> text(std::uint32_t object) const override {
        ObjectText text;
        SPLAT_ASSIGN(text.intrinsics, store_->intrinsics(object));
        for (std::uint32_t view = 0; view < index_.views_of[object]; ++view) {
            SPLAT_ASSIGN(std::string pose, store_->pose(rows_[object] + view));
            text.views.push_back({view_name(rows_[object] + view), std::move(pose)});
        }
        return text;
    }

  private:
    [[nodiscard]] std::string view_name(std::uint64_t row) const {
        return format("%06lld", lld(store_->index().frames[row]));
    }

    std::string folder_;
    std::unique_ptr<tables::Store> store_;
    std::vector<std::uint64_t> rows_;  ///< the first of each object
};

}  // namespace

Result<std::unique_ptr<DatasetReader>> open_store(const ReaderDesc& desc) {
    const fs::path folder = os::path_of(desc.path);
    const auto has_store = [&folder](const std::string& name) {
        return io::has_file(os::text_of(folder / name / "store.json"));
    };
    SPLAT_ASSIGN(const bool is_split, has_store(""));
    if (is_split) return opened<StoreReader>(desc, "store", desc.path);
    SPLAT_ASSIGN(const io::PathKind below, io::kind_of(os::text_of(folder / desc.split)));
    SPLAT_TRY(check_link(below, folder / desc.split));
    SPLAT_ASSIGN(const bool is_above, has_store(desc.split));
    if (is_above) return opened<StoreReader>(desc, "store", os::text_of(folder / desc.split));
    std::string splits;
    SPLAT_ASSIGN(const std::vector<std::string> names, io::folders_in(os::text_of(folder)));
    for (const std::string& name : names) {
        SPLAT_ASSIGN(const bool is_other, has_store(name));
        if (is_other) splits += (splits.empty() ? "" : ", ") + name;
    }
    return no_split(desc, not_found("'%s' has no store of the split %s; it has: %s",
                                    os::text_of(folder).c_str(), desc.split.c_str(),
                                    splits.empty() ? "none" : splits.c_str()));
}

std::string store_beside(const std::string& path, const std::string& split) {
    return os::text_of(os::path_of(path) / kCacheFolder / split);
}

Result<std::unique_ptr<DatasetReader>> open_tables(const ReaderDesc& desc) {
    const std::string folder = store_beside(desc.path, desc.split);
    const Status imported = tables::import_tables(
        {desc.path, desc.split, folder, "", true, {}, desc.lacks_split}, nullptr);
    if (imported.code() == Code::kIo)
        return Status(Code::kIo, imported.message() +
                                     "; where the folder of the tables cannot be written or lacks "
                                     "space, import them into another one and open that");
    SPLAT_TRY(imported);
    return opened<StoreReader>(desc, "tables", folder);
}

}  // namespace splat::data
