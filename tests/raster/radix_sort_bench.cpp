// radix_sort_bench [pairs] [rounds]: times the sort of pairs of a random 32-bit key and its
// position, alternating with a least-significant-digit radix sort on one host thread. Prints the
// minimum and the median of both in ms, and the times of the shaders.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "raster/radix_sort.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

struct Pair {
    std::uint32_t key, value;

    bool operator==(const Pair&) const = default;
};

/// Four passes of 8 bits, in plain host code.
void host_sort(const std::vector<Pair>& input, std::vector<Pair>& pairs, std::vector<Pair>& other) {
    pairs = input;
    for (int shift = 0; shift < 32; shift += 8) {
        std::array<std::size_t, 257> begin{};
        for (const Pair& pair : pairs) ++begin[(pair.key >> shift & 255) + 1];
        for (std::size_t bin = 0; bin < 256; ++bin) begin[bin + 1] += begin[bin];
        for (const Pair& pair : pairs) other[begin[pair.key >> shift & 255]++] = pair;
        std::swap(pairs, other);
    }
}

template <class Body>
double milliseconds(Body body) {
    const auto start = std::chrono::steady_clock::now();
    body();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

void print(const char* what, std::vector<double> times) {
    std::sort(times.begin(), times.end());
    std::printf("%-8s min %7.2f ms, median %7.2f ms\n", what, times[0], times[times.size() / 2]);
}

int bench(std::uint32_t count, int rounds) {
    vk::ContextDesc context_desc;
    context_desc.profile = true;
    auto made = vk::Context::create(context_desc);
    if (!made.ok()) {
        std::fprintf(stderr, "%s\n", made.status().message().c_str());
        return 1;
    }
    vk::Context& context = *made.value();
    std::vector<Pair> input_pairs(count);
    Rng rng(1);
    for (std::uint32_t i = 0; i < count; ++i)
        input_pairs[i] = {static_cast<std::uint32_t>(rng.below(0xFFFFFFFFU)), i};
    raster::RadixSortDesc desc;
    desc.capacity = count;
    vk::Recorder recorder(context);
    const vk::Buffer input = device_buffer(context, 2 * std::size_t{count});
    const vk::Buffer sides[2] = {device_buffer(context, 2 * std::size_t{count}),
                                 device_buffer(context, 2 * std::size_t{count})};
    const vk::Buffer kept = device_buffer(context, 1);
    const vk::Buffer entries = upload(context, std::vector<std::uint32_t>{count});
    const auto space = raster::allocate_radix_sort(context, desc);
    if (!space.ok() || !context.write(input.range(), input_pairs.data(), sizeof(Pair) * count).ok())
        return 1;
    const Status status = raster::radix_sort(
        recorder, desc,
        {input.range(), {sides[0].range(), sides[1].range()}, {}, entries.range(), kept.range()},
        space.value());
    auto list = recorder.finish();
    if (!status.ok() || !list.ok()) {
        std::fprintf(stderr, "%s %s\n", status.message().c_str(), list.status().message().c_str());
        return 1;
    }
    std::vector<double> host, device;
    std::vector<Pair> pairs(count), other(count);
    for (int round = -1; round < rounds; ++round) {
        if (round == 0) context.profile()->reset();
        Status ran;
        const double time = milliseconds([&] { ran = context.run(list.value()); });
        if (!ran.ok()) return 1;
        const double peer = milliseconds([&] { host_sort(input_pairs, pairs, other); });
        if (round < 0) continue;
        device.push_back(time);
        host.push_back(peer);
    }
    std::vector<Pair> got(count);
    const vk::BufferView result = sides[raster::radix_sort_side(recorder, desc)].range();
    if (!context.read(result, got.data(), sizeof(Pair) * count).ok()) return 1;
    const bool same = got == pairs;
    std::printf("%u pairs, %d rounds, %s\n", count, rounds, same ? "same order" : "ANOTHER ORDER");
    print("device", device);
    print("host", host);
    std::printf("%s", context.profile()->table("").c_str());
    return same ? 0 : 1;
}

}  // namespace
}  // namespace splat::test

int main(int argc, char** argv) {
    const int count = argc > 1 ? std::atoi(argv[1]) : 1000000;
    const int rounds = argc > 2 ? std::atoi(argv[2]) : 15;
    if (count < 1 || rounds < 1) return 2;
    return splat::test::bench(static_cast<std::uint32_t>(count), rounds);
}
