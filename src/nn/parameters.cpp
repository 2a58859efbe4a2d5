#include "nn/parameters.h"

#include <algorithm>

#include "core/checked_math.h"

namespace splat::nn {
namespace {

/// Bytes of a block: within the smallest maxStorageBufferRange of desktop drivers (128 MiB), so that one
/// binding covers it.
constexpr std::uint64_t kBlockBytes = std::uint64_t{64} << 20;

struct Place {
    std::size_t block;
    std::uint64_t offset;
};

/// The parameters `members` one after another, in blocks of at most kBlockBytes (or of one parameter).
std::vector<Place> places_of(const std::vector<Parameter>& parameters,
                             const std::vector<std::size_t>& members, std::uint64_t alignment,
                             std::vector<std::uint64_t>& block_bytes) {
    std::vector<Place> places;
    for (const std::size_t i : members) {
        const std::uint64_t bytes =
            round_up(vk::quad_bytes(parameters[i].shape.elements()), alignment);
        if (block_bytes.empty() || block_bytes.back() + bytes > kBlockBytes)
            block_bytes.push_back(0);
        places.push_back({block_bytes.size() - 1, block_bytes.back()});
        block_bytes.back() += bytes;
    }
    return places;
}

vk::BufferView view_of(const vk::Buffer& block, std::uint64_t offset, const Shape& shape) {
    vk::BufferView view = block.range();
    view.offset += offset;
    view.bytes = vk::quad_bytes(shape.elements());
    view.shape = shape;
    return view;
}

}  // namespace

Result<Parameters> Parameters::create(vk::Context& context, const Graph& graph, bool gradients) {
    Parameters made(context);
    made.index_.resize(graph.values().size());
    for (std::size_t id = 0; id < graph.values().size(); ++id) {
        const Value& value = graph.values()[id];
        if (value.kind != ValueKind::kParameter) continue;
        const std::size_t root = graph.root(static_cast<ValueId>(id));
        if (root != id) {  // another shape of it
            made.index_[id] = made.index_[root];
            continue;
        }
        made.index_[id] = made.parameters_.size();
        made.parameters_.push_back({value.name, value.shape, value.trainable, {}, {}});
    }
    const std::uint64_t alignment = context.device().info().limits.offset_alignment;
    for (const bool graded : {true, false}) {
        std::vector<std::size_t> members;
        for (std::size_t i = 0; i < made.parameters_.size(); ++i)
            if ((gradients && made.parameters_[i].trainable) == graded) members.push_back(i);
        std::vector<std::uint64_t> bytes;
        const std::vector<Place> places = places_of(made.parameters_, members, alignment, bytes);
        // For each block its values, then its gradients.
        const std::size_t first = made.buffers_.size();
        const std::size_t copies = graded ? 2 : 1;
        for (const std::uint64_t size : bytes)
            for (std::size_t copy = 0; copy < copies; ++copy) {
                SPLAT_ASSIGN(vk::Buffer buffer,
                             context.memory().allocate(size, vk::MemoryKind::kDevice,
                                                       copy == 0 ? "parameters" : "gradients"));
                SPLAT_TRY(context.fill(buffer.range(), 0));
                made.buffers_.push_back(std::move(buffer));
            }
        for (std::size_t i = 0; i < members.size(); ++i) {
            Parameter& parameter = made.parameters_[members[i]];
            const std::size_t block = first + copies * places[i].block;
            parameter.value = view_of(made.buffers_[block], places[i].offset, parameter.shape);
            if (graded)
                parameter.grad =
                    view_of(made.buffers_[block + 1], places[i].offset, parameter.shape);
        }
        if (graded)
            for (std::size_t block = 0; block < bytes.size(); ++block)
                made.blocks_.push_back({made.buffers_[first + 2 * block].range(),
                                        made.buffers_[first + 2 * block + 1].range()});
    }
    return made;
}

const Parameter* Parameters::find(std::string_view name) const {
    const auto found =
        std::find_if(parameters_.begin(), parameters_.end(),
                     [&](const Parameter& parameter) { return parameter.name == name; });
    return found == parameters_.end() ? nullptr : &*found;
}

Status Parameters::write(const Parameter& parameter, std::span<const float> values) {
    SPLAT_ASSERT(values.size() == parameter.shape.elements());
    changed();
    return context_->write(parameter.value, values.data(), values.size_bytes());
}

Status Parameters::zero_gradients() {
    for (const ParameterBlock& block : blocks_) SPLAT_TRY(context_->fill(block.grads, 0));
    return {};
}

std::uint64_t Parameters::elements() const {
    std::uint64_t sum = 0;
    for (const Parameter& parameter : parameters_) sum += parameter.shape.elements();
    return sum;
}

}  // namespace splat::nn
