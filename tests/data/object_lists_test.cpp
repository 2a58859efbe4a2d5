#include "data/object_lists.h"

#include <gtest/gtest.h>

#include "data/sample_formats.h"
#include "support/expect_status.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;

template <class Load>
auto loaded(Load load, const std::string& text) {
    const SampleFolder folder;
    const fs::path path = folder / "list";
    put_text(path, text);
    return load(path.string());
}

TEST(ObjectLists, NamesOfSequencesInAnyText) {
    const auto found = need(loaded(load_excluded_sequences,
                                   "NAN = {\n    \"hydrant\": [\n        \"116_13653_28885\",\n"
                                   "        '38_1656_5080',  # a comment of 1_2\n    ],\n}\n"
                                   "106_12648_23157\n_1_2_3 1_2_3_4 x1_2_3 1__2 1_2_3y 1_2_ 7\n"));
    EXPECT_EQ(found, (std::set<std::string>{"106_12648_23157", "116_13653_28885", "38_1656_5080"}));
    EXPECT_ERROR(loaded(load_excluded_sequences, "hydrant, 12"), Code::kFormat,
                 "holds no names of sequences");
}

TEST(ObjectLists, JsonOfNames) {
    const auto found = need(loaded(load_object_list, R"(["b", "a"])"));
    EXPECT_EQ(found, (std::vector<std::string>{"b", "a"})) << "in their order";
    const auto refused = [](const char* text, const char* part) {
        EXPECT_ERROR(loaded(load_object_list, text), Code::kFormat, part);
    };
    refused("[]", "expected a JSON array");
    refused("{}", "expected a JSON array");
    refused("[\"a\"", "list'");
    refused(R"(["a", 1])", "element 1 is not the name of a folder");
    refused(R"(["a/b"])", "element 0 is not");
    refused(R"([".."])", "element 0 is not");
    refused(R"(["a", "a"])", "element 1, 'a', occurs twice");
}

TEST(ObjectLists, LinesOfSourceViews) {
    const auto found = need(loaded(load_source_views, "02691156 b 3\r\n\n 02691156\ta 0 \n"));
    ASSERT_EQ(found.size(), 2U);
    EXPECT_EQ(found[0].category, "02691156");
    EXPECT_EQ(found[0].object, "b");
    EXPECT_EQ(found[0].view, 3U);
    EXPECT_EQ(found[1].object, "a");
    const auto refused = [](const char* text, const char* part) {
        EXPECT_ERROR(loaded(load_source_views, text), Code::kFormat, part);
    };
    refused("c a 1\nc a\n", "line 2 is not 'category object view'");
    refused("c a -1", "line 1 is not");
    refused("c a 1x", "line 1 is not");
    refused("c a 99999999999", "line 1 is not");
    refused("../c a 1", "line 1 is not");
    refused("c a 1\nc a 2", "line 2 names an object for the second time");
    refused("\n", "holds no lines");
}

TEST(ObjectLists, OrderAndSplitObjaverse) {
    const SampleFolder folder;
    for (const char* name : {"a", "b", "c"}) put_renders(folder / name, twice(kPose));
    put_text(folder / "lvis.json", R"(["c", "a"])");
    DatasetDesc desc = data_desc(folder.path());
    desc.objects_file = "lvis.json";  // in the folder of the data
    const auto train = open_data(desc);
    EXPECT_EQ(train->index().names, (std::vector<std::string>{"c"}));
    desc.split = "val";
    EXPECT_EQ(open_data(desc)->index().names, (std::vector<std::string>{"a"}));
    put_text(folder / "lvis.json", R"(["c", "d"])");
    EXPECT_ERROR(data_status(desc), Code::kFormat, "/d': No such file");
    desc.objects_file = "none.json";
    EXPECT_ERROR(data_status(desc), Code::kNotFound, "none.json");
}

TEST(ObjectLists, ExcludeSequencesOfCo3d) {
    const SampleFolder folder;
    put_co3d(folder.path(), two_co3d_frames("1_2_4"));
    put_co3d(folder.path(), two_co3d_frames("1_2_3"));
    put_text(folder / "bad_sequences.py", "['1_2_4', '9_9_9']");
    DatasetDesc desc = data_desc(folder.path());
    EXPECT_EQ(open_data(desc)->index().names, (std::vector<std::string>{"1_2_3", "1_2_4"}));
    desc.excluded_file = (folder / "bad_sequences.py").string();
    const auto dataset = open_data(desc);
    EXPECT_EQ(dataset->index().names, (std::vector<std::string>{"1_2_3"}));
    EXPECT_EQ(dataset->index().excluded, 1U);
    EXPECT_HAS(report_text(*dataset), "\"excluded\": 1");
    put_text(folder / "bad_sequences.py", "['1_2_4', '1_2_3']");
    EXPECT_ERROR(data_status(desc), Code::kNotFound, "besides 2 excluded ones");
}

TEST(Categories, ChooseAmongFolders) {
    const SampleFolder folder;
    put_co3d(folder.path(), two_co3d_frames("1_2_4"));
    fs::rename(folder / "co3d_hydrant_for_gs", folder / "co3d_teddybear_for_gs");
    put_co3d(folder.path(), two_co3d_frames("1_2_3"));
    DatasetDesc desc = data_desc(folder.path());
    EXPECT_ERROR(data_status(desc), Code::kInvalidArgument, "give the path of one category");
    desc.category = "teddybears";
    EXPECT_EQ(open_data(desc)->index().names, (std::vector<std::string>{"1_2_4"}));
    desc.category = "hydrants";
    EXPECT_EQ(open_data(desc)->index().names, (std::vector<std::string>{"1_2_3"}));
    desc.category = "apples";
    EXPECT_ERROR(data_status(desc), Code::kInvalidArgument, "give the path of one category");
}

TEST(ObjectLists, SourceViewsAreNmrsTestObjects) {
    const SampleFolder folder;
    for (const char* name : {"a", "b"}) put_nmr(folder.path(), twice(kPose), 12, name);
    put_text(folder / "02691156/softras_test.lst", "a\n");
    put_text(folder / "views.txt", "02691156 b 1\n02691156 a 0\n");
    DatasetDesc desc = data_desc(folder.path(), "test");
    EXPECT_EQ(open_data(desc)->index().names, (std::vector<std::string>{"02691156_a"}));
    EXPECT_TRUE(open_data(desc)->index().source_views.empty());
    desc.views_file = "views.txt";
    const auto test = open_data(desc);
    EXPECT_EQ(test->index().names, (std::vector<std::string>{"02691156_b", "02691156_a"}));
    EXPECT_EQ(test->index().source_views, (std::vector<std::uint32_t>{1, 0}));
    desc.split = "train";
    EXPECT_EQ(open_data(desc)->index().names, (std::vector<std::string>{"02691156_b"}))
        << "that of softras_train.lst";
    desc.split = "test";
    put_text(folder / "views.txt", "02691156 b 2\n");
    EXPECT_ERROR(data_status(desc), Code::kFormat, "view 2 of 02691156_b, which has 2 views");
    put_text(folder / "views.txt", "02691156 c 0\n");
    EXPECT_ERROR(data_status(desc), Code::kFormat, "c' has no cameras.npz");
}

TEST(ObjectLists, EachBelongsToOneFormat) {
    const SampleFolder folder;
    put_nmr(folder.path(), twice(kPose), 12);
    DatasetDesc desc = data_desc(folder.path());
    desc.objects_file = "x";
    EXPECT_ERROR(data_status(desc), Code::kInvalidArgument,
                 "objects_file is 'x', expected none: it is for data of the format objaverse");
    desc.objects_file.clear();
    desc.excluded_file = "x";
    EXPECT_ERROR(data_status(desc), Code::kInvalidArgument, "excluded_file is 'x'");
}

}  // namespace
}  // namespace splat::data
