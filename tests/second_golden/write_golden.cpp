// Writes a second set of golden files, of other shapes than tests/golden/net, with the float64
// references of tests/ref: write_golden FOLDER makes FOLDER/net/*.npz. SPLAT_GOLDEN_DIR=FOLDER runs the
// golden tests on them.
#include <cstdio>
#include <filesystem>

#include "second_golden/layer_files.h"

int main(int argc, char** argv) {
    using namespace splat;
    if (argc != 2) {
        std::fprintf(stderr, "usage: write_golden FOLDER\n");
        return 2;
    }
    const std::string folder = std::string(argv[1]) + "/net/";
    std::error_code failed;
    std::filesystem::create_directories(folder, failed);
    const std::pair<const char*, golden::Arrays (*)()> files[] = {{"conv", golden::conv_file},
                                                                  {"norm", golden::norm_file},
                                                                  {"block", golden::block_file},
                                                                  {"lora", golden::lora_file},
                                                                  {"graft", golden::graft_file}};
    for (const auto& [name, arrays] : files) {
        const std::string path = folder + name + ".npz";
        if (const Status status = test::write_npz(path, arrays()); !status.ok()) {
            std::fprintf(stderr, "%s\n", status.message().c_str());
            return 1;
        }
        std::printf("%s\n", path.c_str());
    }
    return 0;
}
