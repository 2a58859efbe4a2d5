#include "synthetic/sample_folder.h"

#include <atomic>
#include <fstream>
#include <iterator>

#include "io/file.h"
#include "io/image.h"
#include "support/expect_status.h"
#include "support/system.h"

namespace splat::test {

namespace fs = std::filesystem;

SampleFolder::SampleFolder() {
    static std::atomic<int> counter{0};
    path_ = fs::temp_directory_path() /
            ("splat-data-" + test::process_text() + "-" + std::to_string(counter++));
    fs::create_directories(path_);
}

SampleFolder::~SampleFolder() {
    std::error_code code;
    fs::remove_all(path_, code);
}

void put_text(const fs::path& path, const std::string& text) {
    fs::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << text;
}

void put_png(const fs::path& path, const io::Image& image) {
    fs::create_directories(path.parent_path());
    ASSERT_OK(io::write_file(path.string(), need(io::write_png(image))));
}

void put_image(const fs::path& path, std::uint32_t size, std::uint32_t channels,
               std::uint32_t first, std::uint8_t alpha) {
    io::Image image{size, size, channels, 8, {}};
    for (std::uint32_t y = 0; y < size; ++y)
        for (std::uint32_t x = 0; x < size; ++x)
            for (std::uint32_t c = 0; c < channels; ++c)
                image.samples.push_back(
                    c == 3 ? alpha
                           : static_cast<std::uint16_t>((16 * y + 4 * x + c + first) % 256));
    put_png(path, image);
}

std::string file_text(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

synthetic::WriterDesc sample_cars(const fs::path& path) {
    synthetic::WriterDesc desc;
    desc.path = path.string();
    desc.seed = 5;
    desc.resolution = 16;
    desc.train_views = 3;
    desc.test_views = 4;
    desc.train_objects = 2;
    desc.val_objects = 1;
    desc.test_objects = 1;
    return desc;
}

void write_all(const synthetic::WriterDesc& desc) {
    const std::uint32_t count = desc.train_objects + desc.val_objects + desc.test_objects;
    for (std::uint32_t i = 0; i < count; ++i) ASSERT_OK(synthetic::write_object(desc, i));
}

void put_planes(const fs::path& root) {
    std::vector<fs::path> images;
    for (const auto& entry : fs::recursive_directory_iterator(root))
        if (entry.path().parent_path().filename() == "rgb") images.push_back(entry.path());
    for (const fs::path& image : images) {
        const int view = std::stoi(image.stem().string());
        io::Image map{16, 16, 4, 8, {}};
        for (int i = 0; i < 256; ++i)
            for (const int number : {20 * ((i / 64 + view) % 4), 128, 128, 100 + view})
                map.samples.push_back(static_cast<std::uint16_t>(number));
        put_png(image.parent_path().parent_path() / "plane" / image.filename(), map);
    }
}

}  // namespace splat::test
