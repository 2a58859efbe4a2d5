// Enumerating, opening and describing devices, their memory and their profile.
#include <cstddef>
#include <nlohmann/json.hpp>

#include "api/api_calls.h"
#include "support/require_vulkan.h"

namespace splat::test {
namespace {

splat_device_info describe(std::uint32_t index) {
    return got(splat_device_describe, index);
}

splat_device_info info_of(splat_device device) {
    return got(splat_device_get_info, device);
}

splat_memory_info memory_of(splat_device device) {
    return got(splat_device_get_memory, device);
}

std::uint32_t count() {
    return got(splat_device_count);
}

/// Creation with this desc is refused and leaves the handle alone.
void expect_absent(const splat_device_desc& desc, const std::string& part) {
    Output<splat_device> device;
    EXPECT_REFUSED(splat_device_create(&desc, device.out()), SPLAT_ERROR_NO_DEVICE, part);
    EXPECT_TRUE(device.untouched());
    EXPECT_TRUE(holds(splat_last_error_message(), describe(0).name)) << "no list";
}

TEST(ApiDevice, DescribesAllThatItCounts) {
    ASSERT_GT(count(), 0U);
    for (std::uint32_t index = 0; index < count(); ++index) {
        const splat_device_info info = describe(index);
        EXPECT_EQ(info.index, index);
        EXPECT_EQ(info.struct_size, sizeof info);
        EXPECT_GE(info.kind, SPLAT_DEVICE_KIND_OTHER);
        EXPECT_LE(info.kind, SPLAT_DEVICE_KIND_DISCRETE);
        if (info.usable == 0) {
            EXPECT_GT(std::strlen(info.reason), 0U);
        }
        EXPECT_GT(std::strlen(info.name), 0U);
        EXPECT_GT(std::strlen(info.driver), 0U);
        EXPECT_GT(info.heap_bytes, 0U);
        EXPECT_GE(info.max_storage_buffer_bytes, std::uint64_t{1} << 27);
        EXPECT_GE(info.max_workgroup_invocations, 128U);
        EXPECT_GE(info.kernels, SPLAT_KERNELS_PLAIN);
        EXPECT_LE(info.kernels, SPLAT_KERNELS_GPU);
    }
}

TEST(ApiDevice, IndexBeyondTheCountIsRefused) {
    Output<splat_device_info> info;
    info.set_struct_size(sizeof(splat_device_info));
    for (const std::uint32_t index : {count(), UINT32_MAX})
        EXPECT_REFUSED(splat_device_describe(index, info.out()), kArgument, std::to_string(index));
    EXPECT_TRUE(info.untouched());
}

TEST(ApiDevice, NullDescMeansDefaults) {
    const Device device = got(splat_device_create, nullptr);
    EXPECT_EQ(info_of(device).usable, 1U);
}

TEST(ApiDevice, IsChosenByIndexUuidAndKind) {
    const splat_device_info wanted = info_of(shared_device());
    splat_device_desc desc = device_desc();
    desc.select = SPLAT_SELECT_BY_INDEX;
    desc.index = wanted.index;
    EXPECT_EQ(info_of(open_device(desc)).index, wanted.index);
    desc = device_desc();
    desc.select = SPLAT_SELECT_BY_UUID;
    std::memcpy(desc.uuid, wanted.uuid, sizeof desc.uuid);
    EXPECT_EQ(info_of(open_device(desc)).index, wanted.index);
    desc = device_desc();
    desc.select = SPLAT_SELECT_BY_KIND;
    desc.kind = wanted.kind;
    EXPECT_EQ(info_of(open_device(desc)).kind, wanted.kind);
}

TEST(ApiDevice, AbsentOnesAreNamedWithWhatThereIs) {
    splat_device_desc desc = device_desc();
    desc.select = SPLAT_SELECT_BY_INDEX;
    desc.index = 77;
    expect_absent(desc, "index 77");
    desc = device_desc();
    desc.select = SPLAT_SELECT_BY_UUID;
    std::memset(desc.uuid, 0xEE, sizeof desc.uuid);
    expect_absent(desc, std::string("eeee"));
    std::vector<bool> there(SPLAT_DEVICE_KIND_DISCRETE + 1);
    for (std::uint32_t index = 0; index < count(); ++index)
        there[static_cast<std::size_t>(describe(index).kind)] = true;
    desc = device_desc();
    desc.select = SPLAT_SELECT_BY_KIND;
    for (const auto& [kind, name] :
         {std::pair{SPLAT_DEVICE_KIND_OTHER, "other"}, std::pair{SPLAT_DEVICE_KIND_CPU, "cpu"},
          std::pair{SPLAT_DEVICE_KIND_VIRTUAL, "virtual"},
          std::pair{SPLAT_DEVICE_KIND_INTEGRATED, "integrated"},
          std::pair{SPLAT_DEVICE_KIND_DISCRETE, "discrete"}}) {
        desc.kind = kind;
        if (!there[static_cast<std::size_t>(kind)]) expect_absent(desc, name);
    }
}

TEST(ApiDevice, RunsTheKernelsAskedFor) {
    if (info_of(open_device()).kernels == SPLAT_KERNELS_PLAIN)
        SPLAT_SKIP_FOR_DEVICE("the device runs plain kernels only, or SPLAT_KERNELS is set");
    splat_device_desc desc = device_desc();
    for (const splat_kernels kernels :
         {SPLAT_KERNELS_PLAIN, SPLAT_KERNELS_CPU, SPLAT_KERNELS_GPU}) {
        if (kernels == SPLAT_KERNELS_CPU &&
            (info_of(open_device()).features & SPLAT_FEATURE_INT64) == 0)
            continue;
        desc.kernels = kernels;
        EXPECT_EQ(info_of(open_device(desc)).kernels, kernels);
    }
}

TEST(ApiDevice, LaterStructsMayBeLarger) {
    struct Later {
        splat_device_info info;
        std::uint64_t more;
    } later{};
    later.info.struct_size = sizeof later;
    later.more = 7;
    EXPECT_DONE(splat_device_describe(0, &later.info));
    EXPECT_EQ(later.info.struct_size, sizeof later);
    EXPECT_EQ(later.more, 7U);
    EXPECT_STREQ(later.info.name, describe(0).name);
    struct LaterDesc {
        splat_device_desc desc;
        std::uint64_t more;
    } later_desc{device_desc(), 0};
    later_desc.desc.struct_size = sizeof later_desc;
    const Device device = got(splat_device_create, &later_desc.desc);
}

TEST(ApiDevice, StructsOfTheFirstVersionAreShorter) {
    splat_device_desc desc = device_desc();
    desc.struct_size = offsetof(splat_device_desc, max_submit_ns);
    const Device device = got(splat_device_create, &desc);
    --desc.struct_size;
    Output<splat_device> none;
    EXPECT_REFUSED(splat_device_create(&desc, none.out()), kArgument, "struct_size");
    splat_device_info info;
    info.struct_size = offsetof(splat_device_info, kernels_note);
    std::memset(info.kernels_note, 7, sizeof info.kernels_note);
    EXPECT_DONE(splat_device_describe(0, &info));
    EXPECT_EQ(info.kernels_note[0], 7) << "what the caller's struct lacks stays";
    --info.struct_size;
    EXPECT_REFUSED(splat_device_describe(0, &info), kArgument, "struct_size");
}

TEST(ApiMemory, CountsUsedLiveAndPeak) {
    const Device device = open_device();
    const splat_memory_info empty = memory_of(device);
    EXPECT_EQ(empty.used_bytes, 0U);
    EXPECT_EQ(empty.live_bytes, 0U);
    EXPECT_EQ(empty.allocations, 0U);
    EXPECT_GT(empty.budget_bytes, 0U);
    Tensor tensor = make_tensor(device, {1000});
    const splat_memory_info one = memory_of(device);
    EXPECT_GE(one.live_bytes, 4000U);
    EXPECT_LE(one.live_bytes, 8192U);
    EXPECT_GE(one.used_bytes, one.live_bytes);
    EXPECT_EQ(one.peak_bytes, one.used_bytes);
    EXPECT_EQ(one.allocations, 1U);
    tensor.destroy();
    const splat_memory_info after = memory_of(device);
    EXPECT_EQ(after.live_bytes, 0U);
    EXPECT_EQ(after.used_bytes, 0U);
    EXPECT_EQ(after.peak_bytes, one.peak_bytes);
}

TEST(ApiMemory, BudgetIsEnforcedAndNamed) {
    splat_device_desc desc = device_desc();
    desc.max_device_bytes = std::uint64_t{1} << 20;
    const Device device = open_device(desc);
    EXPECT_EQ(memory_of(device).budget_bytes, desc.max_device_bytes);
    const Tensor fits = make_tensor(device, {1 << 16});
    const splat_tensor_desc large = tensor_desc({1 << 18}, "large");
    Output<splat_tensor> tensor;
    EXPECT_REFUSED(splat_tensor_create(device, &large, tensor.out()),
                   SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, "large");
    EXPECT_TRUE(tensor.untouched());
    const std::string text = splat_last_error_message();
    EXPECT_TRUE(holds(text, "1048576 bytes"));
    EXPECT_TRUE(holds(text, "budget of 1048576"));
    const splat_memory_info now = memory_of(device);
    EXPECT_LE(now.used_bytes, now.budget_bytes);
    EXPECT_LE(now.peak_bytes, now.budget_bytes);
    const Tensor small = make_tensor(device, {16});
}

Tensor run_group_norm(splat_device device) {
    const Tensor x = upload(device, {1, 4, 2, 2}, Floats(16, 2.0F));
    const Tensor gamma = upload(device, {4}, {1, 1, 1, 1});
    const Tensor beta = upload(device, {4}, {5, 6, 7, 8});
    Tensor y = make_tensor(device, {1, 4, 2, 2});
    const Op op = make_op(device, OpRequest("group_norm", {x, gamma, beta}, {y}));
    EXPECT_DONE(splat_op_forward(op));
    return y;
}

TEST(ApiProfile, IsJsonAndTable) {
    const Device device = open_device(SPLAT_DEVICE_PROFILE);
    run_group_norm(device);
    const auto json = [&] {
        return nlohmann::json::parse(text_of(splat_device_profile_json, device));
    };
    const nlohmann::json profile = json();
    EXPECT_EQ(profile.at("device"), info_of(device).name);
    bool found = false;
    for (const auto& row : profile.at("ops")) {
        for (const char* field : {"count", "total_ms", "min_ms", "median_ms", "bytes", "flops"})
            EXPECT_TRUE(row.at(field).is_number()) << row;
        found = found || row.at("op") == "group_norm_forward";
    }
    EXPECT_TRUE(found) << profile;
    EXPECT_GT(profile.at("idle").at("count"), 0) << profile;
    EXPECT_GT(profile.at("idle").at("total_ms"), 0) << profile;
    EXPECT_TRUE(holds(text_of(splat_device_profile_table, device), "group_norm_forward"));
    EXPECT_DONE(splat_device_profile_reset(device));
    EXPECT_TRUE(json().at("ops").empty());
}

TEST(ApiProfile, IsRefusedWithoutItsFlag) {
    char buffer[8] = "same";
    std::size_t needed = 99;
    EXPECT_REFUSED(splat_device_profile_json(shared_device(), buffer, sizeof buffer, &needed),
                   kState, "SPLAT_DEVICE_PROFILE");
    EXPECT_REFUSED(splat_device_profile_table(shared_device(), buffer, sizeof buffer, &needed),
                   kState, "SPLAT_DEVICE_PROFILE");
    EXPECT_REFUSED(splat_device_profile_reset(shared_device()), kState, "SPLAT_DEVICE_PROFILE");
    EXPECT_STREQ(buffer, "same");
    EXPECT_EQ(needed, 99U);
}

TEST(ApiLifetime, ChildrenKeepTheDeviceOpen) {
    Device device = open_device();
    Tensor x = upload(device, {1, 4}, {1, 2, 3, 4});
    Tensor weight = upload(device, {1, 4}, {1, 1, 1, 1});
    Tensor y = make_tensor(device, {1, 1});
    Op op = make_op(device, OpRequest("linear", {x, weight, nullptr}, {y}));
    const splat_device stale = device.destroy();
    auto info = sized<splat_device_info>();
    EXPECT_REFUSED(splat_device_get_info(stale, &info), kHandle, "device");
    x.destroy();
    weight.destroy();
    EXPECT_DONE(splat_op_forward(op));
    EXPECT_EQ(download(y), Floats{10});
    const splat_tensor_desc desc = tensor_desc({1});
    splat_tensor more = nullptr;
    EXPECT_REFUSED(splat_tensor_create(stale, &desc, &more), kHandle, "device");
    y.destroy();
    EXPECT_DONE(splat_op_forward(op));
    op.destroy();
}

}  // namespace
}  // namespace splat::test
