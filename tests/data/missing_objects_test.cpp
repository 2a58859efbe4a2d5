/// Every format: what is there is read, or an error, or named. No run silently takes fewer objects than there are.
#include <gtest/gtest.h>

#include <functional>

#include "core/fault.h"
#include "data/dataset_check.h"
#include "data/sample_formats.h"
#include "support/expect_status.h"
#include "support/log_capture.h"
#include "support/system.h"
#include "synthetic/sample_folder.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;

constexpr std::size_t kObjects = 3;

void put_srn(const fs::path& root) {
    for (const char* name : {"a", "b", "c"}) put_object(root / "cars_train" / name);
}

void put_sequences(const fs::path& root) {
    Co3dSample sample = two_co3d_frames();
    std::map<std::string, std::vector<float>> r, t;
    for (const char* name : {"a", "b", "c"}) {
        sample.name = name;
        put_co3d(root, sample);
        r[name] = sample.r;
        t[name] = sample.t;
    }
    put_npz(root / "co3d_hydrant_for_gs/train/camera_Rs.npz", r);
    put_npz(root / "co3d_hydrant_for_gs/train/camera_Ts.npz", t);
}

void put_nmr_objects(const fs::path& root) {
    for (const char* name : {"a", "b", "c"}) put_nmr(root, twice(kPose), 12, name);
    put_text(root / "02691156/softras_train.lst", "a\nb\nc\n");
}

void put_disn(const fs::path& root) {
    for (const char* name : {"a", "b", "c"}) {
        const fs::path easy = root / "image/03001627" / name / "easy";
        put_text(easy / "rendering_metadata.txt",
                 "[10,20,0,0.7,35,32,1.75,0,0,0], \n[20,25,0,0.8,35,32,1.75,0,0,0], \n");
        for (const char* image : {"00.png", "01.png"}) put_image(easy / image, 8, 4);
    }
}

void put_objaverse(const fs::path& root) {
    for (const char* name : {"a", "b", "c", "d"}) put_renders(root / name, twice(kPose));
}

void put_gso(const fs::path& root) {
    for (const char* name : {"a", "b", "c"})
        put_renders(root / name / "render_mvs_25/model", twice(kPose));
}

void put_photographs(const fs::path& root) {
    for (const char* name : {"a", "b", "c"}) {
        put_text(root / name / "transforms.json",
                 two_frames(R"("fl_x": 8, "w": 8, "h": 8)", "0", "1"));
        for (const char* image : {"0.png", "1.png"}) put_image(root / name / image, 8, 3);
    }
}

/// A format, where its object b lies, and parts of an object, each without which it is incomplete.
struct Case {
    const char* format;
    void (*put)(const fs::path& root);
    const char* split;
    const char* objects;
    std::vector<const char*> parts;
    const char* only_part;  ///< part that still makes it an object; nullptr: none
};

const std::vector<Case>& cases() {
    static const std::vector<Case> all = {
        {"srn", put_srn, "train", "cars_train", {"intrinsics.txt", "rgb", "pose"}, "rgb"},
        {"co3d",
         put_sequences,
         "train",
         "co3d_hydrant_for_gs/train",
         {"focal_lengths.npy", "images_full.npy", ""},
         nullptr},
        {"nmr", put_nmr_objects, "train", "02691156", {"cameras.npz", "image", ""}, nullptr},
        {"disn",
         put_disn,
         "train",
         "image/03001627",
         {"easy/rendering_metadata.txt", "easy/00.png"},
         nullptr},
        {"objaverse", put_objaverse, "train", "", {"001.npy", "000.png"}, nullptr},
        {"gso",
         put_gso,
         "test",
         "",
         {"render_mvs_25/model/001.npy", "render_mvs_25/model"},
         nullptr},
        {"images", put_photographs, "train", "", {"transforms.json", "1.png"}, "0.png"}};
    return all;
}

DatasetDesc desc_of(const Case& c, const SampleFolder& folder) {
    return data_desc(folder.path(), c.split);
}

/// Opens the data set with object b broken in this way, in each of the three ways.
void expect_gap(const Case& c, const std::string& what, bool unreadable,
                const std::function<void(const fs::path& object)>& broken) {
    SCOPED_TRACE(std::string(c.format) + ": " + what);
    const SampleFolder folder;
    c.put(folder.path());
    const fs::path object = folder / c.objects / "b";
    broken(object);
    DatasetDesc desc = desc_of(c, folder);
    EXPECT_ERROR(Dataset::open(desc), unreadable ? Code::kIo : Code::kFormat,
                 object.generic_string());
    desc.lenient = true;
    const auto checked = need(Dataset::open(desc));
    const DatasetIndex& all = checked->index();
    ASSERT_EQ(all.names.size(), kObjects);
    for (std::uint32_t i = 0; i < kObjects; ++i)
        EXPECT_EQ(check_object(*checked, i).value().problems.empty(), i != 1) << i;
    desc.lenient = false;
    desc.allow_missing = true;
    const auto rest = Dataset::open(desc);
    if (unreadable) {
        EXPECT_ERROR(rest, Code::kIo, object.string());
        return;
    }
    ASSERT_OK(rest);
    const DatasetIndex& taken = rest.value()->index();
    EXPECT_EQ(taken.names, (std::vector<std::string>{all.names[0], all.names[2]}));
    ASSERT_EQ(taken.missing.size(), 1U);
    EXPECT_EQ(taken.missing[0].first, all.names[1]);
    EXPECT_OK(data_status(desc));
}

TEST(MissingObjects, AreRefusedListedOrNamed) {
    for (const Case& c : cases()) {
        for (const char* part : c.parts)
            expect_gap(c, std::string("without ") + part, false, [&](const fs::path& object) {
                fs::remove_all(*part == '\0' ? object : object / part);
            });
        if (makes_links_in(fs::temp_directory_path().string()))
            expect_gap(c, "a link that leads nowhere", false, [](const fs::path& object) {
                fs::remove_all(object);
                fs::create_symlink("/nonexistent/elsewhere", object);
            });
        if (c.only_part != nullptr)
            expect_gap(c, std::string("nothing but ") + c.only_part, false,
                       [&](const fs::path& object) {
                           fs::rename(object / c.only_part, object.string() + "_part");
                           fs::remove_all(object);
                           fs::create_directory(object);
                           fs::rename(object.string() + "_part", object / c.only_part);
                       });
        if (!kHasPermissions) continue;
        const AnotherUser user;
        expect_gap(c, "mode 000", true,
                   [](const fs::path& object) { fs::permissions(object, fs::perms::none); });
    }
}

TEST(MissingObjects, MapsThatOthersHaveAreMissed) {
    const SampleFolder folder;
    put_srn(folder.path());
    const fs::path objects = folder / "cars_train";
    for (const char* map :
         {"a/depth/000000.png", "a/depth/000001.png", "c/depth/000000.png", "c/depth/000001.png"})
        put_image(objects / map, 8, 1);
    DatasetDesc desc = data_desc(folder.path());
    EXPECT_EQ(open_data(desc)->index().maps, 0U) << "nobody asked for them";
    desc.lenient = true;
    const auto dataset = open_data(desc);
    const auto found = check_object(*dataset, 1).value();
    ASSERT_EQ(found.problems.size(), 1U);
    EXPECT_EQ(found.problems[0], "there are no depth maps in '" +
                                     (objects / "b/depth").generic_string() +
                                     "', which 2 other objects have");
    EXPECT_TRUE(check_object(*dataset, 0).value().problems.empty());
    put_image(objects / "b/depth/000000.png", 8, 1);
    put_image(objects / "b/depth/000001.png", 8, 1);
    EXPECT_TRUE(check_object(*open_data(desc), 1).value().problems.empty());
}

/// All gone is not a split that is not there, and nor is a split's folder that is a link to another disk.
TEST(MissingObjects, ASplitOfNothingButGapsIsThere) {
    for (const Case& c : cases()) {
        SCOPED_TRACE(c.format);
        const SampleFolder folder;
        c.put(folder.path());
        for (const char* name : {"a", "b", "c", "d"})
            fs::remove_all(folder / c.objects / name / c.parts[0]);
        DatasetDesc desc = desc_of(c, folder);
        desc.format = c.format;
        desc.allow_missing = true;
        bool lacks = false;
        desc.lacks_split = &lacks;
        const Status opened = Dataset::open(desc).status();
        if (std::string(c.format) == "images" || std::string(c.format) == "srn") {
            EXPECT_FALSE(opened.ok()) << "cameras and intrinsics.txt are what tells these formats";
            continue;
        }
        EXPECT_ERROR(opened, Code::kFormat, "objects of the split");
        EXPECT_FALSE(lacks);
    }
    const SampleFolder srn, co3d, images;
    SPLAT_NEED_LINKS(srn.path().string());
    put_srn(srn.path());
    fs::create_symlink("/nonexistent/disk", srn / "cars_val");
    put_sequences(co3d.path());
    fs::create_symlink("/nonexistent/disk", co3d / "co3d_hydrant_for_gs/val");
    put_photographs(images / "train");
    fs::create_symlink("/nonexistent/disk", images / "val");
    for (const fs::path& path : {srn.path(), co3d.path(), images.path()}) {
        bool lacks = false;
        DatasetDesc desc = data_desc(path, "val");
        desc.lacks_split = &lacks;
        EXPECT_ERROR(Dataset::open(desc), Code::kFormat, "is a link to what does not exist");
        EXPECT_FALSE(lacks);
    }
    fs::remove(images / "val");
    fs::create_directory(images / "val");
    fs::create_symlink("/nonexistent/object", images / "val/b");
    EXPECT_ERROR(Dataset::open(data_desc(images.path(), "val")), Code::kFormat,
                 "val/b' is a link to what does not exist");
    const SampleFolder nmr;
    put_nmr_objects(nmr.path());
    put_text(nmr / "02828884/softras_train.lst", "\n");
    EXPECT_ERROR(data_status(nmr.path()), Code::kFormat, "names no object");
}

TEST(MissingObjects, OtherFoldersAreNamed) {
    for (const Case& c : cases()) {
        SCOPED_TRACE(c.format);
        const bool listed = std::string(c.format) == "nmr";
        const SampleFolder folder;
        c.put(folder.path());
        put_text(folder / (listed ? "" : c.objects) / "aa/notes.txt", "not an object");
        const LogCapture log;
        const auto dataset = need(Dataset::open(desc_of(c, folder)));
        EXPECT_EQ(dataset->index().names.size(), kObjects);
        const std::string other = std::string(c.format) == "disn" ? "03001627_aa" : "aa";
        EXPECT_EQ(dataset->index().others, std::vector<std::string>{other});
        EXPECT_HAS(log.text(),
                   "1 folders without a part of an object are not read: '" + other + "'");
    }
}

/// Objaverse's split is a share of what is listed: a link that leads nowhere keeps its place.
TEST(MissingObjects, DoNotMoveTheSplit) {
    const SampleFolder folder;
    put_objaverse(folder.path());
    fs::remove_all(folder / "a");
    SPLAT_NEED_LINKS(folder.path().string());
    fs::create_symlink("/nonexistent/elsewhere", folder / "a");
    DatasetDesc desc = data_desc(folder.path(), "val");
    desc.allow_missing = true;
    EXPECT_EQ(open_data(desc)->index().names, std::vector<std::string>{"d"});
    desc.split = "train";
    EXPECT_EQ(open_data(desc)->index().names, (std::vector<std::string>{"b", "c"}));
}

TEST(MissingObjects, ACategoryWithoutTheListOfOthersIsOne) {
    const SampleFolder folder;
    put_nmr_objects(folder.path());
    put_text(folder / "02828884/softras_val.lst", "x\n");
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat,
                 "02828884/softras_train.lst', which other categories have");
    EXPECT_FALSE(Dataset::open(data_desc(folder.path(), "test")).ok());
}

/// What a run gets of a data set: its objects, with the sum of their images and poses. Those that are left out
/// and named count as they are in `whole`.
Result<std::map<std::string, std::string>> everything(
    const DatasetDesc& desc, const std::map<std::string, std::string>& whole = {}) {
    SPLAT_ASSIGN(const auto dataset, Dataset::open(desc));
    const DatasetIndex& index = dataset->index();
    std::map<std::string, std::string> objects = {{"maps", std::to_string(index.maps)}};
    for (const auto& [name, problem] : index.missing) objects[name] = whole.at(name);
    for (std::uint32_t object = 0; object < index.names.size(); ++object) {
        const std::vector<std::uint32_t> views = {0, 1};
        const std::size_t area = std::size_t{dataset->resolution()} * dataset->resolution();
        std::vector<float> images(2 * 3 * area), poses(2 * 16);
        SPLAT_TRY(
            dataset->read(object, views, {.images = images.data(), .view_to_world = poses.data()}));
        double sum = 0;
        for (const float value : images) sum += static_cast<double>(value);
        for (const float value : poses) sum += static_cast<double>(value);
        objects[index.names[object]] = format("%.17g", sum);
    }
    return objects;
}

#if SPLAT_FAULT_POINTS
/// Each listing, look and opening is refused once, and from then on: an error, or all of the data.
TEST(MissingObjects, NoRefusalOfTheSystemTakesAnyAway) {
    std::size_t places = 0, errors = 0;
    for (const Case& c : cases()) {
        const SampleFolder folder;
        c.put(folder.path());
        for (const bool allowed : {false, true}) {
            DatasetDesc desc = desc_of(c, folder);
            desc.allow_missing = allowed;
            fault::arm(nullptr, fault::kForever);
            const auto whole = need(everything(desc));
            const std::uint64_t hits = fault::disarm();
            ASSERT_GT(hits, 20U);
            for (const std::uint64_t count : {std::uint64_t{1}, fault::kForever})
                for (std::uint64_t hit = 1; hit <= hits; ++hit, ++places) {
                    fault::arm(nullptr, hit, count);
                    const auto found = everything(desc, whole);
                    fault::disarm();
                    errors += found.ok() ? 0 : 1;
                    EXPECT_EQ(found.ok() ? found.value() : whole, whole)
                        << c.format << ", place " << hit << " of " << hits << ", allowed "
                        << allowed << ", times " << count;
                }
        }
    }
    std::printf("%zu refusals, %zu of them errors\n", places, errors);
    EXPECT_GT(errors, places / 2);
}
#endif

}  // namespace
}  // namespace splat::data
