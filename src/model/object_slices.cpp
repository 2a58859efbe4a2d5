#include "model/object_slices.h"

namespace splat::model {
namespace {

/// Bytes of the shape: a buffer's range may be longer.
std::uint64_t bytes_of(const vk::BufferView& view) {
    return view.shape.elements() * sizeof(float);
}

vk::BufferView whole(const vk::BufferView& view) {
    return view.part(0, bytes_of(view));
}

vk::BufferView part_of(const vk::BufferView& all, std::uint32_t part, std::uint32_t count) {
    const std::uint64_t bytes = bytes_of(all) / count;
    return all.part(part * bytes, bytes);
}

}  // namespace

Result<std::unique_ptr<ObjectSlices>> ObjectSlices::create(vk::Context& context,
                                                           nn::Executor& executor,
                                                           const Ports& ports,
                                                           std::uint32_t count) {
    std::unique_ptr<ObjectSlices> made(new ObjectSlices(context, executor, count));
    for (const nn::ValueId id : ports.outputs) {
        SPLAT_ASSIGN(made->tensors_[id], made->join(executor.tensor(id)));
    }
    for (const nn::ValueId id : ports.graded_outputs) {
        SPLAT_ASSIGN(made->gradients_[id], made->join(executor.gradient(id)));
    }
    for (const nn::ValueId id : ports.graded_inputs)
        made->input_gradients_[id].resize(count * executor.gradient(id).shape.elements());
    for (std::uint32_t part = 0; part < count; ++part) {
        vk::Recorder gather(context);
        for (const auto& [id, all] : made->tensors_)
            SPLAT_TRY(gather.copy(whole(executor.tensor(id)), part_of(all.view, part, count)));
        vk::Recorder scatter(context);
        for (const auto& [id, all] : made->gradients_)
            SPLAT_TRY(scatter.copy(part_of(all.view, part, count), whole(executor.gradient(id))));
        SPLAT_ASSIGN(vk::CommandList gathers, gather.finish());
        SPLAT_ASSIGN(vk::CommandList scatters, scatter.finish());
        made->gather_.push_back(std::move(gathers));
        made->scatter_.push_back(std::move(scatters));
    }
    return made;
}

Result<ObjectSlices::Joined> ObjectSlices::join(const vk::BufferView& part) const {
    std::vector<std::int64_t> dims;
    for (std::uint32_t axis = 0; axis < part.shape.rank(); ++axis) dims.push_back(part.shape[axis]);
    dims[0] *= count_;
    SPLAT_ASSIGN(const Shape shape, Shape::create(dims, "a result of all objects"));
    Joined joined;
    SPLAT_ASSIGN(joined.buffer,
                 context_.memory().allocate(shape.elements() * sizeof(float),
                                            vk::MemoryKind::kDevice, "results of all objects"));
    joined.view = joined.buffer.view(shape);
    return joined;
}

void ObjectSlices::hold(nn::ValueId input, std::span<const std::byte> bytes) {
    SPLAT_ASSERT(bytes.size() == count_ * bytes_of(executor_.tensor(input)));
    inputs_[input].assign(bytes.begin(), bytes.end());
}

/// The forward pass of a part.
Status ObjectSlices::run(std::uint32_t part) {
    for (const auto& [id, bytes] : inputs_) {
        const std::size_t size = bytes.size() / count_;
        SPLAT_TRY(context_.write(executor_.tensor(id), bytes.data() + part * size, size));
    }
    return executor_.forward();
}

Status ObjectSlices::forward() {
    ran_ = false;
    for (std::uint32_t part = 0; part < count_; ++part) {
        SPLAT_TRY(run(part));
        SPLAT_TRY(context_.run(gather_[part]));
    }
    ran_ = true;
    return {};
}

Status ObjectSlices::backward() {
    if (!ran_)
        return error(
            Code::kInvalidState,
            "backward was called without a forward pass of its own: run forward before each");
    for (std::uint32_t part = count_; part-- > 0;) {
        if (part + 1 < count_) SPLAT_TRY(run(part));
        SPLAT_TRY(context_.run(scatter_[part]));
        const Status status = executor_.backward();
        if (status.code() != Code::kInvalidState)
            ran_ = false;  // refused: the activations are still valid
        SPLAT_TRY(status);
        for (auto& [id, all] : input_gradients_) {
            const vk::BufferView& from = executor_.gradient(id);
            SPLAT_TRY(
                context_.read(from, all.data() + part * from.shape.elements(), bytes_of(from)));
        }
    }
    return {};
}

}  // namespace splat::model
