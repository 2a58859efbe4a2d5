#include "vkrun/data/mesh_list.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "vkrun/cli/failure.h"
#include "vkrun/cli/temporary_folder.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;

void put(const fs::path& path) {
    fs::create_directories(path.parent_path());
    std::ofstream(path) << "v 0 0 0\n";
}

std::vector<std::string> names_in(const std::vector<std::string>& from) {
    std::vector<std::string> names;
    for (const MeshFile& mesh : find_meshes(from)) names.push_back(mesh.name);
    return names;
}

std::string sentence_of(const std::vector<std::string>& from) {
    try {
        find_meshes(from);
    } catch (const Failure& failure) {
        return failure.what();
    }
    return "no failure";
}

/// Meshes of the names "0", "1", ... dealt by shares.
std::map<std::string, std::size_t> dealt(std::size_t count, const std::array<double, 3>& shares) {
    std::vector<MeshFile> meshes;
    for (std::size_t i = 0; i < count; ++i) meshes.push_back({"", std::to_string(i), ""});
    deal_meshes(meshes, shares, 0);
    std::map<std::string, std::size_t> counts;
    for (const MeshFile& mesh : meshes) ++counts[mesh.split];
    return counts;
}

using Counts = std::map<std::string, std::size_t>;

TEST(MeshList, FoldersAreSearchedAndSorted) {
    const TemporaryFolder folder;
    const fs::path root(folder.path());
    for (const char* name : {"b.glb", "a.obj", "below/c.GLTF", "a.mtl", ".hidden/d.obj", "e.png"})
        put(root / name);
    EXPECT_EQ(names_in({root.string()}), (std::vector<std::string>{"a", "b", "c"}));
    EXPECT_EQ(names_in({(root / "b.glb").string(), (root / "b.glb").string()}),
              (std::vector<std::string>{"b"}));
}

TEST(MeshList, FilesThatSayNothingHaveTheNamesOfTheirFolders) {
    const TemporaryFolder folder;
    const fs::path root(folder.path());
    for (const char* name :
         {"02958343/1a2b/models/model_normalized.obj", "v1/3c4d/model.obj", "chair/scene.gltf"})
        put(root / name);
    EXPECT_EQ(names_in({root.string()}), (std::vector<std::string>{"1a2b", "3c4d", "chair"}));
}

TEST(MeshList, TwoMeshesOfOneNameAreRefused) {
    const TemporaryFolder folder;
    const fs::path root(folder.path());
    put(root / "obj/a.obj");
    put(root / "glb/a.glb");
    EXPECT_NE(sentence_of({root.string()}).find("would both be the object 'a'"), std::string::npos);
    EXPECT_NE(sentence_of({(root / "none").string()}).find("there is no"), std::string::npos);
    put(root / "a.mtl");
    EXPECT_NE(sentence_of({(root / "a.mtl").string()}).find("is no mesh"), std::string::npos);
}

TEST(MeshList, SharesAreKeptAndFewMeshesGoToTrainFirst) {
    EXPECT_EQ(dealt(100, {0.8, 0.1, 0.1}), (Counts{{"train", 80}, {"val", 10}, {"test", 10}}));
    EXPECT_EQ(dealt(10, {8, 1, 1}), (Counts{{"train", 8}, {"val", 1}, {"test", 1}}));
    EXPECT_EQ(dealt(4, {0.8, 0.1, 0.1}), (Counts{{"train", 2}, {"val", 1}, {"test", 1}}));
    EXPECT_EQ(dealt(2, {0.8, 0.1, 0.1}), (Counts{{"train", 1}, {"val", 1}}));
    EXPECT_EQ(dealt(1, {0.8, 0.1, 0.1}), (Counts{{"train", 1}}));
    EXPECT_EQ(dealt(7, {0, 0, 1}), (Counts{{"test", 7}}));
    EXPECT_EQ(dealt(3, {1, 1, 1}), (Counts{{"train", 1}, {"val", 1}, {"test", 1}}));
}

TEST(MeshList, NamesAndSeedDecideTheSplitsAndNotTheOrder) {
    std::vector<MeshFile> meshes, turned;
    for (int i = 0; i < 50; ++i) meshes.push_back({"", "mesh" + std::to_string(i), ""});
    turned.assign(meshes.rbegin(), meshes.rend());
    std::vector<MeshFile> seeded = meshes;
    deal_meshes(meshes, {1, 1, 1}, 3);
    deal_meshes(turned, {1, 1, 1}, 3);
    deal_meshes(seeded, {1, 1, 1}, 4);
    int others = 0;
    for (std::size_t i = 0; i < 50; ++i) {
        EXPECT_EQ(meshes[i].split, turned[49 - i].split);
        others += meshes[i].split != seeded[i].split ? 1 : 0;
    }
    EXPECT_GT(others, 10);
}

}  // namespace
}  // namespace vkrun
