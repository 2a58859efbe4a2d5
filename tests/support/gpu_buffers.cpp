#include "support/gpu_buffers.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

namespace splat::test {
namespace {

template <class T>
vk::Buffer upload_words(vk::Context& context, const std::vector<T>& values) {
    vk::Buffer buffer = device_buffer(context, values.size());
    const Status status = context.write(buffer.range(), values.data(), values.size() * sizeof(T));
    EXPECT_TRUE(status.ok()) << status.message();
    return buffer;
}

template <class T>
std::vector<T> download_as(vk::Context& context, const vk::BufferView& view, std::size_t elements) {
    std::vector<T> values(elements);
    const Status status = context.read(view, values.data(), elements * sizeof(T));
    EXPECT_TRUE(status.ok()) << status.message();
    return values;
}

}  // namespace

vk::Buffer device_buffer(vk::Context& context, std::size_t elements) {
    auto buffer = context.memory().allocate(elements * 4, vk::MemoryKind::kDevice, "test buffer");
    if (!buffer.ok()) {
        std::fprintf(stderr, "no memory for a test buffer: %s\n",
                     buffer.status().message().c_str());
        std::abort();
    }
    return std::move(buffer.value());
}

vk::Buffer upload(vk::Context& context, const std::vector<float>& values) {
    return upload_words(context, values);
}

vk::Buffer upload(vk::Context& context, const std::vector<std::uint32_t>& values) {
    return upload_words(context, values);
}

std::vector<float> download(vk::Context& context, const vk::BufferView& view,
                            std::size_t elements) {
    return download_as<float>(context, view, elements);
}

std::vector<std::uint32_t> download_words(vk::Context& context, const vk::BufferView& view,
                                          std::size_t elements) {
    return download_as<std::uint32_t>(context, view, elements);
}

}  // namespace splat::test
