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
    for (const nn::ValueId id : ports.inputs)
        SPLAT_SET(made->inputs_[id], made->join(executor.tensor(id)));
    for (const nn::ValueId id : ports.outputs)
        SPLAT_SET(made->outputs_[id], made->join(executor.tensor(id)));
    for (const nn::ValueId id : ports.graded_outputs)
        SPLAT_SET(made->gradients_[id], made->join(executor.gradient(id)));
    for (const nn::ValueId id : ports.graded_inputs)
        SPLAT_SET(made->input_gradients_[id], made->join(executor.gradient(id)));
    for (std::uint32_t part = 0; part < count; ++part) SPLAT_TRY(made->record(part));
    return made;
}

Status ObjectSlices::record(std::uint32_t part) {
    const auto copy = [&](const std::map<nn::ValueId, Joined>& tensors, bool gradients, bool in,
                          vk::CommandList& list) -> Status {
        vk::Recorder recorder(context_);
        for (const auto& [id, all] : tensors) {
            const vk::BufferView own =
                whole(gradients ? executor_.gradient(id) : executor_.tensor(id));
            const vk::BufferView joined = part_of(all.view, part, count_);
            SPLAT_TRY(in ? recorder.copy(joined, own) : recorder.copy(own, joined));
        }
        SPLAT_ASSIGN(list, recorder.finish());
        return {};
    };
    Copies& lists = copies_.emplace_back();
    SPLAT_TRY(copy(inputs_, false, true, lists.inputs));
    SPLAT_TRY(copy(outputs_, false, false, lists.outputs));
    SPLAT_TRY(copy(gradients_, true, true, lists.gradients));
    return copy(input_gradients_, true, false, lists.input_gradients);
}

Result<ObjectSlices::Joined> ObjectSlices::join(const vk::BufferView& part) const {
    std::vector<std::int64_t> dims;
    for (std::uint32_t axis = 0; axis < part.shape.rank(); ++axis) dims.push_back(part.shape[axis]);
    dims[0] *= count_;
    SPLAT_ASSIGN(const Shape shape, Shape::create(dims, "a tensor of all objects"));
    Joined joined;
    SPLAT_ASSIGN(joined.buffer,
                 context_.memory().allocate(shape.elements() * sizeof(float),
                                            vk::MemoryKind::kDevice, "tensors of all objects"));
    joined.view = joined.buffer.view(shape);
    return joined;
}

/// The forward pass of a part.
Status ObjectSlices::run(std::uint32_t part) {
    SPLAT_TRY(context_.run(copies_[part].inputs));
    return executor_.forward();
}

Status ObjectSlices::forward() {
    ran_ = false;
    for (std::uint32_t part = 0; part < count_; ++part) {
        SPLAT_TRY(run(part));
        SPLAT_TRY(context_.run(copies_[part].outputs));
    }
    ran_ = true;
    return {};
}

Status ObjectSlices::backward(const nn::BetweenParts& between) {
    if (!ran_)
        return bad_state(
            "backward was called without a forward pass of its own: run forward before each");
    for (std::uint32_t part = count_; part-- > 0;) {
        if (part + 1 < count_) SPLAT_TRY(run(part));
        SPLAT_TRY(context_.run(copies_[part].gradients));
        const Status status = executor_.backward(part == 0 ? between : nn::BetweenParts());
        if (status.code() != Code::kInvalidState)
            ran_ = false;  // refused: the activations are still valid
        SPLAT_TRY(status);
        if (!input_gradients_.empty()) SPLAT_TRY(context_.run(copies_[part].input_gradients));
    }
    return {};
}

}  // namespace splat::model
