#include "bench/dispatch/dispatch_bench.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "bench/dispatch/raw_vulkan.h"
#include "bench/median.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"

namespace splat::vk::embedded {
extern const std::span<const std::uint32_t> bench_empty, bench_copy, bench_fma, bench_shuffle;
}

namespace vkrun::bench {
namespace {

namespace shaders = splat::vk::embedded;

constexpr int kChain = 1000;    ///< dispatches of a chain
constexpr int kRounds = 7;      ///< runs of each measurement, after one that is left out
constexpr double kEnough = 20;  ///< ms of a run of a ceiling: many times what a submission costs

Json figures(std::vector<double> values) {
    Json json;
    json["min"] = *std::min_element(values.begin(), values.end());
    json["median"] = median_of(values);
    return json;
}

/// The fastest and the median of some runs; one more comes before them.
template <class Measure>
Json repeated(const Measure& measure) {
    measure();
    std::vector<double> values;
    for (int i = 0; i < kRounds; ++i) values.push_back(measure());
    return figures(std::move(values));
}

/// Which accesses a barrier orders.
struct Order {
    VkPipelineStageFlags from_stages, to_stages;
    VkAccessFlags from, to;
};
constexpr Order kComputeOnly{VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                             VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT,
                             VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT};
/// The widest barrier that src/vk/command_list.cpp records, beside fills and copies.
constexpr Order kOfLists{VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT,
                         VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT,
                         VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT,
                         VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT |
                             VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_TRANSFER_WRITE_BIT};

void barrier(VkCommandBuffer to, const Order& order) {
    VkMemoryBarrier memory{};
    memory.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
    memory.srcAccessMask = order.from;
    memory.dstAccessMask = order.to;
    vkCmdPipelineBarrier(to, order.from_stages, order.to_stages, 0, 1, &memory, 0, nullptr, 0,
                         nullptr);
}

RawBuffer needed(RawVulkan& vulkan, VkDeviceSize bytes) {
    auto made = vulkan.buffer(bytes, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    if (!made)
        throw Failure(kOutOfMemory, format("no device memory for %llu bytes",
                                           static_cast<unsigned long long>(bytes)));
    return *made;
}

/// Chains of empty dispatches: microseconds a dispatch, on the device and for recording it.
Json measure_chains(RawVulkan& vulkan) {
    const RawBuffer out = needed(vulkan, 4096);
    const RawPipeline one = vulkan.pipeline(shaders::bench_empty, {out}, 1);
    const RawPipeline other = vulkan.pipeline(shaders::bench_empty, {out}, 2);
    struct Chain {
        const char* name;
        const Order* order;
        bool bind;       ///< the pipeline, its set and its push constants before each dispatch
        bool alternate;  ///< between two pipelines
    };
    constexpr Chain kChains[] = {
        {"without barrier", nullptr, false, false},
        {"compute barrier", &kComputeOnly, false, false},
        {"barrier of command lists", &kOfLists, false, false},
        {"bound each time, without barrier", nullptr, true, false},
        {"bound each time, compute barrier", &kComputeOnly, true, false},
        {"two pipelines, without barrier", nullptr, true, true},
        {"two pipelines, compute barrier", &kComputeOnly, true, true},
        {"two pipelines, barrier of command lists", &kOfLists, true, true}};
    Json rows = Json::array();
    for (const Chain& chain : kChains) {
        std::vector<double> record;
        const auto run = [&] {
            const RunTimes times = vulkan.run([&](VkCommandBuffer to) {
                one.bind(to, {});
                for (int i = 0; i < kChain; ++i) {
                    if (chain.order != nullptr) barrier(to, *chain.order);
                    if (chain.bind) (chain.alternate && i % 2 == 1 ? other : one).bind(to, {});
                    vkCmdDispatch(to, 1, 1, 1);
                }
            });
            record.push_back(times.record_ms * 1e3 / kChain);
            return times.ms() * 1e3 / kChain;
        };
        Json row;
        row["chain"] = chain.name;
        row["us"] = repeated(run);
        record.erase(record.begin());  // the run that is left out
        row["record_us"] = figures(std::move(record));
        rows.push_back(std::move(row));
    }
    return rows;
}

/// How many turns of a kernel take kEnough ms, found by doubling.
std::uint32_t enough_turns(const std::function<double(std::uint32_t)>& run) {
    std::uint32_t turns = 1;
    run(turns);
    while (turns < 1U << 24 && run(turns) < kEnough) turns *= 2;
    return turns;
}

/// Turns of an arithmetic kernel in 1e12 a second; each does `of_a_turn` operations an invocation.
Json measure_rate(RawVulkan& vulkan, std::span<const std::uint32_t> shader, std::uint32_t groups,
                  double of_a_turn, std::uint32_t constant = 0) {
    const RawBuffer out = needed(vulkan, VkDeviceSize{groups} * 256 * 4);
    const RawPipeline pipeline = vulkan.pipeline(shader, {out}, constant);
    const auto run = [&](std::uint32_t turns) {
        std::array<std::uint32_t, 3> push = {turns, 0, 0};
        const float values[2] = {0.999F, 0.001F};
        std::memcpy(&push[1], values, sizeof values);
        return vulkan
            .run([&](VkCommandBuffer to) {
                pipeline.bind(to, push);
                vkCmdDispatch(to, groups, 1, 1);
            })
            .ms();
    };
    const std::uint32_t turns = enough_turns(run);
    const Json ms = repeated([&] { return run(turns); });
    const double work = of_a_turn * turns * groups * 256;
    Json json;
    json["best"] = work / ms.at("min").get<double>() * 1e-9;
    json["median"] = work / ms.at("median").get<double>() * 1e-9;
    return json;
}

/// 1e9 bytes a second that copies read and write together: by a kernel, and by vkCmdCopyBuffer.
void measure_copies(RawVulkan& vulkan, VkDeviceSize bytes, Json& json) {
    RawBuffer from = needed(vulkan, bytes);
    RawBuffer to = needed(vulkan, bytes);
    const RawPipeline pipeline = vulkan.pipeline(shaders::bench_copy, {to, from});
    const auto count = static_cast<std::uint32_t>(bytes / 16);
    const std::uint32_t groups = (count + 255) / 256;
    const std::uint32_t across = std::min(groups, 32768U);
    const auto rate = [&](const std::function<void(VkCommandBuffer)>& copy) {
        const auto run = [&](std::uint32_t turns) {
            return vulkan
                .run([&](VkCommandBuffer commands) {
                    for (std::uint32_t i = 0; i < turns; ++i) {
                        copy(commands);
                        barrier(commands, kOfLists);
                    }
                })
                .ms();
        };
        const std::uint32_t turns = enough_turns(run);
        const Json ms = repeated([&] { return run(turns); });
        Json result;
        for (const char* key : {"min", "median"})
            result[std::strcmp(key, "min") == 0 ? "best" : key] =
                2.0 * static_cast<double>(bytes) * turns / ms.at(key).get<double>() * 1e-6;
        return result;
    };
    vulkan.run([&](VkCommandBuffer commands) {
        vkCmdFillBuffer(commands, from.buffer, 0, VK_WHOLE_SIZE, 0x3F800000);
    });
    json["copy_gb_per_s"] = rate([&](VkCommandBuffer commands) {
        pipeline.bind(commands, {count, across, 0});
        vkCmdDispatch(commands, across, (groups + across - 1) / across, 1);
    });
    json["transfer_gb_per_s"] = rate([&](VkCommandBuffer commands) {
        const VkBufferCopy region{0, 0, bytes};
        vkCmdCopyBuffer(commands, from.buffer, to.buffer, 1, &region);
    });
    json["copied_bytes"] = bytes;
}

Json measure_ceilings(RawVulkan& vulkan, const splat_device_info& info) {
    const bool cpu = info.kind == SPLAT_DEVICE_KIND_CPU;
    // More than any cache holds, within one binding.
    const VkDeviceSize most = cpu ? VkDeviceSize{64} << 20 : VkDeviceSize{512} << 20;
    const std::uint32_t groups = cpu ? 64 : 8192;
    Json json;
    measure_copies(vulkan,
                   std::min({most, VkDeviceSize{info.max_storage_buffer_bytes},
                             VkDeviceSize{info.heap_bytes / 8}}) &
                       ~VkDeviceSize{4095},
                   json);
    for (const std::uint32_t vectors :
         {2U, 4U, 8U}) {  // more need registers, fewer wait for results
        Json rate = measure_rate(vulkan, shaders::bench_fma, groups, 2.0 * 64 * vectors, vectors);
        Json& best = json["fma_tflop_per_s"];
        if (best.is_null() || rate.at("best") > best.at("best")) best = std::move(rate);
    }
    json["shuffle_t_per_s"] = (info.features & SPLAT_FEATURE_SUBGROUP_SHUFFLE) == 0
                                  ? Json(nullptr)
                                  : measure_rate(vulkan, shaders::bench_shuffle, groups, 64);
    return json;
}

struct Kind {
    VkMemoryPropertyFlags bit;
    const char* name;
};
constexpr Kind kKinds[] = {{VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, "device"},
                           {VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT, "host-visible"},
                           {VK_MEMORY_PROPERTY_HOST_COHERENT_BIT, "coherent"},
                           {VK_MEMORY_PROPERTY_HOST_CACHED_BIT, "cached"}};

std::string flags_text(VkMemoryPropertyFlags flags) {
    std::string text;
    for (const Kind& kind : kKinds)
        if ((flags & kind.bit) != 0) text += (text.empty() ? "" : " ") + std::string(kind.name);
    return text;
}

/// Reading and writing of mapped memory by the host, of each kind that the device has.
Json measure_mapped(RawVulkan& vulkan) {
    constexpr VkDeviceSize kBytes = 16 << 20;
    constexpr VkMemoryPropertyFlags kVisible = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT;
    constexpr VkMemoryPropertyFlags kLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
    constexpr VkMemoryPropertyFlags kCached = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
    Json rows = Json::array();
    std::vector<char> host(kBytes, 1);
    for (const VkMemoryPropertyFlags wanted :
         {VkMemoryPropertyFlags{0}, kCached, kLocal, kLocal | kCached}) {
        auto buffer = vulkan.buffer(kBytes, kVisible | wanted, (kLocal | kCached) & ~wanted);
        if (!buffer) continue;
        auto* mapped = static_cast<char*>(vulkan.map(*buffer));
        const auto rate = [&](auto&& call) {
            const Json ms = repeated([&] { return timed_ms(call); });
            return static_cast<double>(kBytes) / ms.at("min").get<double>() * 1e-6;
        };
        Json row;
        row["memory"] = flags_text(kVisible | wanted);
        row["write_gb_per_s"] = rate([&] { std::memcpy(mapped, host.data(), kBytes); });
        row["read_gb_per_s"] = rate([&] {
            vulkan.invalidate(*buffer);
            std::memcpy(host.data(), mapped, kBytes);
        });
        row["read_4_bytes_us"] = repeated([&] {
            constexpr int kReads = 256;
            const double ms = timed_ms([&] {
                for (int i = 0; i < kReads; ++i) {
                    vulkan.invalidate(*buffer);
                    host[0] = static_cast<char>(*reinterpret_cast<volatile std::uint32_t*>(mapped));
                }
            });
            return ms * 1e3 / kReads;
        });
        rows.push_back(std::move(row));
        vulkan.free(*buffer);
    }
    return rows;
}

Json memory_json(const VkPhysicalDeviceMemoryProperties& memory) {
    Json json;
    json["heaps"] = Json::array();
    for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i) {
        Json heap;
        heap["bytes"] = memory.memoryHeaps[i].size;
        heap["device"] = (memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) != 0;
        json["heaps"].push_back(std::move(heap));
    }
    json["types"] = Json::array();
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
        Json type;
        type["heap"] = memory.memoryTypes[i].heapIndex;
        type["kind"] = flags_text(memory.memoryTypes[i].propertyFlags);
        json["types"].push_back(std::move(type));
    }
    return json;
}

std::string pair_text(const Json& value, const char* first) {
    if (value.is_null()) return "";
    return format("%.3g / %.3g", value.at(first).get<double>(), value.at("median").get<double>());
}

}  // namespace

Json measure_dispatch(const splat_device_info& info, bool measure) {
    RawVulkan vulkan{info.uuid};
    Json json;
    json["memory"] = memory_json(vulkan.memory());
    json["lanes"] = vulkan.lanes();
    json["timestamp_ns"] = vulkan.limits().timestampPeriod;
    json["extensions"] = vulkan.extensions();
    if (!measure) return json;
    json["ceilings"] = measure_ceilings(vulkan, info);
    json["chains"] = measure_chains(vulkan);
    json["submit_us"] = repeated([&] { return vulkan.submit(false) * 1e3; });
    json["submit_empty_list_us"] =
        repeated([&] { return vulkan.run([](VkCommandBuffer) {}).wall_ms * 1e3; });
    json["mapped"] = measure_mapped(vulkan);
    return json;
}

std::string dispatch_table(const Json& measured) {
    Table ceilings({"ceiling", ">best / median"});
    const Json& found = measured.at("ceilings");
    ceilings.add({"copy by a kernel, GB/s", pair_text(found.at("copy_gb_per_s"), "best")});
    ceilings.add({"vkCmdCopyBuffer, GB/s", pair_text(found.at("transfer_gb_per_s"), "best")});
    ceilings.add({"multiply-adds, TFLOP/s", pair_text(found.at("fma_tflop_per_s"), "best")});
    ceilings.add({"shuffles, 1e12/s", pair_text(found.at("shuffle_t_per_s"), "best")});
    Table chains({"chain of empty dispatches", ">us each, min / median", ">us to record"});
    for (const Json& row : measured.at("chains"))
        chains.add({row.at("chain"), pair_text(row.at("us"), "min"),
                    pair_text(row.at("record_us"), "min")});
    chains.add({"a submission of nothing, with its fence",
                pair_text(measured.at("submit_us"), "min"), ""});
    chains.add({"a submission of an empty list",
                pair_text(measured.at("submit_empty_list_us"), "min"), ""});
    Table mapped({"mapped memory", ">write GB/s", ">read GB/s", ">read 4 bytes, us"});
    for (const Json& row : measured.at("mapped"))
        mapped.add({row.at("memory"), format("%.2f", row.at("write_gb_per_s").get<double>()),
                    format("%.2f", row.at("read_gb_per_s").get<double>()),
                    pair_text(row.at("read_4_bytes_us"), "min")});
    return ceilings.text() + "\n" + chains.text() + "\n" + mapped.text();
}

}  // namespace vkrun::bench
