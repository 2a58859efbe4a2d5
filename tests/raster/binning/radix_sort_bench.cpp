// radix_sort_bench [pairs] [rounds]: times the sort of pairs of a random 32-bit key and its
// position, alternating with a least-significant-digit radix sort on one host thread. Prints the
// minimum and the median of both in ms, and the times of the shaders.
//
// radix_sort_bench --json [items...]: times it alone, by 32 and by 16 bits, with keys below 2^bits.
// Prints {device, kernels, results: [{items, bits, min_ms, median_ms, items_per_s}]} like
// tools/bench/cub_sort.cu: times on the device from the first command to the end of the last,
// items_per_s of the shortest. A size that fails, or for which the device has no room, is not among
// the results; the reason goes to standard error, and the exit status is 1.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "raster/radix_sort.h"
#include "support/gpu_buffers.h"
#include "support/parsed_json.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

struct Pair {
    std::uint32_t key, value;

    bool operator==(const Pair&) const = default;
};

std::vector<Pair> random_pairs(std::uint32_t count, int bits = 32) {
    std::vector<Pair> pairs(count);
    Rng rng(1);
    for (std::uint32_t i = 0; i < count; ++i)
        pairs[i] = {static_cast<std::uint32_t>(rng.below(0xFFFFFFFFU)) >> (32 - bits), i};
    return pairs;
}

/// Passes of 8 bits, in plain host code.
void host_sort(const std::vector<Pair>& input, std::vector<Pair>& pairs, std::vector<Pair>& other,
               int bits = 32) {
    pairs = input;
    for (int shift = 0; shift < bits; shift += 8) {
        std::array<std::size_t, 257> begin{};
        for (const Pair& pair : pairs) ++begin[(pair.key >> shift & 255) + 1];
        for (std::size_t bin = 0; bin < 256; ++bin) begin[bin + 1] += begin[bin];
        for (const Pair& pair : pairs) other[begin[pair.key >> shift & 255]++] = pair;
        std::swap(pairs, other);
    }
}

/// The sort with its memory and its list of commands.
class DeviceSort {
  public:
    DeviceSort(vk::Context& context, const std::vector<Pair>& pairs, std::uint32_t bits)
        : context_(context),
          input_(device_buffer(context, 2 * raster::radix_sort_entries(pairs.size()))),
          sides_{device_buffer(context, 2 * raster::radix_sort_entries(pairs.size())),
                 device_buffer(context, 2 * raster::radix_sort_entries(pairs.size()))},
          kept_(device_buffer(context, 1)),
          entries_(upload(context,
                          std::vector<std::uint32_t>{static_cast<std::uint32_t>(pairs.size())})) {
        desc_.capacity = static_cast<std::uint32_t>(pairs.size());
        desc_.key_bits = bits;
    }

    Status prepare(const std::vector<Pair>& pairs) {
        SPLAT_TRY(context_.write(input_.range(), pairs.data(), sizeof(Pair) * pairs.size()));
        SPLAT_ASSIGN(space_, raster::allocate_radix_sort(context_, desc_));
        vk::Recorder recorder(context_);
        side_ = raster::radix_sort_side(recorder, desc_);
        SPLAT_TRY(raster::radix_sort(recorder, desc_,
                                     {input_.range(),
                                      {sides_[0].range(), sides_[1].range()},
                                      {},
                                      entries_.range(),
                                      kept_.range()},
                                     space_));
        SPLAT_ASSIGN(list_, recorder.finish());
        return {};
    }

    Status run() { return context_.run(list_); }

    Status read(std::vector<Pair>& pairs) {
        return context_.read(sides_[side_].range(), pairs.data(), sizeof(Pair) * pairs.size());
    }

  private:
    vk::Context& context_;
    vk::Buffer input_;
    std::array<vk::Buffer, 2> sides_;
    vk::Buffer kept_, entries_;
    raster::RadixSortDesc desc_;
    raster::RadixSortWorkspace space_;
    vk::CommandList list_;
    std::uint32_t side_ = 0;
};

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

std::shared_ptr<vk::Context> profiled_context() {
    vk::ContextDesc desc;
    desc.profile = true;
    auto made = vk::Context::create(desc);
    if (!made.ok()) std::fprintf(stderr, "%s\n", made.status().message().c_str());
    return made.ok() ? std::move(made.value()) : nullptr;
}

int bench(std::uint32_t count, int rounds) {
    const auto context = profiled_context();
    if (context == nullptr) return 1;
    const std::vector<Pair> input = random_pairs(count);
    DeviceSort sort(*context, input, 32);
    const Status status = sort.prepare(input);
    if (!status.ok()) {
        std::fprintf(stderr, "%s\n", status.message().c_str());
        return 1;
    }
    std::vector<double> host, device;
    std::vector<Pair> pairs(count), other(count);
    for (int round = -1; round < rounds; ++round) {
        if (round == 0) context->profile()->reset();
        Status ran;
        const double time = milliseconds([&] { ran = sort.run(); });
        if (!ran.ok()) return 1;
        const double peer = milliseconds([&] { host_sort(input, pairs, other); });
        if (round < 0) continue;
        device.push_back(time);
        host.push_back(peer);
    }
    std::vector<Pair> got(count);
    if (!sort.read(got).ok()) return 1;
    const bool same = got == pairs;
    std::printf("%u pairs, %d rounds, %s\n", count, rounds, same ? "same order" : "ANOTHER ORDER");
    print("device", device);
    print("host", host);
    std::printf("%s", context->profile()->table("").c_str());
    return same ? 0 : 1;
}

/// From the first command of the only run in the profile to the end of the last.
double device_ms(const vk::Profile& profile) {
    return parse_json(profile.json(""), "profile").value().at("lists").at("device_ms");
}

/// At least 10 runs, and as many as half a second on the device allows, after three others.
Status time_sort(vk::Context& context, DeviceSort& sort, std::vector<double>& times) {
    double total = 0;
    for (int run = -3; run < 10 || (total < 500 && run < 2000); ++run) {
        context.profile()->reset();
        SPLAT_TRY(sort.run());
        if (run < 0) continue;
        times.push_back(device_ms(*context.profile()));
        total += times.back();
    }
    std::sort(times.begin(), times.end());
    return {};
}

Status bench_size(vk::Context& context, std::uint32_t items, int bits, Json& results) {
    if (8 * std::uint64_t{items} > context.device().info().limits.max_storage_buffer_bytes)
        return error(Code::kUnsupported, "an array of this size exceeds the device's bindings");
    const std::vector<Pair> input = random_pairs(items, bits);
    std::vector<Pair> got(items), expected(items), other(items);
    std::vector<double> times;
    DeviceSort sort(context, input, static_cast<std::uint32_t>(bits));
    SPLAT_TRY(sort.prepare(input));
    SPLAT_TRY(time_sort(context, sort, times));
    SPLAT_TRY(sort.read(got));
    host_sort(input, expected, other, bits);
    if (got != expected) return error(Code::kInternal, "the order is wrong");
    results.push_back({{"items", items},
                       {"bits", bits},
                       {"min_ms", times.front()},
                       {"median_ms", times[times.size() / 2]},
                       {"items_per_s", items / (times.front() * 1e-3)}});
    return {};
}

int bench_sizes(const std::vector<std::uint32_t>& sizes) {
    const auto context = profiled_context();
    if (context == nullptr) return 1;
    if (context->device().info().limits.timestamp_ns <= 0) {
        std::fprintf(stderr, "radix_sort_bench: this device has no timestamps\n");
        return 1;
    }
    Json json;
    json["device"] = context->device().info().name;
    json["kernels"] = vk::kernels_name(context->device().kernels());
    json["results"] = Json::array();
    int exit_status = 0;
    for (const std::uint32_t items : sizes)
        for (const int bits : {32, 16}) {
            const Status status = bench_size(*context, items, bits, json["results"]);
            if (status.ok()) continue;
            std::fprintf(stderr, "radix_sort_bench: %u items by %d bits: %s\n", items, bits,
                         status.message().c_str());
            exit_status = 1;
        }
    std::printf("%s\n", json.dump(1).c_str());
    return exit_status;
}

}  // namespace
}  // namespace splat::test

int main(int argc, char** argv) {
    if (argc > 1 && std::strcmp(argv[1], "--json") == 0) {
        std::vector<std::uint32_t> sizes;
        for (int i = 2; i < argc; ++i) {
            const int items = std::atoi(argv[i]);
            if (items < 1) return 2;
            sizes.push_back(static_cast<std::uint32_t>(items));
        }
        if (sizes.empty()) sizes = {1U << 16, 1U << 20, 1400000, 1U << 22, 1U << 25};
        return splat::test::bench_sizes(sizes);
    }
    const int count = argc > 1 ? std::atoi(argv[1]) : 1000000;
    const int rounds = argc > 2 ? std::atoi(argv[2]) : 15;
    if (count < 1 || rounds < 1) return 2;
    return splat::test::bench(static_cast<std::uint32_t>(count), rounds);
}
