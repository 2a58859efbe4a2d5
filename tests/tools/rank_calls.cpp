// rank_calls <plugin> <case>...: calls of a plugin for MPI, by mpirun. Prints what it did, and fails with status 1.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "core/os/library.h"
#include "vkrun/ranks/mpi_plugin.h"

namespace {

vkrun_mpi g_mpi = {};

void expect(bool right, const std::string& what) {
    if (right) return;
    std::fprintf(stderr, "rank %u of %u: %s\n", g_mpi.rank, g_mpi.count, what.c_str());
    g_mpi.end_all(1);
}

std::vector<unsigned char> bytes_of(std::uint32_t from, std::uint32_t to, std::size_t size) {
    std::vector<unsigned char> bytes(size);
    for (std::size_t i = 0; i < size; ++i)
        bytes[i] = static_cast<unsigned char>(i * 7 + from * 31 + to * 17 + i / 1000);
    return bytes;
}

/// Sizes about that of a message, 1000 bytes.
constexpr std::size_t kSizes[] = {0, 1, 999, 1000, 1001, 123456};

void exchange() {
    for (const std::size_t size : kSizes)
        for (std::uint32_t bit = 1; bit < g_mpi.count; bit *= 2) {
            const std::uint32_t peer = g_mpi.rank ^ bit;
            const std::vector<unsigned char> sent = bytes_of(g_mpi.rank, peer, size);
            std::vector<unsigned char> received(size);
            expect(g_mpi.send_receive(nullptr, peer, sent.data(), received.data(), size) == 0,
                   "send_receive fails");
            expect(received == bytes_of(peer, g_mpi.rank, size), "other bytes came");
        }
}

void broadcast() {
    for (const std::size_t size : kSizes)
        for (std::uint32_t root = 0; root < g_mpi.count; ++root) {
            std::vector<unsigned char> data(size);
            if (root == g_mpi.rank) data = bytes_of(root, root, size);
            expect(g_mpi.broadcast(nullptr, root, data.data(), size) == 0, "broadcast fails");
            expect(data == bytes_of(root, root, size), "other bytes came");
        }
}

/// Nobody leaves the barrier before the last one came, who comes later by each rank in turn.
void barrier() {
    using Clock = std::chrono::steady_clock;
    for (std::uint32_t late = 0; late < g_mpi.count; ++late) {
        const Clock::time_point begun = Clock::now();
        if (late == g_mpi.rank) std::this_thread::sleep_for(std::chrono::milliseconds(200));
        expect(g_mpi.barrier(nullptr) == 0, "barrier fails");
        expect(Clock::now() - begun > std::chrono::milliseconds(100), "nobody was waited for");
        expect(g_mpi.barrier(nullptr) == 0, "barrier fails");
    }
}

/// Rank 1 does not come.
void timeout() {
    if (g_mpi.rank == 1) std::this_thread::sleep_for(std::chrono::seconds(60));
    char byte = 0, other = 0;
    const std::int32_t failed =
        g_mpi.rank == 0 ? g_mpi.send_receive(nullptr, 1, &byte, &other, 1) : g_mpi.barrier(nullptr);
    expect(failed == VKRUN_MPI_TIMEOUT, "it is not the timeout: " + std::to_string(failed));
    if (g_mpi.rank != 0) std::this_thread::sleep_for(std::chrono::seconds(60));
    std::fprintf(stderr, "timeout: %s\n", g_mpi.describe(nullptr, failed));
    g_mpi.end_all(7);
}

/// Rank 1 ends all while the others wait.
void end_all() {
    if (g_mpi.rank == 1) {
        std::fprintf(stderr, "rank 1 ends all\n");
        g_mpi.end_all(7);
    }
    g_mpi.barrier(nullptr);
}

/// Seconds of an exchange of 64 MiB.
void speed() {
    std::vector<unsigned char> sent(std::size_t{64} << 20U, 1), received(sent.size());
    for (int i = 0; i < 3; ++i) {
        const auto begun = std::chrono::steady_clock::now();
        g_mpi.send_receive(nullptr, g_mpi.rank ^ 1U, sent.data(), received.data(), sent.size());
        const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begun;
        if (g_mpi.rank == 0) std::printf("64 MiB: %.3f s\n", seconds.count());
    }
    const auto begun = std::chrono::steady_clock::now();
    for (int i = 0; i < 1000; ++i)
        g_mpi.send_receive(nullptr, g_mpi.rank ^ 1U, sent.data(), received.data(), 8);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begun;
    if (g_mpi.rank == 0) std::printf("8 bytes: %.1f us\n", seconds.count() * 1e3);
}

constexpr struct {
    const char* name;
    void (*call)();
} kCases[] = {{"exchange", exchange}, {"broadcast", broadcast}, {"barrier", barrier},
              {"timeout", timeout},   {"end_all", end_all},     {"speed", speed}};

}  // namespace

int main(int argc, char** argv) {
    std::string failed;
    void* const library = argc < 3 ? nullptr : splat::os::load_library(argv[1], failed);
    const auto start = library == nullptr ? nullptr
                                          : reinterpret_cast<vkrun_mpi_start_function>(
                                                splat::os::function_of(library, "vkrun_mpi_start"));
    if (start == nullptr) return std::fprintf(stderr, "no plugin: %s\n", failed.c_str()), 1;
    const std::string name = argv[2];
    g_mpi.timeout_seconds = name == "timeout" ? 1 : 600;
    g_mpi.message_bytes = name == "speed" ? std::uint64_t{64} << 20U : 1000;
    if (start(VKRUN_MPI_VERSION + 1, &g_mpi) != VKRUN_MPI_OTHER_VERSION) return 1;
    if (start(VKRUN_MPI_VERSION, &g_mpi) != 0) return std::fprintf(stderr, "%s\n", g_mpi.failed), 1;
    expect(g_mpi.count == 4 && g_mpi.local_count == 4 && g_mpi.local_rank < 4, "other counts");
    for (int i = 2; i < argc; ++i) {
        for (const auto& [word, call] : kCases)
            if (argv[i] == std::string(word)) std::thread(call).join();  // any thread may call
        expect(g_mpi.barrier(nullptr) == 0, "barrier fails");
        if (g_mpi.rank == 0)
            std::printf("%s: %u ranks by %s\n", argv[i], g_mpi.count, g_mpi.library);
    }
    return g_mpi.finish();
}
