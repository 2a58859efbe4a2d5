#include "vision/moge_sizes.h"

#include <cmath>
#include <optional>

#include "core/json_tree.h"
#include "core/shown.h"
#include "io/network_kind.h"

namespace splat::vision {
namespace {

using io::NamedTensors;
using Dims = std::vector<std::int64_t>;

constexpr std::int64_t kMostSide = 65536;  ///< no axis of a weight is longer
constexpr std::uint32_t kMostLevels = 8;
constexpr std::uint32_t kHeadWidth = 64;

Result<BlockNorm> norm_of(const JsonTree& stack, const char* member, BlockNorm otherwise) {
    const std::string* const name = stack[member].text();
    if (name == nullptr) return otherwise;
    if (*name == "none") return BlockNorm::kNone;
    if (*name == "layer_norm") return BlockNorm::kLayer;
    if (*name == "group_norm") return BlockNorm::kGroup;
    return damaged("model_config: %s is '%s', expected none, layer_norm or group_norm", member,
                   shown(*name).c_str());
}

/// Errors: kFormat for a member that is there and is another text.
Status expect_text(const JsonTree& tree, const char* member, const char* expected) {
    const std::string* const text = tree[member].text();
    if (text == nullptr || *text == expected) return {};
    return damaged("model_config: %s is '%s', expected %s", member, shown(*text).c_str(), expected);
}

/// Shapes by name; the first error sticks.
class Shapes {
  public:
    explicit Shapes(const NamedTensors& tensors) : tensors_(tensors) {}

    [[nodiscard]] bool has(const std::string& name) const { return tensors_.find(name) != nullptr; }

    /// The shape of a tensor of this rank, each axis from 1 to kMostSide; ones after an error.
    Dims of(const std::string& name, std::size_t rank) {
        const io::NamedTensor* const tensor = tensors_.find(name);
        Dims ones(rank, 1);
        if (tensor == nullptr) return fail(damaged("tensor '%s' is missing", name.c_str())), ones;
        bool fits = tensor->dims.size() == rank;
        for (const std::int64_t side : tensor->dims) fits = fits && side >= 1 && side <= kMostSide;
        if (fits) return tensor->dims;
        fail(damaged("tensor '%s' has the shape %s, expected %zu axes of 1 to %lld", name.c_str(),
                     io::dims_text(tensor->dims).c_str(), rank, lld(kMostSide)));
        return ones;
    }

    std::uint32_t axis(const std::string& name, std::size_t rank, std::size_t axis) {
        return static_cast<std::uint32_t>(of(name, rank)[axis]);
    }

    /// How many of `begin`0`end`, `begin`1`end`, ... are there.
    [[nodiscard]] std::uint32_t count(const std::string& begin, const std::string& end) const {
        std::uint32_t n = 0;
        while (has(begin + std::to_string(n) + end)) ++n;
        return n;
    }

    void fail(Status status) {
        if (status_.ok()) status_ = std::move(status);
    }
    [[nodiscard]] const Status& status() const { return status_; }

  private:
    const NamedTensors& tensors_;
    Status status_;
};

VitSizes encoder_of(Shapes& shapes, const MogeConfig& config) {
    const std::string name = "encoder.backbone";
    VitSizes sizes;
    const Dims patch = shapes.of(name + ".patch_embed.proj.weight", 4);
    const Dims table = shapes.of(name + ".pos_embed", 3);
    sizes.width = static_cast<std::uint32_t>(patch[0]);
    sizes.patch = static_cast<std::uint32_t>(patch[3]);
    sizes.side =
        static_cast<std::uint32_t>(std::lround(std::sqrt(static_cast<double>(table[1] - 1))));
    if (std::int64_t{sizes.side} * sizes.side + 1 != table[1] || sizes.side == 0)
        shapes.fail(damaged("tensor '%s.pos_embed' has the shape %s, expected [1,1 + n^2,%u]",
                            name.c_str(), io::dims_text(table).c_str(), sizes.width));
    sizes.blocks = shapes.count(name + ".blocks.", ".norm1.weight");
    sizes.hidden = shapes.axis(name + ".blocks.0.mlp.fc1.weight", 2, 0);
    sizes.features = shapes.axis("encoder.output_projections.0.weight", 4, 0);
    sizes.heads = config.heads != 0 ? config.heads : std::max(1U, sizes.width / kHeadWidth);
    if (sizes.width % (4 * sizes.heads) != 0)
        shapes.fail(damaged("tokens of %u channels do not divide into %u heads of whole quads",
                            sizes.width, sizes.heads));
    const std::uint32_t taps = shapes.count("encoder.output_projections.", ".weight");
    sizes.taps = config.taps;
    if (sizes.taps.empty())
        for (std::uint32_t i = 0; i < taps; ++i)
            sizes.taps.push_back((i + 1) * sizes.blocks / taps - 1);
    bool rising = !sizes.taps.empty() && sizes.taps.back() < sizes.blocks;
    for (std::size_t i = 1; i < sizes.taps.size(); ++i)
        rising = rising && sizes.taps[i - 1] < sizes.taps[i];
    if (sizes.taps.size() != taps || !rising)
        shapes.fail(damaged(
            "%u projections of the outputs of blocks [%s], expected one for each, of "
            "%u blocks in their order",
            taps, joined(sizes.taps, [](std::uint32_t i) { return std::to_string(i); }).c_str(),
            sizes.blocks));
    return sizes;
}

StackSizes stack_of(Shapes& shapes, const std::string& name, const MogeConfig& config) {
    StackSizes stack;
    stack.name = name;
    const std::uint32_t levels = shapes.count(name + ".input_blocks.", ".weight");
    if (levels < 2 || levels > kMostLevels)
        shapes.fail(
            damaged("'%s' has %u levels, expected 2 to %u", name.c_str(), levels, kMostLevels));
    for (std::uint32_t l = 0; l < levels && shapes.status().ok(); ++l) {
        const std::string level = std::to_string(l);
        const Dims input = shapes.of(name + ".input_blocks." + level + ".weight", 4);
        stack.widths.push_back(static_cast<std::uint32_t>(input[0]));
        stack.inputs.push_back(static_cast<std::uint32_t>(input[1]));
        const std::string blocks = name + ".res_blocks." + level + ".";
        stack.blocks.push_back(shapes.count(blocks, ".layers.2.weight"));
        if (shapes.has(blocks + "0.layers.0.weight")) stack.in_norm = config.in_norm;
        if (shapes.has(blocks + "0.layers.3.weight")) stack.hidden_norm = config.hidden_norm;
        if (l + 1 == levels) break;
        stack.transposed.push_back(shapes.has(name + ".resamplers." + level + ".0.weight"));
    }
    if (name == "neck") return stack;
    stack.out =
        shapes.axis(name + ".output_blocks." + std::to_string(levels - 1) + ".weight", 4, 0);
    const std::uint32_t expected = name == "mask_head" ? 1 : 3;
    if (stack.out != expected)
        shapes.fail(
            damaged("'%s' gives %u channels, expected %u", name.c_str(), stack.out, expected));
    return stack;
}

/// Checks that stacks fit together: the heads' inputs are the neck's levels.
void check_stacks(Shapes& shapes, const MogeSizes& sizes) {
    std::vector<std::uint32_t> given(sizes.levels(), 2);  // coordinates
    if (!given.empty()) given[0] += sizes.encoder.features;
    const auto check = [&](const StackSizes& stack, const std::vector<std::uint32_t>& inputs) {
        if (stack.inputs == inputs) return;
        const auto text = [](std::uint32_t n) { return std::to_string(n); };
        shapes.fail(damaged("'%s' takes [%s] channels by level, expected [%s]", stack.name.c_str(),
                            joined(stack.inputs, text).c_str(), joined(inputs, text).c_str()));
    };
    check(sizes.neck, given);
    for (const StackSizes& head : sizes.heads) check(head, sizes.neck.widths);
}

}  // namespace

Result<MogeConfig> moge_config(const io::Metadata& metadata) {
    MogeConfig config;
    for (const auto& [key, text] : metadata) {
        if (key != "model_config") continue;
        const auto parsed = parse_json_tree(text, "model_config");
        if (!parsed.ok()) return damaged("%s", parsed.status().message().c_str());
        const JsonTree& tree = parsed.value();
        SPLAT_TRY(expect_text(tree, "remap_output", "exp"));
        const JsonTree& neck = tree["neck"];
        SPLAT_TRY(expect_text(neck, "activation", "relu"));
        SPLAT_ASSIGN(config.in_norm, norm_of(neck, "res_block_in_norm", config.in_norm));
        SPLAT_ASSIGN(config.hidden_norm,
                     norm_of(neck, "res_block_hidden_norm", config.hidden_norm));
        for (const JsonTree& kind : neck["resamplers"].items())
            if (kind.text() == nullptr ||
                (*kind.text() != "conv_transpose" && *kind.text() != "bilinear"))
                return damaged(
                    "model_config: resamplers holds %s, expected conv_transpose and bilinear",
                    kind.text() == nullptr ? "something other than texts"
                                           : shown(*kind.text()).c_str());
        for (const JsonTree& tap : tree["encoder"]["intermediate_layers"].items())
            config.taps.push_back(static_cast<std::uint32_t>(
                std::min<std::uint64_t>(tap.count().value_or(UINT32_MAX), UINT32_MAX)));
    }
    return config;
}

Result<MogeSizes> moge_sizes(const NamedTensors& tensors, const MogeConfig& config) {
    Shapes shapes(tensors);
    if (!shapes.has("encoder.backbone.pos_embed") ||
        !shapes.has("points_head.input_blocks.0.weight"))
        return damaged("not the weights of MoGe-2; they look like %s",
                       io::network_text(tensors).c_str());
    MogeSizes sizes;
    sizes.encoder = encoder_of(shapes, config);
    sizes.neck = stack_of(shapes, "neck", config);
    for (const char* name : {"points_head", "normal_head", "mask_head"})
        if (std::string(name) != "normal_head" || shapes.has("normal_head.input_blocks.0.weight"))
            sizes.heads.push_back(stack_of(shapes, name, config));
    for (int i = 0; shapes.has("scale_head." + std::to_string(i) + ".weight"); i += 2)
        sizes.scale.push_back(shapes.axis("scale_head." + std::to_string(i) + ".weight", 2, 0));
    if (sizes.scale.empty() || sizes.scale.back() != 1)
        shapes.fail(damaged("'scale_head' gives %u numbers, expected 1",
                            sizes.scale.empty() ? 0 : sizes.scale.back()));
    check_stacks(shapes, sizes);
    SPLAT_TRY(shapes.status());
    return sizes;
}

std::string moge_preset(const MogeSizes& sizes) {
    struct Published {
        const char* name;
        std::uint32_t width, blocks;
    };
    constexpr Published kPublished[] = {{"moge-2-vits-normal", 384, 12},
                                        {"moge-2-vitb-normal", 768, 12},
                                        {"moge-2-vitl-normal", 1024, 24}};
    constexpr std::size_t kHeads = 3;  // with normals
    for (const Published& row : kPublished)
        if (sizes.encoder.width == row.width && sizes.encoder.blocks == row.blocks &&
            sizes.heads.size() == kHeads)
            return row.name;
    return "";
}

}  // namespace splat::vision
