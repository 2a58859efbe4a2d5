#pragma once

#include <array>
#include <cstdlib>
#include <span>

#include "io/bytes.h"
#include "io/scene_load.h"
#include "scene/arrays.h"

namespace splat::fuzz {

/// libFuzzer counts an abort as a crash.
inline void require(bool condition) {
    if (!condition) std::abort();
}

/// True if it was accepted. What is refused is not of the format, or beyond what is read: the input is a file,
/// not an argument.
inline bool accepted(const Status& status) {
    require(status.ok() || status.code() == Code::kFormat || status.code() == Code::kUnsupported);
    return status.ok();
}

/// A limit for scenes of fuzzed files, so that no input can request much memory.
inline io::LoadOptions small_scenes() {
    io::LoadOptions options;
    options.max_count = 4096;
    return options;
}

/// Properties of every accepted scene.
inline void check_scene(const io::LoadedScene& loaded) {
    require(scene::check_arrays(loaded.gaussians).ok());
    require(loaded.report.count == loaded.gaussians.count());
    require(loaded.report.sh_degree == loaded.gaussians.sh_degree);
}

/// An input of several files: each but the last is preceded by its length (32 bits), and may be cut.
template <std::size_t Count>
std::array<io::Bytes, Count> files_of(io::Bytes input) {
    std::array<io::Bytes, Count> files;
    for (std::size_t i = 0; i + 1 < Count && input.size() >= 4; ++i) {
        const auto bytes = io::number<std::uint32_t>(input.data());
        input = input.subspan(4);
        files[i] = input.first(std::min<std::size_t>(bytes, input.size()));
        input = input.subspan(files[i].size());
    }
    files[Count - 1] = input;
    return files;
}

}  // namespace splat::fuzz

/// The entry that libFuzzer and regression_main.cpp call; the body of a function of the input follows.
#define SPLAT_FUZZ_TARGET(input)                                                        \
    static void check(input);                                                           \
    extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);  \
    extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) { \
        check(std::as_bytes(std::span(data, size)));                                    \
        return 0;                                                                       \
    }                                                                                   \
    static void check(input)
