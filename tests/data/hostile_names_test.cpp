/// Names of objects as data may have them, through every reader and writer: nothing lies outside the folder that is
/// written, and what holds names gives them back.
#include <gtest/gtest.h>

#include <algorithm>

#include "core/os/path.h"
#include "core/path_name.h"
#include "data/dataset_export.h"
#include "data/sample_formats.h"
#include "io/folder.h"
#include "io/reader.h"
#include "support/expect_status.h"
#include "support/hostile_names.h"
#include "support/parsed_json.h"
#include "support/system.h"
#include "synthetic/sample_folder.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using test::SampleFolder;

std::vector<std::string> names_if(bool (*wanted)(const std::string&)) {
    std::vector<std::string> names = test::hostile_names();
    std::erase_if(names, [wanted](const std::string& name) { return !wanted(name); });
    return names;
}

bool fits_on_disk(const std::string& name) {
    return name.front() != '.' && name.find('/') == std::string::npos &&
           name.size() <= os::kLongestName;
}

bool is_text(const std::string& name) {
    return check_json_name(name, "").ok();
}

/// Objects of SRN's format with these names, which are links to one.
void put_srn(const fs::path& root, const std::vector<std::string>& names) {
    test::put_object(root / "object");
    fs::create_directories(root / "in/cars_train");
    for (const std::string& name : names)
        fs::create_directory_symlink(root / "object", root / "in/cars_train" / name);
}

/// A store with these names, which are written into one of names that are allowed on a disk.
void put_store(const fs::path& root, const std::vector<std::string>& names) {
    std::vector<std::string> plain;
    for (std::size_t i = 0; i < names.size(); ++i) plain.push_back(format("object%06zu", i));
    put_srn(root, plain);
    ExportDesc desc;
    desc.path = (root / "store").string();
    desc.layout = Layout::kStore;
    ASSERT_OK(export_dataset(*test::open_data(root / "in"), desc, nullptr));
    std::string index = test::file_text(root / "store/train/store.json");
    for (std::size_t i = 0; i < names.size(); ++i) {
        const std::size_t at = index.find("\"" + plain[i] + "\"");
        ASSERT_NE(at, std::string::npos);
        index.replace(at, plain[i].size() + 2, json_quote(names[i]));
    }
    test::put_text(root / "store/train/store.json", index);
}

/// Exports a data set as folders, into one below others, and compares every name in reach.
void expect_below(Dataset& dataset, const fs::path& root, Layout layout) {
    const fs::path out = root / "1/2/3/4/5/out";
    fs::remove_all(root / "1");
    ExportDesc desc;
    desc.path = out.string();
    desc.layout = layout;
    ASSERT_OK(export_dataset(dataset, desc, nullptr));
    for (fs::path above = out.parent_path(); above != root; above = above.parent_path())
        EXPECT_EQ(io::entries_in(above.string()).value().size(), 1U) << above;
    const fs::path folder = layout == Layout::kSrn ? out / "srn_cars/cars_train" : out / "train";
    std::vector<std::string> expected;
    for (const std::string& name : dataset.index().names) expected.push_back(PathName(name).text());
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(io::folders_in(folder.string()).value(), expected);
    EXPECT_EQ(test::open_data(out)->index().names, expected);
}

TEST(HostileNames, OfFolders) {
    const SampleFolder folder;
    SPLAT_NEED_LINKS(folder.path().string());
    const std::vector<std::string> names = names_if(fits_on_disk);
    ASSERT_GT(names.size(), 90U);
    put_srn(folder.path(), names);
    const auto dataset = test::open_data(folder / "in");
    EXPECT_EQ(dataset->index().names, names);
    EXPECT_OK(parse_json(report_text(*dataset), "report"));
    for (const Layout layout : {Layout::kSrn, Layout::kImages})
        expect_below(*dataset, folder.path(), layout);
}

TEST(HostileNames, OfTables) {
    const SampleFolder folder;
    SPLAT_NEED_LINKS(folder.path().string());
    const std::vector<std::string> names = names_if(is_text);
    ASSERT_GT(names.size(), 170U);
    ASSERT_NO_FATAL_FAILURE(put_store(folder.path(), names));
    const auto store = test::open_data(folder / "store");
    EXPECT_EQ(store->index().names, names);
    for (const Layout layout : {Layout::kSrn, Layout::kImages})
        expect_below(*store, folder.path(), layout);
    ExportDesc again;
    again.path = (folder / "again").string();
    again.layout = Layout::kStore;
    ASSERT_OK(export_dataset(*store, again, nullptr));
    EXPECT_EQ(test::open_data(again.path)->index().names, names);
}

TEST(HostileNames, TwoThatBecomeOneAreRefused) {
    const SampleFolder folder;
    SPLAT_NEED_LINKS(folder.path().string());
    const std::string cut = PathName(std::string(300, 'a')).text();
    ASSERT_NO_FATAL_FAILURE(put_store(folder.path(), {std::string(300, 'a'), cut}));
    ExportDesc desc;
    desc.path = (folder / "out").string();
    desc.layout = Layout::kSrn;
    EXPECT_ERROR(export_dataset(*test::open_data(folder / "store"), desc, nullptr), Code::kFormat,
                 "would have the same folder '" + cut);
    EXPECT_FALSE(fs::exists(desc.path)) << "nothing is written";
    // NMR's names join two: a_b + c and a + b_c.
    const SampleFolder nmr;
    for (const auto& [category, object] : {std::pair{"a_b", "c"}, {"a", "b_c"}}) {
        test::put_nmr(nmr.path(), test::kPose, 12, "b");
        fs::create_directories(nmr / category);
        fs::rename(nmr / "02691156/b", nmr / category / object);
        test::put_text(nmr / category / "softras_train.lst", object);
        test::put_image(nmr / category / object / "image/001.png", 8, 3);
        test::put_npz(nmr / category / object / "cameras.npz",
                      {{"world_mat_0", test::kPose}, {"world_mat_1", test::kPose}});
    }
    fs::remove_all(nmr / "02691156");
    EXPECT_ERROR(export_dataset(*test::open_data(nmr.path()), desc, nullptr), Code::kFormat,
                 "the objects 'a_b_c' and 'a_b_c' would have the same folder");
}

TEST(HostileNames, OfListsAndArraysAreThoseOfFolders) {
    const SampleFolder nmr, co3d;
    test::put_nmr(nmr.path(), test::kPose, 12);
    for (const char* name : {"../b", "/b", ".b", "..\\b", "C:b", "\\\\host\\b"}) {
        test::put_text(nmr / "02691156/softras_train.lst", name);
        EXPECT_ERROR(test::data_status(nmr.path()), Code::kFormat, "is not the name of a folder");
        test::Co3dSample sample{.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .t = {0, 0, 3}, .focal = {2, 2}};
        test::put_co3d(co3d.path(), sample);
        test::put_npz(co3d / "co3d_hydrant_for_gs/train/camera_Rs.npz", {{name, sample.r}});
        EXPECT_ERROR(test::data_status(co3d.path()), Code::kFormat, "is not the name of a folder");
    }
}

}  // namespace
}  // namespace splat::data
