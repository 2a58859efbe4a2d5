#include "io/torch/pth_archive.h"

#include <algorithm>
#include <unordered_map>

#include "core/checked_math.h"
#include "io/zip.h"

namespace splat::io {
namespace {

using Kind = PickleNode::Kind;

constexpr std::string_view kPickleName = "/data.pkl";

/// A pickle of the number 0x1950a86a20f9469cfc6c.
constexpr std::string_view kMagicPickle("\x80\x02\x8a\x0al\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19.",
                                        15);
constexpr std::int64_t kLegacyProtocol = 1001;

/// The pickles behind the magic number.
enum LegacyPickle : std::size_t { kProtocol, kMachine, kSaved, kKeys, kLegacyPickles };

Status bad_archive(const std::string& problem) {
    return damaged("pth: %s", problem.c_str());
}

Status big_endian(const std::string& order) {
    return unsupported(
        "pth: the byte order is '%s', expected 'little'; save the file again on a "
        "little-endian machine",
        order.c_str());
}

Result<Pickle> in_pth(Result<Pickle> pickle, const char* where) {
    if (pickle.ok()) return pickle;
    return Status(pickle.status().code(), std::string("pth: ") + where + pickle.status().message());
}

class ZipPth : public PthArchive {
  public:
    Status open(const Source& source, DecodeBudget& budget) {
        SPLAT_ASSIGN(zip_, Zip::open(source, "pth", budget.limits()));
        const ZipEntry* found = nullptr;
        for (const ZipEntry& entry : zip_.entries()) {
            if (!is_pth_entry(entry.name)) continue;
            if (found != nullptr) return bad_archive("there are two files data.pkl in the archive");
            found = &entry;
        }
        if (found == nullptr)
            return bad_archive("the archive holds no data.pkl, so torch.save() did not write it");
        prefix_ = found->name.substr(0, found->name.size() - kPickleName.size());
        SPLAT_TRY(check_byte_order());
        if (found->bytes > Pickle::kMaxBytes)
            return bad_archive(format("data.pkl has %llu bytes, the limit is %zu",
                                      llu(found->bytes), Pickle::kMaxBytes));
        SPLAT_TRY(budget.take(found->bytes, 1, "pth: data.pkl"));
        Buffer bytes;
        SPLAT_TRY(zip_.read(*found, bytes));
        SPLAT_ASSIGN(pickle_, in_pth(Pickle::read(std::move(bytes), budget), "data.pkl: "));
        return {};
    }

    [[nodiscard]] Result<std::uint64_t> size_of(const std::string& key,
                                                const std::string& user) const override {
        const ZipEntry* entry = zip_.find(name_of(key));
        if (entry != nullptr) return entry->bytes;
        return bad_archive("the archive has no '" + name_of(key) + "', the storage of '" + user +
                           "'");
    }

    Status read(const std::string& key, Buffer& to) const override {
        SPLAT_TRY(size_of(key, key).status());
        return zip_.read(*zip_.find(name_of(key)), to);
    }

  private:
    /// Files of PyTorch before 2.1 do not record it; they are little-endian.
    Status check_byte_order() {
        const ZipEntry* entry = zip_.find(prefix_ + "/byteorder");
        if (entry == nullptr) return {};
        Buffer bytes;
        if (entry->bytes <= 16) SPLAT_TRY(zip_.read(*entry, bytes));
        return as_text(bytes) == "little" ? Status() : big_endian(std::string(as_text(bytes)));
    }

    [[nodiscard]] std::string name_of(const std::string& key) const {
        return prefix_ + "/data/" + key;
    }

    Zip zip_;
    std::string prefix_;
};

class LegacyPth : public PthArchive {
  public:
    Status open(const Source& source, DecodeBudget& budget) {
        source_ = &source;
        const std::uint64_t start = kMagicPickle.size();
        // Where the pickles end is known only once they are read.
        Buffer bytes(std::min<std::uint64_t>(source.size() - start, Pickle::kMaxBytes));
        SPLAT_TRY(source.read(start, bytes));
        SPLAT_ASSIGN(pickle_, in_pth(Pickle::read(std::move(bytes), budget, kLegacyPickles), ""));
        root_ = kSaved;
        SPLAT_TRY(check_machine());
        return find_storages(start + pickle_.size(), budget);
    }

    [[nodiscard]] Result<std::uint64_t> size_of(const std::string& key,
                                                const std::string& user) const override {
        const auto found = places_.find(key);
        if (found != places_.end()) return found->second.bytes;
        return bad_archive("the file has no storage '" + key + "', that of '" + user + "'");
    }

    Status read(const std::string& key, Buffer& to) const override {
        SPLAT_ASSIGN(const std::uint64_t bytes, size_of(key, key));
        to.resize(bytes);
        return source_->read(places_.at(key).start, to);
    }

  private:
    struct Place {
        std::uint64_t start = 0;
        std::uint64_t bytes = 0;
    };

    Status check_machine() {
        const PickleNode& protocol = pickle_.root(kProtocol);
        if (protocol.kind != Kind::kInt || protocol.integer != kLegacyProtocol)
            return unsupported("pth: a protocol other than %lld", lld(kLegacyProtocol));
        const PickleNode* little = pickle_.find(pickle_.root(kMachine), "little_endian");
        if (little == nullptr || little->kind != Kind::kBool)
            return bad_archive("it does not tell its byte order");
        return little->integer == 1 ? Status() : big_endian("big");
    }

    /// Bytes of an element, by the storages that the pickle names.
    Result<std::unordered_map<std::string, std::size_t>> elements() const {
        std::unordered_map<std::string, std::size_t> each;
        for (const PickleNode& node : pickle_.nodes()) {
            if (node.kind != Kind::kStorage) continue;
            SPLAT_ASSIGN(const NumberType type, Pickle::storage_type(pickle_[node.items[1]]));
            const std::string key(pickle_[node.items[2]].text);
            const auto [found, fresh] = each.emplace(key, type_bytes(type));
            if (!fresh && found->second != type_bytes(type))
                return bad_archive("the storage '" + key + "' has elements of two types");
        }
        return each;
    }

    Status find_storages(std::uint64_t at, DecodeBudget& budget) {
        SPLAT_ASSIGN(const auto each, elements());
        const PickleNode& keys = pickle_.root(kKeys);
        if (keys.kind != Kind::kList) return bad_archive("it does not list its storages");
        if (keys.items.size() > budget.limits().max_items)
            return bad_archive(format("%zu storages, the limit is %llu", keys.items.size(),
                                      llu(budget.limits().max_items)));
        for (const std::uint32_t item : keys.items) {
            const std::string key(pickle_[item].text);
            const auto found = each.find(key);
            if (found == each.end())
                return bad_archive("the storage '" + key + "' belongs to no tensor");
            std::byte count[sizeof(std::int64_t)];
            if (source_->size() - at < sizeof count) return cut_off(key);
            SPLAT_TRY(source_->read(at, count));
            at += sizeof count;
            const auto bytes = checked_mul(number<std::uint64_t>(count), found->second);
            if (!bytes || source_->size() - at < *bytes) return cut_off(key);
            if (!places_.emplace(key, Place{at, *bytes}).second)
                return bad_archive("the storage '" + key + "' is listed twice");
            at += *bytes;
        }
        if (at == source_->size()) return {};
        return bad_archive(format("%llu bytes follow the last storage", llu(source_->size() - at)));
    }

    static Status cut_off(const std::string& key) {
        return bad_archive("the file ends within the storage '" + key + "'");
    }

    const Source* source_ = nullptr;
    std::unordered_map<std::string, Place> places_;
};

template <class Archive>
Result<std::unique_ptr<PthArchive>> opened_pth(const Source& source, DecodeBudget& budget) {
    auto archive = std::make_unique<Archive>();
    SPLAT_TRY(archive->open(source, budget));
    return std::unique_ptr<PthArchive>(std::move(archive));
}

}  // namespace

Result<std::unique_ptr<PthArchive>> PthArchive::open(const Source& source, DecodeBudget& budget) {
    Buffer head(std::min<std::uint64_t>(source.size(), kMagicPickle.size()));
    SPLAT_TRY(source.read(0, head));
    return is_legacy_pth(head) ? opened_pth<LegacyPth>(source, budget)
                               : opened_pth<ZipPth>(source, budget);
}

bool is_pth_entry(const std::string& name) {
    return name.ends_with(kPickleName) && name.find('/') == name.size() - kPickleName.size();
}

bool is_legacy_pth(Bytes head) {
    return as_text(head).starts_with(kMagicPickle);
}

}  // namespace splat::io
