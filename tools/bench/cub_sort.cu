// cub_sort [ITEMS...]: times CUB's radix sort of pairs of a random 32-bit key and its position, by all 32 bits and
// by 16, as lists of tiles need, and checks order and stability.
//
//     nvcc -O3 -arch=native -o cub_sort cub_sort.cu
//
// Prints {device, cuda, cub, results: [{items, bits, min_ms, median_ms, items_per_s}]}: device times between two
// CUDA events, of sorts from one pair of arrays into another; items_per_s of the shortest. Keys are below 2^bits.
// radix_sort_bench --json prints the same of libsplat's sort.
//
// Exit status  0 success, 1 a sort failed or its order is wrong, 2 wrong usage, 3 there is no CUDA device
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cub/device/device_radix_sort.cuh>
#include <cub/version.cuh>
#include <random>
#include <vector>

namespace {

void check(cudaError_t status, const char* what) {
    if (status == cudaSuccess) return;
    std::fprintf(stderr, "cub_sort: %s: %s\n", what, cudaGetErrorString(status));
    std::exit(1);
}

template <class T>
class Array {
  public:
    explicit Array(std::size_t count) : bytes_(count * sizeof(T)) {
        check(cudaMalloc(&data_, bytes_), "memory");
    }
    ~Array() { cudaFree(data_); }
    Array(const Array&) = delete;
    Array& operator=(const Array&) = delete;

    T* data() { return data_; }
    void write(const std::vector<T>& from) {
        check(cudaMemcpy(data_, from.data(), bytes_, cudaMemcpyHostToDevice), "upload");
    }
    void read(std::vector<T>& to) {
        check(cudaMemcpy(to.data(), data_, bytes_, cudaMemcpyDeviceToHost), "download");
    }

  private:
    std::size_t bytes_;
    T* data_ = nullptr;
};

using Words = std::vector<std::uint32_t>;

/// Positions as values: equal keys must keep them in order.
bool is_sorted(const Words& input, const Words& keys, const Words& values) {
    for (std::size_t i = 0; i < keys.size(); ++i) {
        if (values[i] >= input.size() || keys[i] != input[values[i]]) return false;
        if (i > 0 && (keys[i - 1] > keys[i] || (keys[i - 1] == keys[i] && values[i - 1] >= values[i])))
            return false;
    }
    return true;
}

/// Sorted times in ms: at least 10 runs, and as many as half a second allows, after three others.
template <class Sort>
std::vector<float> times_of(Sort sort) {
    cudaEvent_t begin, end;
    check(cudaEventCreate(&begin), "event");
    check(cudaEventCreate(&end), "event");
    std::vector<float> times;
    float total = 0;
    for (int run = -3; run < 10 || (total < 500 && run < 2000); ++run) {
        check(cudaEventRecord(begin), "event");
        check(sort(), "sort");
        check(cudaEventRecord(end), "event");
        check(cudaEventSynchronize(end), "sort");
        float ms = 0;
        check(cudaEventElapsedTime(&ms, begin, end), "event");
        if (run < 0) continue;
        times.push_back(ms);
        total += ms;
    }
    cudaEventDestroy(begin);
    cudaEventDestroy(end);
    std::sort(times.begin(), times.end());
    return times;
}

bool bench(std::uint32_t items, int bits, const char* separator) {
    std::mt19937 random(1);
    Words keys(items), values(items), sorted_keys(items), sorted_values(items);
    for (std::uint32_t i = 0; i < items; ++i) {
        keys[i] = static_cast<std::uint32_t>(random()) >> (32 - bits);
        values[i] = i;
    }
    Array<std::uint32_t> keys_in(items), values_in(items), keys_out(items), values_out(items);
    keys_in.write(keys);
    values_in.write(values);
    std::size_t bytes = 0;
    const auto sort_with = [&](void* space) {
        return cub::DeviceRadixSort::SortPairs(space, bytes, keys_in.data(), keys_out.data(), values_in.data(),
                                               values_out.data(), static_cast<int>(items), 0, bits);
    };
    check(sort_with(nullptr), "size of the workspace");
    Array<std::uint8_t> space(std::max<std::size_t>(bytes, 1));
    const std::vector<float> times = times_of([&] { return sort_with(space.data()); });
    keys_out.read(sorted_keys);
    values_out.read(sorted_values);
    if (!is_sorted(keys, sorted_keys, sorted_values)) {
        std::fprintf(stderr, "cub_sort: %u items by %d bits are in a wrong order\n", items, bits);
        return false;
    }
    std::printf("%s{\"items\": %u, \"bits\": %d, \"min_ms\": %.6f, \"median_ms\": %.6f, \"items_per_s\": %.6e}",
                separator, items, bits, times[0], times[times.size() / 2], items / (times[0] * 1e-3));
    return true;
}

}  // namespace

int main(int argc, char** argv) {
    Words sizes;
    for (int i = 1; i < argc; ++i) {
        char* end = nullptr;
        const unsigned long items = std::strtoul(argv[i], &end, 10);
        if (*end != '\0' || items < 1 || items > 1UL << 28) {
            std::fprintf(stderr, "cub_sort: '%s', expected a number of items from 1 to 2^28\n", argv[i]);
            return 2;
        }
        sizes.push_back(static_cast<std::uint32_t>(items));
    }
    if (sizes.empty()) sizes = {1U << 16, 1U << 20, 1400000, 1U << 22, 1U << 25};
    cudaDeviceProp device{};
    const cudaError_t found = cudaGetDeviceProperties(&device, 0);
    if (found != cudaSuccess) {
        std::fprintf(stderr, "cub_sort: there is no CUDA device: %s\n", cudaGetErrorString(found));
        return 3;
    }
    std::printf("{\"device\": \"%s\", \"cuda\": \"%d.%d\", \"cub\": \"%d.%d.%d\", \"results\": [", device.name,
                CUDART_VERSION / 1000, CUDART_VERSION % 1000 / 10, CUB_MAJOR_VERSION, CUB_MINOR_VERSION,
                CUB_SUBMINOR_VERSION);
    const char* separator = "";
    for (const std::uint32_t items : sizes)
        for (const int bits : {32, 16}) {
            if (!bench(items, bits, separator)) return 1;
            separator = ", ";
        }
    std::printf("]}\n");
    return 0;
}
