#include "data/view_vectors.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "support/expect_status.h"

namespace splat::test {
namespace {

using data::ViewVectors;

io::NamedTensor tensor(const std::string& name, std::vector<std::int64_t> dims,
                       const std::vector<float>& values) {
    io::NamedTensor made{.name = name, .dims = std::move(dims), .values = values};
    return made;
}

class ViewVectorsTest : public testing::Test {
  protected:
    ViewVectorsTest() {
        index_.split = "val";
        index_.names = {"a", "b"};
        index_.views_of = {2, 3};
        std::filesystem::create_directories(folder_);
    }

    /// One object's array differs from the good ones on request.
    std::string write(const std::string& name, io::NamedTensor of_b, io::NamedTensor other) {
        io::WeightsFile file;
        EXPECT_OK(file.tensors.add(tensor("a", {2, 2}, {1, 2, 3, 4})));
        EXPECT_OK(file.tensors.add(std::move(of_b)));
        EXPECT_OK(file.tensors.add(std::move(other)));
        const std::string path = folder_ + "/" + name;
        EXPECT_OK(io::save_weights(file, path));
        return path;
    }

    std::string write(const std::string& name, io::NamedTensor of_b) {
        return write(name, std::move(of_b), tensor("train/b", {1}, {0}));
    }

    Status load(const std::string& path) {
        return ViewVectors::load(path, {2}, index_, "data.embedding_file").status();
    }

    ~ViewVectorsTest() override { std::filesystem::remove_all(folder_); }

    const std::string folder_ = testing::TempDir() + "/view_vectors";
    data::DatasetIndex index_;
};

TEST_F(ViewVectorsTest, RowsOfViewsInTheirOrder) {
    for (const char* name : {"v.safetensors", "v.npz"}) {
        const auto path = write(name, tensor("b", {3, 2}, {5, 6, 7, 8, 9, 10}));
        const auto vectors = need(ViewVectors::load(path, {2}, index_, "data.embedding_file"));
        std::vector<float> rows;
        const std::uint32_t views[] = {2, 0};
        vectors.append(1, views, rows);
        vectors.append(0, std::span(views).subspan(1), rows);
        EXPECT_EQ(rows, (std::vector<float>{9, 10, 5, 6, 1, 2}));
    }
}

/// Splits may have objects of the same name.
TEST_F(ViewVectorsTest, TheArrayOfTheSplitComesFirst) {
    const auto path =
        write("v.npz", tensor("b", {1}, {0}), tensor("val/b", {3, 2}, {1, 2, 3, 4, 5, 6}));
    const auto vectors = need(ViewVectors::load(path, {2}, index_, "data.embedding_file"));
    std::vector<float> rows;
    const std::uint32_t views[] = {1};
    vectors.append(1, views, rows);
    EXPECT_EQ(rows, (std::vector<float>{3, 4}));
}

TEST_F(ViewVectorsTest, WhatDoesNotFitIsNamed) {
    EXPECT_ERROR(load(write("1.npz", tensor("c", {3, 2}, {5, 6, 7, 8, 9, 10}))), Code::kNotFound,
                 "has no array 'val/b' or 'b'");
    EXPECT_ERROR(load(write("2.npz", tensor("b", {2, 2}, {5, 6, 7, 8}))), Code::kShape,
                 "'b' has the shape [2, 2], expected [3, 2]");
    const float bad = std::numeric_limits<float>::quiet_NaN();
    EXPECT_ERROR(load(write("3.npz", tensor("b", {3, 2}, {5, bad, 7, 8, 9, 10}))),
                 Code::kInvalidArgument, "data.embedding_file");
    EXPECT_FALSE(load(folder_ + "/missing.npz").ok());
}

}  // namespace
}  // namespace splat::test
