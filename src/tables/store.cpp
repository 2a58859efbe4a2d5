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

Result<StoreIndex> index_in(const JsonTree& tree) {
    StoreIndex index;
    SPLAT_ASSIGN(const std::string name, text_in(tree, "format"));
    SPLAT_ASSIGN(const std::uint64_t version, count_in(tree, "version", 1'000'000));
    if (name != kStoreFormat) return damaged("'format' is '%s'", shown(name).c_str());
    if (version != kStoreVersion)
        return unsupported("version %llu, expected %d", llu(version), kStoreVersion);
    SPLAT_ASSIGN(index.split, text_in(tree, "split"));
    SPLAT_ASSIGN(index.source, text_in(tree, "source"));
    SPLAT_ASSIGN(const std::uint64_t resolution, count_in(tree, "resolution", 16384));
    index.resolution = static_cast<std::uint32_t>(resolution);
    SPLAT_ASSIGN(index.maps, maps_in(tree));
    std::uint64_t rows = 0;
    for (const JsonTree& item : tree["objects"].items()) {
        StoreObject object;
        SPLAT_ASSIGN(object.name, text_in(item, "name"));
        SPLAT_ASSIGN(object.intrinsics, text_in(item, "intrinsics"));
        SPLAT_ASSIGN(const std::uint64_t views, count_in(item, "views", kMaxRows));
        object.views = static_cast<std::uint32_t>(views);
        rows += views;
        index.objects.push_back(std::move(object));
    }
    if (rows == 0 || rows > kMaxRows || resolution == 0)
        return damaged("%llu rows of %llu pixels a side", llu(rows), llu(resolution));
    index.frames.resize(rows);
    return index;
}

}  // namespace

Result<std::string> store_text(const StoreIndex& index) {
    JsonWriter json;
    json.begin_object().member("format", kStoreFormat).member("version", kStoreVersion);
    json.member("split", index.split).member("resolution", index.resolution);
    json.key("maps").begin_array();
    for (const Table map : index.maps) json.value(kind_of(map).map);
    json.end().member("rows", index.frames.size()).member("source", index.source);
    json.key("objects").begin_array();
    for (const StoreObject& object : index.objects) {
        SPLAT_TRY(check_json_name(object.name, "a store: the object"));
        json.newline(2).begin_object().member("name", object.name).member("views", object.views);
        json.member("intrinsics", object.intrinsics).end();
    }
    json.newline().end().end();
    std::string text = json.text() + "\n";
    if (text.size() <= kMaxJsonBytes) return text;
    return unsupported(
        "%zu objects take %zu bytes of store.json, at most %zu: divide them among several "
        "data sets",
        index.objects.size(), text.size(), kMaxJsonBytes);
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
    const std::uint64_t rows = index.frames.size();
    SPLAT_ASSIGN(const auto frames, RecordFile::open(folder, "frame", frame_shape(rows)));
    SPLAT_TRY(frames->read(0, std::as_writable_bytes(std::span(index.frames))));
    SPLAT_ASSIGN(store->poses_, RecordFile::open(folder, "pose", pose_shape(rows)));
    for (const Table map : index.maps)
        SPLAT_SET(store->images_[map],
                  RecordFile::open(folder, kind_of(map).map, image_shape(index, map)));
    return store;
}

Result<std::string> Store::pose(std::uint64_t row) const {
    std::string text(kMaxPoseBytes, '\0');
    SPLAT_TRY(poses_->read(row, std::as_writable_bytes(std::span(text))));
    text.resize(std::min(text.find('\0'), text.size()));
    return text;
}

Status Store::image(Table map, std::uint64_t row, std::span<std::byte> to) const {
    const auto found = images_.find(map);
    SPLAT_ASSERT(found != images_.end());
    return found->second->read(row, to);
}

}  // namespace splat::tables
