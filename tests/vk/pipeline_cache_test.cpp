#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/system.h"
#include "test_shaders.h"
#include "vk/pipeline_cache_file.h"

namespace splat::vk {
namespace {

namespace fs = std::filesystem;

std::string contents(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void replace(const fs::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << text;
}

class PipelineCache : public testing::Test {
  protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("splat_cache_" + test::process_text());
        fs::remove_all(folder_);
    }
    void TearDown() override {
        std::error_code ignored;
        fs::permissions(folder_, fs::perms::owner_all, ignored);
        fs::remove_all(folder_);
    }

    /// Open a device with this folder, make a pipeline, close it. True if the file was used.
    bool session(const fs::path& folder) {
        ContextDesc desc = test::context_desc();
        desc.cache_folder = folder.string();
        const auto context = test::make_context(desc);
        if (context == nullptr) return false;
        file_ = context->pipelines().cache_file();
        const auto pipeline =
            context->pipelines().get("test_scale", {{params::kWorkgroupSizeId, 64}});
        EXPECT_TRUE(pipeline.ok()) << pipeline.status().message();
        EXPECT_OK(context->pipelines().wait(*pipeline.value()));
        return context->pipelines().cache_file_was_used();
    }

    fs::path folder_;
    std::string file_;
};

TEST_F(PipelineCache, IsWrittenAndReused) {
    EXPECT_FALSE(session(folder_ / "a" / "b"));
    ASSERT_TRUE(fs::exists(file_)) << "folders are created on the way";
    EXPECT_TRUE(session(folder_ / "a" / "b"));
    std::size_t files = 0;
    for (const auto& entry : fs::directory_iterator(folder_ / "a" / "b")) {
        static_cast<void>(entry);
        ++files;
    }
    EXPECT_EQ(files, 1U) << "no temporary file is left";
}

TEST_F(PipelineCache, IsWrittenBeforeTheFirstRunOfAList) {
    ContextDesc desc = test::context_desc();
    desc.cache_folder = folder_.string();
    const auto context = test::make_context(desc);
    const Buffer x = test::upload(*context, std::vector<float>(64, 1));
    const Buffer y = test::device_buffer(*context, 64);
    const std::string& file = context->pipelines().cache_file();
    CommandList list = test::record(*context, {test::scale(x.range(), y.range(), 64, 2)});
    ASSERT_OK(context->make_ready(list));
    ASSERT_TRUE(fs::exists(file));
    fs::remove(file);
    ASSERT_OK(context->run(list));
    EXPECT_FALSE(fs::exists(file)) << "nothing was added";
    CommandList other = test::record(*context, {test::scale(x.range(), y.range(), 64, 2, 1)});
    ASSERT_OK(context->run(other));
    EXPECT_TRUE(fs::exists(file));
}

TEST_F(PipelineCache, NoFolderNoFile) {
    EXPECT_FALSE(session(""));
    EXPECT_EQ(file_, "");
}

TEST_F(PipelineCache, CorruptFileIsIgnoredAndRewritten) {
    session(folder_);
    const std::string good = contents(file_);
    ASSERT_GT(good.size(), 40U);
    std::string flipped = good;
    flipped[good.size() / 2] = static_cast<char>(flipped[good.size() / 2] ^ 1);
    std::string wrong_size = good;
    wrong_size[39] = '\x7F';
    for (const std::string& bad :
         {std::string(), std::string("x"), good.substr(0, 39), good.substr(0, good.size() - 1),
          good + "x", flipped, wrong_size, std::string(good.size(), '\0')}) {
        replace(file_, bad);
        EXPECT_FALSE(session(folder_)) << bad.size();
        EXPECT_TRUE(session(folder_)) << "not rewritten after " << bad.size() << " bytes";
    }
}

TEST_F(PipelineCache, FileOfAnotherDriverIsIgnoredAndRewritten) {
    session(folder_);
    std::string foreign = contents(file_);
    foreign[8] = static_cast<char>(foreign[8] ^ 1);  // pipelineCacheUUID
    replace(file_, foreign);
    EXPECT_FALSE(session(folder_));
    std::string older = contents(file_);
    older[24] = static_cast<char>(older[24] ^ 1);  // driver version
    replace(file_, older);
    EXPECT_FALSE(session(folder_));
    EXPECT_TRUE(session(folder_));
}

TEST_F(PipelineCache, UnwritableFolderIsNoError) {
    EXPECT_FALSE(session("/proc/splat/no/such/folder"));
    fs::create_directories(folder_);
    replace(folder_ / "file", "x");
    EXPECT_FALSE(session(folder_ / "file" / "below"));
    session(folder_);
    const std::string path = file_;
    fs::remove(path);
    fs::create_directory(path);  // the name is taken by a folder
    EXPECT_FALSE(session(folder_));
    EXPECT_TRUE(fs::is_directory(path));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 2) << "a temporary file is left";
}

TEST_F(PipelineCache, FileRoundTrips) {
    DeviceInfo info;
    info.cache_uuid.fill(7);
    info.driver_version = 9;
    const std::vector<std::byte> data(1000, std::byte{3});
    const std::string path = pipeline_cache_path(folder_.string(), info);
    EXPECT_TRUE(write_pipeline_cache(path, info, data));
    EXPECT_EQ(read_pipeline_cache(path, info), data);
    info.driver_version = 10;
    EXPECT_EQ(read_pipeline_cache(path, info), std::nullopt);
}

TEST_F(PipelineCache, EachDeviceOfADriverHasItsFile) {
    DeviceInfo info;
    info.cache_uuid.fill(7);
    info.vendor_id = 0x10de;
    info.device_id = 0x2330;
    const std::string path = pipeline_cache_path("f", info);
    EXPECT_EQ(path, "f/pipelines-10de-2330-07070707070707070707070707070707.bin");
    info.device_id = 0x2331;
    EXPECT_NE(pipeline_cache_path("f", info), path);
}

TEST_F(PipelineCache, AFifoIsNoFile) {
    fs::create_directories(folder_);
    const std::string path = pipeline_cache_path(folder_.string(), DeviceInfo());
    SPLAT_NEED_FIFO(path);
    EXPECT_EQ(read_pipeline_cache(path, DeviceInfo()), std::nullopt);
}

/// Processes of two containers, like these threads, may have the same number.
TEST_F(PipelineCache, WritersOfAColdCacheDoNotMix) {
    const std::string path = pipeline_cache_path(folder_.string(), DeviceInfo());
    std::atomic<int> failed{0};
    const auto write = [&](std::size_t bytes) {
        const std::vector<std::byte> data(bytes, std::byte{1});
        for (int i = 0; i < 200; ++i)
            if (!write_pipeline_cache(path, DeviceInfo(), data)) ++failed;
    };
    std::thread other(write, 100'000);
    write(300'000);
    other.join();
    EXPECT_EQ(failed, 0);
    const auto read = read_pipeline_cache(path, DeviceInfo());
    ASSERT_TRUE(read.has_value());
    EXPECT_TRUE(read->size() == 100'000 || read->size() == 300'000);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1) << "a temporary file is left";
}

}  // namespace
}  // namespace splat::vk
