// Stores of more objects than store.json can hold.
#include "tables/store.h"

#include <gtest/gtest.h>

#include "data/dataset.h"
#include "data/formats.h"
#include "support/expect_status.h"
#include "synthetic/sample_folder.h"
#include "tables/table_samples.h"

namespace splat::tables {
namespace {

namespace fs = std::filesystem;
using namespace test;

constexpr std::uint32_t kObjects = 5;

/// Objects of 2, 3... views.
StoreIndex sample_index() {
    StoreIndex index;
    index.split = "train";
    index.source = "x";
    index.resolution = 2;
    index.maps = {Table::kRgb};
    for (std::uint32_t i = 0; i < kObjects; ++i) {
        index.objects.push_back(
            {"car" + std::string(i, 'x'), format("%u 1 1 0\n0 0 0\n1\n2 2\n", i + 2), i + 2});
        for (std::uint32_t view = 0; view < i + 2; ++view) index.frames.push_back(10 * view);
    }
    return index;
}

/// `most`: bytes of store.json.
Status write(const fs::path& folder, StoreIndex index, std::size_t most) {
    SPLAT_TRY(place_objects(index, most));
    SPLAT_ASSIGN(const auto store, StoreWriter::open(folder.string(), std::move(index), true));
    for (std::uint64_t row = 0; row < store->index().frames.size(); ++row) {
        const std::vector<std::byte> pixels(12, static_cast<std::byte>(row));
        const std::string pose = format("1 0 0 %llu 0 1 0 0 0 0 1 0 0 0 0 1", llu(row));
        SPLAT_TRY(store->put(Table::kPoses, row, io::as_bytes(pose)));
        SPLAT_TRY(store->put(Table::kRgb, row, pixels));
    }
    return store->finish();
}

std::unique_ptr<data::Dataset> opened(const fs::path& folder) {
    data::DatasetDesc desc;
    desc.path = folder.string();
    return need(data::Dataset::open(desc));
}

TEST(Store, ObjectsInFilesAreThoseInStoreJson) {
    const SampleFolder folder;
    ASSERT_OK(write(folder / "a/train", sample_index(), kMaxJsonBytes));
    ASSERT_OK(write(folder / "b/train", sample_index(), 100));
    EXPECT_FALSE(fs::exists(folder / "a/train/name.npy"));
    EXPECT_LT(fs::file_size(folder / "b/train/store.json"), 300U);
    const auto a = opened(folder / "a"), b = opened(folder / "b");
    EXPECT_EQ(a->index().names, b->index().names);
    EXPECT_EQ(a->index().views_of, b->index().views_of);
    for (std::uint32_t object = 0; object < kObjects; ++object) {
        const auto one = need(a->reader().text(object)), two = need(b->reader().text(object));
        EXPECT_EQ(one.intrinsics, two.intrinsics);
        ASSERT_EQ(one.views.size(), object + 2);
        ASSERT_EQ(two.views.size(), object + 2);
        EXPECT_EQ(one.views.back().pose, two.views.back().pose);
        EXPECT_EQ(one.views.back().name, two.views.back().name);
        const auto image = need(b->reader().map(object, object + 1, data::MapKind::kRgb));
        EXPECT_EQ(need(a->reader().map(object, object + 1, data::MapKind::kRgb)).samples,
                  image.samples);
    }
}

TEST(Store, WithDamagedFilesOfObjectsIsRefused) {
    const SampleFolder folder;
    const fs::path store = folder / "store/train";
    ASSERT_OK(write(store, sample_index(), 100));
    const auto refused = [&](const char* file, std::size_t from_end, const char* sentence) {
        const std::string bytes = file_text(store / file);
        std::string bad = bytes;
        bad[bad.size() - from_end] = static_cast<char>(bad[bad.size() - from_end] ^ 1);
        put_text(store / file, bad);
        EXPECT_ERROR(Store::open(store.string()), Code::kFormat, sentence);
        put_text(store / file, bytes);
    };
    refused("name.npy", 2, "name.npy': record 4 does not have its checksum");
    refused("views.npy", 1, "views.npy': record 0 does not have its checksum");
    refused("name.npy", fs::file_size(store / "name.npy"), "is not the .npy file that its");
    const std::string json = file_text(store / "store.json");
    const auto with = [&](const std::string& from, const std::string& to, const char* sentence) {
        std::string bad = json;
        bad.replace(bad.find(from), from.size(), to);
        put_text(store / "store.json", bad);
        EXPECT_ERROR(Store::open(store.string()), Code::kFormat, sentence);
    };
    with("\"rows\": 20", "\"rows\": 19", "19 rows, but 20 in views.npy");
    with("\"objects\": 5", "\"objects\": 4", "is not the .npy file that its store.json");
    with("\"objects\": 5", "\"objects\": 0", "0 objects with names of 7 bytes");
    with("\"name_bytes\": 7", "\"name_bytes\": 513", "'name_bytes' is missing or no whole");
    put_text(store / "store.json", json);
    EXPECT_OK(Store::open(store.string()));
    fs::remove(store / "intrinsics.npy");
    EXPECT_ERROR(Store::open(store.string()), Code::kNotFound, "intrinsics.npy");
}

/// A later import without such files leaves none.
TEST(Store, OfManyObjectsIsReplaced) {
    const SampleFolder folder;
    ASSERT_OK(write(folder / "store", sample_index(), 100));
    StoreIndex other = sample_index();
    other.source = "y";
    ASSERT_OK(write(folder / "store", other, kMaxJsonBytes));
    ASSERT_OK(write(folder / "plain", other, kMaxJsonBytes));
    EXPECT_TRUE(tree_of(folder / "store", {".npy", ".json"}) ==
                tree_of(folder / "plain", {".npy", ".json"}));
}

TEST(Store, OfNamesTooLongForFilesIsRefusedBeforeItBegins) {
    const SampleFolder folder;
    for (const std::string& name : {std::string(513, 'a'), std::string("a\0b", 3)}) {
        StoreIndex index = sample_index();
        index.objects.back().name = name;
        EXPECT_ERROR(write(folder / "store", index, 100), Code::kUnsupported,
                     "too long for files of their own: divide them among several");
        EXPECT_FALSE(fs::exists(folder / "store"));
    }
}

}  // namespace
}  // namespace splat::tables
