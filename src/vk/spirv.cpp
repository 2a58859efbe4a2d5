#include "vk/spirv.h"

#include <algorithm>
#include <map>
#include <optional>

namespace splat::vk {
namespace {

// Opcodes, decorations and enumerants of the SPIR-V specification, named as there.
enum Op : std::uint32_t {
    OpExecutionMode = 16,
    OpCapability = 17,
    OpTypeInt = 21,
    OpTypeFloat = 22,
    OpTypeVector = 23,
    OpTypeImage = 25,
    OpTypeSampledImage = 27,
    OpTypeArray = 28,
    OpTypeRuntimeArray = 29,
    OpTypeStruct = 30,
    OpTypePointer = 32,
    OpConstant = 43,
    OpVariable = 59,
    OpDecorate = 71,
    OpMemberDecorate = 72,
    OpAtomicFAddEXT = 6035,
};
enum Decoration : std::uint32_t {
    BuiltIn = 11,
    NonWritable = 24,
    NonReadable = 25,
    Binding = 33,
    DescriptorSet = 34,
    Offset = 35,
};
constexpr std::uint32_t kBuiltInNumWorkgroups = 24;
constexpr std::uint32_t kSignedZeroInfNanPreserve = 4461;
constexpr std::uint32_t kSignedZeroInfNanPreserveCapability = 4466;
enum StorageClass : std::uint32_t { UniformConstant = 0, PushConstant = 9, StorageBuffer = 12 };

struct Type {
    std::uint32_t op = 0;
    std::vector<std::uint32_t> operands;
};

struct Marks {  // decorations of one id, members included
    std::optional<std::uint32_t> binding;
    std::uint32_t set = 0;
    std::uint32_t members_readonly = 0;
    std::uint32_t members_writeonly = 0;
    bool readonly = false;
    bool writeonly = false;
    std::map<std::uint32_t, std::uint32_t> offsets;
};

struct Variable {
    std::uint32_t id;
    std::uint32_t type;
    std::uint32_t storage;
};

class Parser {
  public:
    explicit Parser(std::span<const std::uint32_t> words) : words_(words) {}

    Result<ShaderInterface> run() {
        constexpr std::uint32_t kSpirvMagic = 0x07230203;
        if (words_.size() < 5 || words_[0] != kSpirvMagic)
            return error(Code::kInternal, "not a SPIR-V module");
        for (std::size_t at = 5; at < words_.size();) {
            const std::uint32_t count = words_[at] >> 16;
            if (count == 0 || at + count > words_.size())
                return error(Code::kInternal, "SPIR-V is cut at word %zu", at);
            read(words_[at] & 0xFFFFU, words_.subspan(at + 1, count - 1));
            at += count;
        }
        for (const Variable& variable : variables_) SPLAT_TRY(add(variable));
        std::ranges::sort(out_.bindings, [](const ShaderBinding& a, const ShaderBinding& b) {
            return a.binding < b.binding;
        });
        out_.bindings.erase(std::unique(out_.bindings.begin(), out_.bindings.end()),
                            out_.bindings.end());
        for (std::uint32_t i = 0; i < out_.bindings.size(); ++i)
            if (out_.bindings[i].binding != i)
                return error(Code::kInternal,
                             "shader bindings have a gap before %u, or two meanings", i);
        return out_;
    }

  private:
    void read(std::uint32_t op, std::span<const std::uint32_t> args) {
        switch (op) {
            case OpDecorate:
                decorate(marks_[args[0]], args.subspan(1));
                break;
            case OpMemberDecorate:
                decorate_member(marks_[args[0]], args[1], args.subspan(2));
                break;
            case OpTypeInt:
            case OpTypeFloat:
            case OpTypeVector:
            case OpTypeImage:
            case OpTypeSampledImage:
            case OpTypeArray:
            case OpTypeRuntimeArray:
            case OpTypeStruct:
            case OpTypePointer:
                types_[args[0]] = {op, {args.begin() + 1, args.end()}};
                break;
            case OpConstant:
                constants_[args[1]] = args[2];
                break;
            case OpVariable:
                variables_.push_back({args[1], args[0], args[2]});
                break;
            case OpAtomicFAddEXT:
                out_.uses_float_atomics = true;
                break;
            default:
                break;
        }
    }

    void decorate(Marks& marks, std::span<const std::uint32_t> args) {
        switch (args[0]) {
            case Binding:
                marks.binding = args[1];
                break;
            case DescriptorSet:
                marks.set = args[1];
                break;
            case NonWritable:
                marks.readonly = true;
                break;
            case NonReadable:
                marks.writeonly = true;
                break;
            case BuiltIn:
                out_.uses_num_workgroups |= args[1] == kBuiltInNumWorkgroups;
                break;
            default:
                break;
        }
    }

    static void decorate_member(Marks& marks, std::uint32_t member,
                                std::span<const std::uint32_t> args) {
        if (args[0] == NonWritable) ++marks.members_readonly;
        if (args[0] == NonReadable) ++marks.members_writeonly;
        if (args[0] == Offset) marks.offsets[member] = args[1];
    }

    Status add(const Variable& variable) {
        const std::uint32_t pointee = types_[variable.type].operands.at(1);
        const Type& type = types_[pointee];
        const Marks& own = marks_[variable.id];
        if (variable.storage == PushConstant) {
            out_.push_bytes = struct_bytes(pointee);
            return {};
        }
        if (variable.storage != StorageBuffer && variable.storage != UniformConstant) return {};
        if (!own.binding || own.set != 0)
            return error(Code::kInternal, "a shader resource is outside descriptor set 0");
        ShaderBinding binding;
        binding.binding = *own.binding;
        if (variable.storage == UniformConstant) {
            if (type.op != OpTypeSampledImage)
                return error(Code::kInternal, "binding %u is not a texel buffer", *own.binding);
            const Type& image = types_[type.operands.at(0)];
            const Type& texel = types_[image.operands.at(0)];
            binding.type = texel.op != OpTypeInt       ? DescriptorType::kFloatTexelBuffer
                           : texel.operands.at(1) == 0 ? DescriptorType::kUintTexelBuffer
                                                       : DescriptorType::kIntQuadTexelBuffer;
            binding.writes = false;
        } else {
            const Marks& members = marks_[pointee];
            const auto count = static_cast<std::uint32_t>(type.operands.size());
            binding.writes = !own.readonly && members.members_readonly != count;
            binding.reads = !own.writeonly && members.members_writeonly != count;
        }
        out_.bindings.push_back(binding);
        return {};
    }

    std::uint32_t bytes(std::uint32_t id) {
        const Type& type = types_[id];
        switch (type.op) {
            case OpTypeInt:
            case OpTypeFloat:
                return type.operands.at(0) / 8;
            case OpTypeVector:
                return bytes(type.operands.at(0)) * type.operands.at(1);
            case OpTypeArray:
                return bytes(type.operands.at(0)) * constants_[type.operands.at(1)];
            case OpTypeStruct:
                return struct_bytes(id);
            default:
                return 0;
        }
    }

    std::uint32_t struct_bytes(std::uint32_t id) {
        const Type& type = types_[id];
        std::uint32_t end = 0;
        for (std::uint32_t i = 0; i < type.operands.size(); ++i)
            end = std::max(end, marks_[id].offsets[i] + bytes(type.operands[i]));
        return end;
    }

    std::span<const std::uint32_t> words_;
    std::map<std::uint32_t, Type> types_;
    std::map<std::uint32_t, Marks> marks_;
    std::map<std::uint32_t, std::uint32_t> constants_;
    std::vector<Variable> variables_;
    ShaderInterface out_;
};

}  // namespace

std::uint32_t ShaderInterface::storage_buffers() const {
    return static_cast<std::uint32_t>(
        std::ranges::count(bindings, DescriptorType::kStorageBuffer, &ShaderBinding::type));
}

Result<ShaderInterface> reflect(std::span<const std::uint32_t> words) {
    return Parser(words).run();
}

std::vector<std::uint32_t> without_nan_mode(std::span<const std::uint32_t> words) {
    std::vector<std::uint32_t> kept(words.begin(), words.begin() + 5);
    for (std::size_t at = 5; at < words.size(); at += words[at] >> 16) {
        const std::span instruction = words.subspan(at, words[at] >> 16);
        const std::uint32_t op = instruction[0] & 0xFFFFU;
        if (op == OpCapability && instruction[1] == kSignedZeroInfNanPreserveCapability) continue;
        if (op == OpExecutionMode && instruction[2] == kSignedZeroInfNanPreserve) continue;
        kept.insert(kept.end(), instruction.begin(), instruction.end());
    }
    return kept;
}

}  // namespace splat::vk
