#include "io/network_kind.h"

#include "core/shown.h"

namespace splat::io {
namespace {

struct NetworkNames {
    const char* begin;  ///< how a name of the network's begins, and of none above
    const char* text;
};

constexpr NetworkNames kNetworks[] = {
    {"base_model.model.", "low-rank adapters"},
    {"network_with_offset.", "a SongUNet, as of Splatter Image or F3D-Gaus"},
    {"network_wo_offset.", "a SongUNet, as of Splatter Image or F3D-Gaus"},
    {"unet.conv_in.", "LGM"},
    {"encoder.backbone.", "MoGe-2"},
    {"backbone.blocks.", "MoGe-1"},
    {"pretrained.model.", "MiDaS"},
    {"blocks.0.attn.qkv.", "a vision transformer alone, as DINOv2"},
    {"features.0.", "VGG16, as of LPIPS"},
    {"net.slice1.", "LPIPS"},
};

}  // namespace

std::string network_text(const NamedTensors& tensors) {
    for (const NetworkNames& network : kNetworks)
        for (const NamedTensor& tensor : tensors)
            if (tensor.name.starts_with(network.begin)) return network.text;
    if (tensors.empty()) return "no network: the file has no tensors";
    return "a network that is not known here; its first tensor is '" + shown(tensors[0].name) + "'";
}

}  // namespace splat::io
