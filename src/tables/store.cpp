#include "tables/store.h"

#include "core/json_tree.h"
#include "core/json_writer.h"
#include "core/shown.h"
#include "io/folder.h"
#include "io/reader.h"

namespace splat::tables {
namespace {

constexpr const char* kStoreFormat = "libsplat store";
constexpr int kStoreVersion = 1;
constexpr int kFilesVersion = 2;  ///< the objects lie in files of their own

Status bad_store(const std::string& path, const std::string& problem) {
    return damaged("'%s': %s; remove the store and import again", path.c_str(), problem.c_str());
}

/// A whole number of a member, from 0 to `most`.
Result<std::uint64_t> count_in(const JsonTree& tree, const char* name, std::uint64_t most) {
    const auto count = tree[name].count();
    if (!count || *count > most)
        return damaged("'%s' is missing or no whole number from 0 to %llu", name, llu(most));
    return *count;
}

Result<std::string> text_in(const JsonTree& tree, const char* name) {
    const std::string* const found = tree[name].text();
    if (found == nullptr) return damaged("'%s' is missing or not a text", name);
    return *found;
}

Result<std::vector<Table>> maps_in(const JsonTree& tree) {
    std::vector<Table> maps;
    for (const Table table : kTables)
        for (const JsonTree& name : tree["maps"].items())
            if (kind_of(table).map != nullptr && name.text() != nullptr &&
                *name.text() == kind_of(table).map)
                maps.push_back(table);
    if (!maps.empty() && maps.front() == Table::kRgb) return maps;
    return damaged("'maps' has no rgb");
}

/// Adds the objects. Returns the number of their views.
Result<std::uint64_t> objects_in(const JsonTree& tree, std::vector<StoreObject>& objects) {
    std::uint64_t rows = 0;
    for (const JsonTree& item : tree["objects"].items()) {
        StoreObject object;
        SPLAT_ASSIGN(object.name, text_in(item, "name"));
        SPLAT_ASSIGN(object.intrinsics, text_in(item, "intrinsics"));
        SPLAT_ASSIGN(const std::uint64_t views, count_in(item, "views", kMaxRows));
        object.views = static_cast<std::uint32_t>(views);
        rows += views;
        objects.push_back(std::move(object));
    }
    return rows;
}

Result<ObjectFiles> object_files_in(const JsonTree& tree) {
    ObjectFiles files;
    SPLAT_ASSIGN(files.objects, count_in(tree, "objects", kMaxRows));
    SPLAT_ASSIGN(files.name_bytes, count_in(tree, "name_bytes", kMaxNameBytes));
    SPLAT_ASSIGN(files.intrinsics_bytes, count_in(tree, "intrinsics_bytes", kMaxIntrinsicsBytes));
    if (files.objects > 0 && files.name_bytes > 0 && files.intrinsics_bytes > 0) return files;
    return damaged("%llu objects with names of %llu bytes and intrinsics of %llu",
                   llu(files.objects), llu(files.name_bytes), llu(files.intrinsics_bytes));
}

/// A text without the zeros that fill its record.
Result<std::string> text_of(const RecordFile& file, std::uint64_t record, std::uint64_t bytes) {
    std::string text(bytes, '\0');
    SPLAT_TRY(file.read(record, std::as_writable_bytes(std::span(text))));
    text.resize(std::min(text.find('\0'), text.size()));
    return text;
}

Result<StoreIndex> index_in(const JsonTree& tree) {
    StoreIndex index;
    SPLAT_ASSIGN(const std::string name, text_in(tree, "format"));
    SPLAT_ASSIGN(const std::uint64_t version, count_in(tree, "version", 1'000'000));
    if (name != kStoreFormat) return damaged("'format' is '%s'", shown(name).c_str());
    if (version != kStoreVersion && version != kFilesVersion)
        return unsupported("version %llu, expected %d or %d", llu(version), kStoreVersion,
                           kFilesVersion);
    SPLAT_ASSIGN(index.split, text_in(tree, "split"));
    SPLAT_ASSIGN(index.source, text_in(tree, "source"));
    SPLAT_ASSIGN(const std::uint64_t resolution, count_in(tree, "resolution", 16384));
    index.resolution = static_cast<std::uint32_t>(resolution);
    SPLAT_ASSIGN(index.maps, maps_in(tree));
    std::uint64_t rows = 0;
    if (version == kFilesVersion) {
        SPLAT_ASSIGN(index.object_files, object_files_in(tree));
        SPLAT_ASSIGN(rows, count_in(tree, "rows", kMaxRows));
    } else {
        SPLAT_ASSIGN(rows, objects_in(tree, index.objects));
    }
    if (rows == 0 || rows > kMaxRows || resolution == 0)
        return damaged("%llu rows of %llu pixels a side", llu(rows), llu(resolution));
    index.frames.resize(rows);
    return index;
}

}  // namespace

Status place_objects(StoreIndex& index, std::size_t most) {
    if (index.object_files.objects != 0) return {};
    ObjectFiles files{index.objects.size(), 1, 1};
    bool has_zeros = false;
    std::uint64_t texts = 0;  // which store.json has at least
    for (const StoreObject& object : index.objects) {
        SPLAT_TRY(check_json_name(object.name, "a store: the object"));
        files.name_bytes = std::max<std::uint64_t>(files.name_bytes, object.name.size());
        files.intrinsics_bytes =
            std::max<std::uint64_t>(files.intrinsics_bytes, object.intrinsics.size());
        texts += object.name.size() + object.intrinsics.size();
        has_zeros = has_zeros || object.name.find('\0') != std::string::npos;
    }
    if (texts <= most && store_text(index).size() <= most) return {};
    if (files.name_bytes > kMaxNameBytes || files.intrinsics_bytes > kMaxIntrinsicsBytes ||
        has_zeros)
        return unsupported(
            "%zu objects take more than %zu bytes of store.json, and their names (%llu bytes, "
            "expected at most %zu, without NUL) or intrinsics (%llu bytes, expected at most %zu) "
            "are too long for files of their own: divide them among several data sets",
            index.objects.size(), most, llu(files.name_bytes), kMaxNameBytes,
            llu(files.intrinsics_bytes), kMaxIntrinsicsBytes);
    index.object_files = files;
    return {};
}

std::string store_text(const StoreIndex& index) {
    const ObjectFiles& files = index.object_files;
    JsonWriter json;
    json.begin_object().member("format", kStoreFormat);
    json.member("version", files.objects == 0 ? kStoreVersion : kFilesVersion);
    json.member("split", index.split).member("resolution", index.resolution);
    json.key("maps").begin_array();
    for (const Table map : index.maps) json.value(kind_of(map).map);
    json.end().member("rows", index.frames.size()).member("source", index.source);
    if (files.objects != 0) {
        json.member("objects", files.objects).member("name_bytes", files.name_bytes);
        json.member("intrinsics_bytes", files.intrinsics_bytes).end();
        return json.text() + "\n";
    }
    json.key("objects").begin_array();
    for (const StoreObject& object : index.objects) {
        json.newline(2).begin_object().member("name", object.name).member("views", object.views);
        json.member("intrinsics", object.intrinsics).end();
    }
    json.newline().end().end();
    return json.text() + "\n";
}

bool is_store_text(const std::string& folder) {
    const auto file = io::read_file(folder + "/store.json", kMaxJsonBytes);
    return file.ok() && io::as_text(file.value()).find(kStoreFormat) != std::string_view::npos;
}

Result<StoreIndex> read_store_text(const std::string& folder) {
    const std::string path = folder + "/store.json";
    SPLAT_ASSIGN(const io::Buffer file, io::read_file(path, kMaxJsonBytes));
    const auto tree = io::from_file(parse_json_tree(io::as_text(file), "store.json"));
    if (!tree.ok()) return bad_store(path, tree.status().message());
    auto index = index_in(tree.value());
    if (index.ok() || index.status().code() != Code::kFormat) return index;
    return bad_store(path, index.status().message());
}

RecordShape frame_shape(std::uint64_t rows) {
    return {"<i8", {1, rows}, rows * sizeof(std::int64_t)};
}

RecordShape pose_shape(std::uint64_t rows) {
    return {"|S512", {rows}, kMaxPoseBytes};
}

RecordShape views_shape(const ObjectFiles& files) {
    return {"<u4", {1, files.objects}, files.objects * sizeof(std::uint32_t)};
}

RecordShape name_shape(const ObjectFiles& files) {
    return {format("|S%llu", llu(files.name_bytes)), {files.objects}, files.name_bytes};
}

RecordShape intrinsics_shape(const ObjectFiles& files) {
    return {format("|S%llu", llu(files.intrinsics_bytes)), {files.objects}, files.intrinsics_bytes};
}

RecordShape image_shape(const StoreIndex& index, Table map) {
    const std::uint64_t side = index.resolution;
    RecordShape shape{"|u1", {index.frames.size(), side, side}, index.image_bytes(map)};
    if (kind_of(map).channels > 1)
        shape.shape.insert(shape.shape.begin() + 1, kind_of(map).channels);
    return shape;
}

Result<bool> is_store(const std::string& folder) {
    std::vector<std::string> places(std::begin(kSplits), std::end(kSplits));
    places.emplace_back();
    return io::holds_for_any(places, [&folder](const std::string& split) {
        return io::has_file(folder + "/" + split + "/store.json");
    });
}

Result<std::unique_ptr<Store>> Store::open(const std::string& folder) {
    std::unique_ptr<Store> store(new Store);
    StoreIndex& index = store->index_;
    SPLAT_ASSIGN(index, read_store_text(folder));
    SPLAT_TRY(store->read_objects(folder));
    const std::uint64_t rows = index.frames.size();
    SPLAT_ASSIGN(const auto frames, RecordFile::open(folder, "frame", frame_shape(rows)));
    SPLAT_TRY(frames->read(0, std::as_writable_bytes(std::span(index.frames))));
    SPLAT_ASSIGN(store->poses_, RecordFile::open(folder, "pose", pose_shape(rows)));
    for (const Table map : index.maps)
        SPLAT_SET(store->images_[map],
                  RecordFile::open(folder, kind_of(map).map, image_shape(index, map)));
    return store;
}

Status Store::read_objects(const std::string& folder) {
    const ObjectFiles& files = index_.object_files;
    if (files.objects == 0) {
        for (StoreObject& object : index_.objects)
            intrinsics_.push_back(std::move(object.intrinsics));
        return {};
    }
    SPLAT_ASSIGN(const auto names, RecordFile::open(folder, "name", name_shape(files)));
    SPLAT_ASSIGN(const auto views, RecordFile::open(folder, "views", views_shape(files)));
    SPLAT_SET(intrinsics_file_, RecordFile::open(folder, "intrinsics", intrinsics_shape(files)));
    std::vector<std::uint32_t> counts(files.objects);
    SPLAT_TRY(views->read(0, std::as_writable_bytes(std::span(counts))));
    std::uint64_t rows = 0;
    index_.objects.resize(files.objects);
    for (std::uint64_t i = 0; i < files.objects; ++i) {
        SPLAT_ASSIGN(index_.objects[i].name, text_of(*names, i, files.name_bytes));
        index_.objects[i].views = counts[i];
        rows += counts[i];
    }
    if (rows == index_.frames.size()) return {};
    return bad_store(folder + "/store.json",
                     format("%zu rows, but %llu in views.npy", index_.frames.size(), llu(rows)));
}

Result<std::string> Store::intrinsics(std::uint32_t object) const {
    if (intrinsics_file_ == nullptr) return intrinsics_[object];
    return text_of(*intrinsics_file_, object, index_.object_files.intrinsics_bytes);
}

Result<std::string> Store::pose(std::uint64_t row) const {
    return text_of(*poses_, row, kMaxPoseBytes);
}

Status Store::image(Table map, std::uint64_t row, std::span<std::byte> to) const {
    const auto found = images_.find(map);
    SPLAT_ASSERT(found != images_.end());
    return found->second->read(row, to);
}

}  // namespace splat::tables
