#include "run/order.h"

#include <algorithm>
#include <array>
#include <new>

#include "core/hash.h"

namespace splat::run {
namespace {

template <class T>
std::span<std::byte> bytes_of(std::vector<T>& values) {
    return std::as_writable_bytes(std::span(values));
}

}  // namespace

Status broadcast(Group& group, Order& order) {
    struct Head {
        Order::What what;
        std::int32_t code;
        std::uint64_t number, texts;
    } head{order.what, order.code, order.number, order.texts.size()};
    SPLAT_TRY(group.broadcast(std::as_writable_bytes(std::span(&head, 1))));
    order.what = head.what;
    order.code = head.code;
    order.number = head.number;
    order.texts.resize(head.texts);
    for (std::string& text : order.texts) SPLAT_TRY(group.broadcast(text));
    return {};
}

Result<io::WeightsFile> broadcast(Group& group, const io::WeightsFile* given) {
    io::FilePieces pieces;
    if (given != nullptr)
        SPLAT_SET(pieces, io::write_weights(*given, io::WeightsFormat::kSafetensors));
    std::uint64_t size = pieces.size();
    SPLAT_TRY(group.broadcast(std::as_writable_bytes(std::span(&size, 1))));
    io::Buffer file = pieces.joined();
    file.resize(size);
    SPLAT_TRY(group.broadcast(file));
    return io::read_weights(io::MemorySource(file), "state of rank 0");
}

Status compare_versions(Group& group, const std::string& mine) {
    using Version = std::array<char, 32>;
    Version own{};
    std::copy_n(mine.data(), std::min(mine.size(), own.size() - 1), own.data());
    std::vector<Version> all(group.count());
    SPLAT_TRY(group.gather(std::as_bytes(std::span(own)), bytes_of(all)));
    for (std::uint32_t rank = 1; rank < group.count(); ++rank)
        if (all[rank] != all[0])
            return invalid(
                "rank %u: libsplat is version %s, but %s on rank 0: give all ranks the same", rank,
                all[rank].data(), all[0].data());
    return {};
}

Status compare_facts(const RankFacts& mine, const std::vector<std::string>& first) {
    if (first.size() !=
        2 * mine.equal.size())  // rank 0 failed, or a task that has not always the same facts
        return invalid("%zu facts to compare, but %zu on rank 0", mine.equal.size(),
                       first.size() / 2);
    for (std::size_t i = 0; i < mine.equal.size(); ++i) {
        const auto& [name, value] = mine.equal[i];
        const std::string& other = first[2 * i + 1];
        if (value != other)
            return invalid("%s is %s, but %s on rank 0: all ranks of a run need the same",
                           name.c_str(), value.c_str(), other.c_str());
    }
    return {};
}

Result<std::string> compare_devices(Group& group, const std::string& mine) {
    Hash hash;
    hash.add(mine);
    const std::uint64_t own = hash.value();
    std::vector<std::uint64_t> all(group.count());
    SPLAT_TRY(group.gather(std::as_bytes(std::span(&own, 1)), bytes_of(all)));
    const auto other = std::ranges::find_if(all, [&](std::uint64_t one) { return one != all[0]; });
    if (other == all.end()) return std::string();
    const auto rank = static_cast<std::uint32_t>(other - all.begin());
    std::string first = mine, differs = mine;
    SPLAT_TRY(group.broadcast(first));
    SPLAT_TRY(group.broadcast(differs, rank));
    return format(
        "warning: rank %u computes on %s, but rank 0 on %s: other devices round in other ways, so "
        "the bits of this run are not those of another number of ranks",
        rank, differs.c_str(), first.c_str());
}

Status told(const std::function<Status()>& work) {
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return {Code::kOutOfHostMemory, code_sentence(Code::kOutOfHostMemory)};
    }
}

Result<std::string> checksum_of(Task& task) {
    SPLAT_ASSIGN(const auto results, task.results());
    std::string sums;
    for (const NamedWeights& result : results)
        sums += format("%08x", io::crc32_of(result.file.tensors));
    return sums;
}

}  // namespace splat::run
