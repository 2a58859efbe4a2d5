// Rows of parameters that are reordered, dropped and added, with their moments and averages.

#include <algorithm>

#include "ops/gather_rows.h"
#include "train/optimiser.h"

namespace splat::train {

Shape OptimiserParameter::shape_of(std::uint32_t rows) const {
    std::vector<std::int64_t> dims;
    for (std::uint32_t axis = 0; axis < shape.rank(); ++axis) dims.push_back(shape[axis]);
    if (!dims.empty()) dims[0] = rows;
    return Shape::create(dims, name).value();  // no more elements than the memory holds
}

vk::BufferView OptimiserParameter::rows_of(vk::BufferView view, std::uint32_t rows) const {
    view.shape = shape_of(rows);
    view.bytes = vk::quad_bytes(view.shape.elements());
    return view;
}

Status Optimiser::check_rows(std::span<const std::size_t> parameters,
                             std::span<const std::int64_t> rows) const {
    if (parameters.empty()) return invalid("optimizer: no parameters, expected at least one");
    const OptimiserParameter& first = desc_.parameters[parameters[0]];
    for (const std::size_t i : parameters) {
        const OptimiserParameter& parameter = desc_.parameters[i];
        if (parameter.block != 0)
            return unsupported("optimizer: '%s' belongs to a network, expected a tensor of rows",
                               parameter.name.c_str());
        if (parameter.rows() == first.rows() && parameter.capacity == first.capacity) continue;
        return error(Code::kShape,
                     "optimizer: '%s' has %u rows in use of %u, expected %u of %u as '%s'",
                     parameter.name.c_str(), parameter.rows(), parameter.capacity, first.rows(),
                     first.capacity, first.name.c_str());
    }
    if (rows.empty() || rows.size() > first.capacity)
        return invalid("optimizer: %zu rows, expected 1 to %u, as many as the tensors hold",
                       rows.size(), first.capacity);
    for (std::size_t i = 0; i < rows.size(); ++i)
        if (rows[i] != kNewRow && (rows[i] < 0 || rows[i] >= first.rows()))
            return invalid(
                "optimizer: rows[%zu] is %lld, expected one of the %u rows in use, or %lld "
                "for a new row",
                i, lld(rows[i]), first.rows(), lld(kNewRow));
    return {};
}

Result<vk::CommandList> Optimiser::record_gather(std::span<const std::size_t> parameters,
                                                 const vk::BufferView& rows,
                                                 const vk::BufferView& before) {
    vk::Recorder recorder(*context_);
    const std::uint32_t count = rows.shape[0];
    for (const std::size_t i : parameters) {
        const OptimiserParameter& parameter = desc_.parameters[i];
        const vk::BufferView value = parameter.rows_of(parameter.value, parameter.capacity);
        const vk::BufferView kept = parameter.rows_of(before, parameter.capacity);
        const ops::GatherRowsDesc desc{
            count, static_cast<std::uint32_t>(value.shape.elements() / parameter.capacity)};
        // The average of a new row is its value, which is in place by then.
        SPLAT_TRY(recorder.copy(value, kept));
        SPLAT_TRY(ops::gather_rows(recorder, desc, rows, kept, kept, value));
        for (const Kind& kind : kinds()) {
            const vk::BufferView all =
                parameter.rows_of((runs_[run_of_[i]].*kind.buffer).range(), parameter.capacity);
            const bool average = kind.buffer == &Run::average;
            SPLAT_TRY(recorder.copy(all, kept));
            SPLAT_TRY(ops::gather_rows(recorder, desc, rows, kept,
                                       average ? value : vk::BufferView(), all));
        }
    }
    return recorder.finish();
}

Status Optimiser::gather_rows(std::span<const std::size_t> parameters,
                              std::span<const std::int64_t> rows) {
    SPLAT_TRY(check_rows(parameters, rows));
    const std::vector<std::uint32_t> words(rows.begin(), rows.end());  // kNewRow as ops::kNewRow
    const auto count = static_cast<std::uint32_t>(rows.size());
    const auto make = [&](std::uint64_t bytes) {
        return context_->memory().allocate(bytes, vk::MemoryKind::kDevice, "rows of the optimiser");
    };
    std::uint64_t most = 0;
    for (const std::size_t i : parameters) most = std::max(most, runs_[run_of_[i]].m.bytes());
    SPLAT_ASSIGN(const vk::Buffer before, make(most));
    SPLAT_ASSIGN(const vk::Buffer index, make(words.size() * sizeof(std::uint32_t)));
    SPLAT_TRY(context_->write(index.range(), words.data(), words.size() * sizeof(std::uint32_t)));
    SPLAT_ASSIGN(vk::CommandList list,
                 record_gather(parameters, index.view({count}), before.range()));
    SPLAT_ASSIGN(Rows made,
                 make_rows(parameters, std::vector<std::uint32_t>(parameters.size(), count)));
    SPLAT_TRY(context_->make_ready(list));
    const vk::Uncancelled whole(context_->mutex);
    SPLAT_TRY(context_->run(list));
    use_rows(parameters, std::move(made));
    for (nn::Parameters* container : desc_.containers) container->changed();
    return {};
}

Result<Optimiser::Rows> Optimiser::make_rows(std::span<const std::size_t> parameters,
                                             std::span<const std::uint32_t> rows) {
    Rows made;
    made.runs = used();
    for (std::size_t i = 0; i < parameters.size(); ++i) {
        const OptimiserParameter& parameter = desc_.parameters[parameters[i]];
        Used& run = made.runs[run_of_[parameters[i]]];
        run.values = parameter.rows_of(parameter.value, rows[i]);
        run.grads = parameter.rows_of(parameter.grad, rows[i]);
        run.elements = run.values.shape.elements();
    }
    SPLAT_ASSIGN(made.list, record(made.runs));
    return made;
}

void Optimiser::use_rows(std::span<const std::size_t> parameters, Rows rows) noexcept {
    for (const std::size_t index : parameters) {
        OptimiserParameter& parameter = desc_.parameters[index];
        const Used& run = rows.runs[run_of_[index]];
        parameter.value = run.values;
        parameter.grad = run.grads;
        parameter.shape = run.values.shape;
        static_cast<Used&>(runs_[run_of_[index]]) = run;
    }
    list_ = std::move(rows.list);
}

}  // namespace splat::train
