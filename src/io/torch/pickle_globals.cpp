#include "io/torch/pickle_globals.h"

#include "io/reader.h"

namespace splat::io {
namespace {

constexpr PickleGlobal kPickleGlobals[] = {
    {"torch._utils._rebuild_tensor_v2", PickleRole::kTensor},
    {"torch._utils._rebuild_tensor", PickleRole::kTensor},  // before PyTorch 0.4
    {"torch._utils._rebuild_parameter", PickleRole::kParameter},
    {"torch.nn.parameter.Parameter", PickleRole::kParameter},  // before PyTorch 0.4
    {"collections.OrderedDict", PickleRole::kDict},
    {"torch.Size", PickleRole::kSize},
    {"_codecs.encode", PickleRole::kEncode},
    {"numpy.dtype", PickleRole::kDtype},
    {"numpy.core.multiarray.scalar", PickleRole::kScalar},
    {"numpy._core.multiarray.scalar", PickleRole::kScalar},
    // The published trainer saved the betas of Adam as a node of its OmegaConf configuration, and with it all of the
    // configuration.
    {"collections.defaultdict", PickleRole::kDefaultDict},
    {"omegaconf.dictconfig.DictConfig", PickleRole::kObject},
    {"omegaconf.listconfig.ListConfig", PickleRole::kObject},
    {"omegaconf.nodes.AnyNode", PickleRole::kObject},
    {"omegaconf.base.Metadata", PickleRole::kObject},
    {"omegaconf.base.ContainerMetadata", PickleRole::kObject},
    {"typing.Any", PickleRole::kType},
    {"__builtin__.dict", PickleRole::kType},
    {"__builtin__.list", PickleRole::kType},
    {"__builtin__.long", PickleRole::kType},
    {"torch.FloatStorage", PickleRole::kStorageType, NumberType::kF32},
    {"torch.DoubleStorage", PickleRole::kStorageType, NumberType::kF64},
    {"torch.HalfStorage", PickleRole::kStorageType, NumberType::kF16},
    {"torch.BFloat16Storage", PickleRole::kStorageType, NumberType::kBf16},
    {"torch.LongStorage", PickleRole::kStorageType, NumberType::kI64},
    {"torch.IntStorage", PickleRole::kStorageType, NumberType::kI32},
    {"torch.ShortStorage", PickleRole::kStorageType, NumberType::kI16},
    {"torch.CharStorage", PickleRole::kStorageType, NumberType::kI8},
    {"torch.ByteStorage", PickleRole::kStorageType, NumberType::kU8},
    {"torch.BoolStorage", PickleRole::kStorageType, NumberType::kBool},
};

}  // namespace

std::span<const PickleGlobal> pickle_globals() {
    return kPickleGlobals;
}

std::optional<std::string> latin1(std::string_view text) {
    std::string bytes;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto lead = static_cast<unsigned char>(text[i]);
        if (lead < 0x80) {
            bytes += text[i];
        } else if ((lead == 0xC2 || lead == 0xC3) && i + 1 < text.size()) {
            const auto low = static_cast<unsigned char>(text[++i]);
            bytes += static_cast<char>((lead & 3U) << 6U | (low & 0x3FU));
        } else {
            return std::nullopt;
        }
    }
    return bytes;
}

std::optional<PickleNode> numpy_scalar(std::string_view type, Bytes data) {
    PickleNode value;
    value.kind = type == "i8" ? PickleNode::Kind::kInt : PickleNode::Kind::kFloat;
    if (type == "f8" && data.size() == 8)
        value.real = number<double>(data.data());
    else if (type == "f4" && data.size() == 4)
        value.real = static_cast<double>(number<float>(data.data()));
    else if (type == "i8" && data.size() == 8)
        value.integer = number<std::int64_t>(data.data());
    else
        return std::nullopt;
    return value;
}

Result<NumberType> Pickle::storage_type(const PickleNode& global) {
    const auto row = static_cast<std::size_t>(global.integer);
    if (global.kind == PickleNode::Kind::kGlobal &&
        pickle_globals()[row].role == PickleRole::kStorageType)
        return pickle_globals()[row].type;
    return unsupported("pickle: '%s' is not a storage type", std::string(global.text).c_str());
}

const char* kind_name(PickleNode::Kind kind) {
    constexpr const char* kNames[] = {"None",      "a bool",   "a number", "a number", "a text",
                                      "a text",    "a list",   "a tuple",  "a dict",   "a type",
                                      "a storage", "a tensor", "a type",   "an object"};
    return kNames[static_cast<std::size_t>(kind)];
}

}  // namespace splat::io
