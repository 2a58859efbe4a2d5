#pragma once

#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/tensor_file.h"

namespace splat::io {

/// A value of a pickle. The kind tells which members are used.
struct PickleNode {
    enum class Kind : std::uint8_t {
        kNone,
        kBool,     ///< integer
        kInt,      ///< integer
        kFloat,    ///< real
        kText,     ///< text, UTF-8 or not
        kBytes,    ///< text
        kList,     ///< items
        kTuple,    ///< items
        kDict,     ///< items: key, value, key, value, ...; a key may appear twice
        kGlobal,   ///< integer: its row in the allow-list; text: "module.name"
        kStorage,  ///< items of the persistent id: 'storage', type, key, location, elements
        kTensor,   ///< items: storage, offset, size, stride, ...
        kDtype,    ///< text: NumPy's letter and size, e.g. "f8"
        kObject,   ///< an object of a class that is not run; its attributes are left out
    };

    Kind kind = Kind::kNone;
    std::int64_t integer = 0;
    double real = 0;
    std::string_view text = {};
    std::vector<std::uint32_t> items = {};  ///< numbers of nodes
};

/// The values of a Python pickle, of the kinds that torch.save() writes. Nodes refer to each other by
/// number, so cycles and deep nesting are harmless.
class Pickle {
  public:
    using Kind = PickleNode::Kind;

    /// Reads pickles of protocol 2 to 4 that follow each other, without running any of it: a global off the allow-list
    /// (tensors, storages, OrderedDict, torch.Size, scalars of NumPy, the configuration that published trainers saved
    /// too) is refused by name, called or not, as is every opcode that a state dict does not need.
    ///
    /// Errors       kUnsupported with the global or the opcode; kFormat with the byte, for
    ///              a pickle that is damaged or exceeds the budget, kMaxBytes, kMaxNodes or kMaxMarks
    /// Source       Python's pickletools.py, which describes the opcodes
    static Result<Pickle> read(Buffer bytes, DecodeBudget& budget, std::size_t count = 1);

    static constexpr std::size_t kMaxBytes = 64U << 20U;
    static constexpr std::size_t kMaxNodes = 4U << 20U;
    static constexpr std::size_t kMaxMarks = 256;

    [[nodiscard]] const PickleNode& root(std::size_t i = 0) const { return nodes_[roots_[i]]; }
    [[nodiscard]] const PickleNode& operator[](std::uint32_t node) const { return nodes_[node]; }
    [[nodiscard]] std::span<const PickleNode> nodes() const { return nodes_; }
    [[nodiscard]] std::size_t size() const {
        return size_;
    }  ///< bytes up to the end of the last one

    /// The last value of this key, nullptr if there is none, or `dict` is none.
    [[nodiscard]] const PickleNode* find(const PickleNode& dict, std::string_view key) const {
        if (dict.kind != Kind::kDict) return nullptr;
        for (std::size_t i = dict.items.size(); i >= 2; i -= 2) {
            const PickleNode& name = nodes_[dict.items[i - 2]];
            if (name.kind == Kind::kText && name.text == key) return &nodes_[dict.items[i - 1]];
        }
        return nullptr;
    }

    /// The numbers that a storage type of the allow-list holds. Errors: kUnsupported for
    /// another node.
    static Result<NumberType> storage_type(const PickleNode& global);

  private:
    friend class Unpickler;

    Buffer bytes_;
    std::deque<std::string> texts_;  // texts that are not in bytes_
    std::vector<PickleNode> nodes_;
    std::vector<std::uint32_t> roots_;
    std::size_t size_ = 0;
};

/// "a number", "a list", ...; for messages.
const char* kind_name(PickleNode::Kind kind);

}  // namespace splat::io
