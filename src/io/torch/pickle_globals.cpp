#include "io/torch/pickle_globals.h"

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

}  // namespace splat::io
