#include "vision/small_moge.h"

#include <cmath>

namespace splat::test {
namespace {

/// Adds tensors of random numbers.
class Writer {
  public:
    void add(const std::string& name, std::vector<std::int64_t> dims, float scale,
             float middle = 0) {
        std::int64_t count = 1;
        for (const std::int64_t dim : dims) count *= dim;
        std::vector<float> values;
        for (std::int64_t i = 0; i < count; ++i)
            values.push_back(middle + scale * std::sin(12.9898F * static_cast<float>(++drawn_)));
        (void)tensors.add({name, std::move(dims), io::NumberType::kF32, values});
    }
    /// A linear layer or convolution.
    void layer(const std::string& name, std::vector<std::int64_t> dims) {
        const std::int64_t out = dims[0];
        std::int64_t in = 1;
        for (std::size_t i = 1; i < dims.size(); ++i) in *= dims[i];
        add(name + ".weight", std::move(dims), 1.4F / std::sqrt(static_cast<float>(in)));
        add(name + ".bias", {out}, 0.1F);
    }
    void norm(const std::string& name, std::int64_t width) {
        add(name + ".weight", {width}, 0.2F, 1);
        add(name + ".bias", {width}, 0.1F);
    }

    io::NamedTensors tensors;

  private:
    int drawn_ = 0;
};

constexpr std::int64_t kWidth = 64, kBlocks = 2, kSide = 5;

void add_encoder(Writer& writer) {
    const std::string backbone = "encoder.backbone.";
    writer.add(backbone + "cls_token", {1, 1, kWidth}, 0.5F);
    writer.add(backbone + "pos_embed", {1, 1 + kSide * kSide, kWidth}, 0.3F);
    writer.add(backbone + "mask_token", {1, kWidth}, 0.1F);
    writer.layer(backbone + "patch_embed.proj", {kWidth, 3, 14, 14});
    for (int i = 0; i < kBlocks; ++i) {
        const std::string block = backbone + "blocks." + std::to_string(i) + ".";
        writer.norm(block + "norm1", kWidth);
        writer.layer(block + "attn.qkv", {3 * kWidth, kWidth});
        writer.layer(block + "attn.proj", {kWidth, kWidth});
        writer.add(block + "ls1.gamma", {kWidth}, 0.3F, 0.5F);
        writer.norm(block + "norm2", kWidth);
        writer.layer(block + "mlp.fc1", {2 * kWidth, kWidth});
        writer.layer(block + "mlp.fc2", {kWidth, 2 * kWidth});
        writer.add(block + "ls2.gamma", {kWidth}, 0.3F, 0.5F);
    }
    writer.norm(backbone + "norm", kWidth);
    for (int i = 0; i < kBlocks; ++i)
        writer.layer("encoder.output_projections." + std::to_string(i), {kWidth, kWidth, 1, 1});
    writer.add("encoder.image_mean", {1, 3, 1, 1}, 0.02F, 0.45F);
    writer.add("encoder.image_std", {1, 3, 1, 1}, 0.005F, 0.225F);
}

void add_stack(Writer& writer, const std::string& name, bool neck, std::int64_t out) {
    constexpr std::int64_t kWidths[] = {kWidth, 32, 16, 8, 8};
    constexpr int kLevels = 5;
    for (int l = 0; l < kLevels; ++l) {
        const std::string level = std::to_string(l);
        const std::int64_t c = kWidths[l];
        const std::int64_t in = !neck ? c : l == 0 ? c + 2 : 2;
        writer.layer(name + ".input_blocks." + level, {c, in, 1, 1});
        for (const char* conv : {"2", "5"})
            if (l == 1 || l == 2)
                writer.layer(name + ".res_blocks." + level + ".0.layers." + conv, {c, c, 3, 3});
        if (l + 1 == kLevels) break;
        const std::int64_t next = kWidths[l + 1];
        const std::string up = name + ".resamplers." + level;
        if (l + 2 < kLevels) {
            writer.add(up + ".0.weight", {c, next, 2, 2}, 1 / std::sqrt(static_cast<float>(c)));
            writer.add(up + ".0.bias", {next}, 0.1F);
        }
        writer.layer(up + ".1", {next, l + 2 < kLevels ? next : c, 3, 3});
    }
    if (!neck) writer.layer(name + ".output_blocks.4", {out, kWidths[kLevels - 1], 1, 1});
}

}  // namespace

io::NamedTensors small_moge(bool normals) {
    Writer writer;
    add_encoder(writer);
    add_stack(writer, "neck", true, 0);
    add_stack(writer, "points_head", false, 3);
    if (normals) add_stack(writer, "normal_head", false, 3);
    add_stack(writer, "mask_head", false, 1);
    writer.layer("scale_head.0", {kWidth, kWidth});
    writer.layer("scale_head.2", {1, kWidth});
    return writer.tensors;
}

io::NamedTensors without(const io::NamedTensors& tensors, const std::string& name) {
    io::NamedTensors made;
    for (const io::NamedTensor& tensor : tensors)
        if (tensor.name != name) (void)made.add(tensor);
    return made;
}

io::NamedTensors with(const io::NamedTensors& tensors, io::NamedTensor tensor) {
    io::NamedTensors made = without(tensors, tensor.name);
    (void)made.add(std::move(tensor));
    return made;
}

}  // namespace splat::test
