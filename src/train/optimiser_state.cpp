// What an optimiser knows besides parameters and gradients: as tensors, as one file, and back.

#include <cmath>

#include "core/number_in.h"
#include "train/optimiser.h"

namespace splat::train {
namespace {

constexpr const char* kStateFormat = "libsplat optimizer state 1";
constexpr const char* kRowsKey =
    "rows:";  ///< before a parameter's name: its rows, if fewer than its capacity

/// nullptr: the metadata have no such key.
const std::string* find_text(const io::Metadata& metadata, const std::string& key) {
    for (const auto& [name, text] : metadata)
        if (name == key) return &text;
    return nullptr;
}

/// A number of the file's metadata. Errors: kInvalidArgument if there is none.
template <class Number>
Status take_number(const io::Metadata& metadata, const char* key, Number& number) {
    if (const std::string* text = find_text(metadata, key))
        if (const auto found = number_in<Number>(*text)) {
            number = *found;
            return {};
        }
    return invalid("optimizer state: no number '%s' in its metadata: the weights are no state",
                   key);
}

/// The rows in use that a state has of a parameter. Errors: kInvalidArgument.
Result<std::uint32_t> rows_in(const io::Metadata& metadata, const OptimiserParameter& parameter) {
    const std::string key = kRowsKey + parameter.name;
    if (find_text(metadata, key) == nullptr) return parameter.capacity;
    std::uint32_t rows = 0;
    SPLAT_TRY(take_number(metadata, key.c_str(), rows));
    if (rows > 0 && rows <= parameter.capacity && parameter.block == 0) return rows;
    return invalid("optimizer state: %u rows of '%s', expected 1 to %u: it is of another parameter",
                   rows, parameter.name.c_str(), parameter.capacity);
}

}  // namespace

Status Optimiser::read(const vk::BufferView& view, LargeVector<float>& values) {
    values.resize(view.shape.elements());
    return context_->read(view, values.data(), values.size() * sizeof(float));
}

Status Optimiser::read_average(const OptimiserParameter& parameter, LargeVector<float>& values) {
    const auto index = static_cast<std::size_t>(&parameter - desc_.parameters.data());
    const bool averaged = desc_.ema && steps_ > 0;
    return read(averaged ? part(index, &Run::average) : parameter.value, values);
}

Status Optimiser::save(io::NamedTensors& tensors) {
    for (std::size_t i = 0; i < desc_.parameters.size(); ++i) {
        for (const Kind& kind : kinds()) {
            io::NamedTensor tensor;
            tensor.name = kind.prefix + desc_.parameters[i].name;
            SPLAT_TRY(read(part(i, kind.buffer), tensor.values.own()));
            tensor.dims = {static_cast<std::int64_t>(tensor.values.size())};
            SPLAT_TRY(tensors.add(std::move(tensor)));
        }
    }
    return {};
}

std::vector<Optimiser::Kind> Optimiser::kinds() const {
    std::vector<Kind> kinds = {{"m:", &Run::m}, {"v:", &Run::v}};
    if (desc_.ema) kinds.push_back({"ema:", &Run::average});
    return kinds;
}

Status Optimiser::check(const io::WeightsFile& file) const {
    for (const OptimiserParameter& parameter : desc_.parameters) {
        SPLAT_ASSIGN(const std::uint32_t rows, rows_in(file.metadata, parameter));
        const std::uint64_t expected = parameter.shape_of(rows).elements();
        for (const Kind& kind : kinds()) {
            const io::NamedTensor* tensor = file.tensors.find(kind.prefix + parameter.name);
            if (tensor != nullptr && tensor->values.size() == expected) continue;
            return invalid(
                "checkpoint: '%s%s' %s, expected %llu numbers: it is of another "
                "configuration",
                kind.prefix, parameter.name.c_str(),
                tensor == nullptr ? "is missing" : "has another size", llu(expected));
        }
    }
    return {};
}

Status Optimiser::load(const io::WeightsFile& file, std::uint64_t steps) {
    SPLAT_TRY(check(file));
    std::vector<std::size_t> changed;
    std::vector<std::uint32_t> rows;
    for (std::size_t i = 0; i < desc_.parameters.size(); ++i) {
        SPLAT_ASSIGN(const std::uint32_t wanted, rows_in(file.metadata, desc_.parameters[i]));
        if (wanted == desc_.parameters[i].rows()) continue;
        changed.push_back(i);
        rows.push_back(wanted);
    }
    if (!changed.empty()) {
        SPLAT_ASSIGN(Rows made, make_rows(changed, rows));
        use_rows(changed, std::move(made));
    }
    for (std::size_t i = 0; i < desc_.parameters.size(); ++i) {
        for (const Kind& kind : kinds()) {
            const io::TensorValues& values =
                file.tensors.find(kind.prefix + desc_.parameters[i].name)->values;
            SPLAT_TRY(context_->write(part(i, kind.buffer), values.data(),
                                      values.size() * sizeof(float)));
        }
    }
    steps_ = steps;
    return {};
}

Result<io::WeightsFile> Optimiser::state() {
    io::WeightsFile file;
    SPLAT_TRY(save(file.tensors));
    file.metadata = {{"format", kStateFormat},
                     {"step", std::to_string(steps_)},
                     {"skipped", std::to_string(skipped_)},
                     {"rate", format("%.17g", desc_.schedule.learning_rate)}};
    for (const OptimiserParameter& parameter : desc_.parameters)
        if (parameter.rows() != parameter.capacity)
            file.metadata.emplace_back(kRowsKey + parameter.name, std::to_string(parameter.rows()));
    return file;
}

Status Optimiser::load_state(const io::WeightsFile& file) {
    const std::string* const format = find_text(file.metadata, "format");
    if (format == nullptr || *format != kStateFormat)
        return invalid(
            "optimizer state: the metadata have no format '%s': the weights are no state",
            kStateFormat);
    std::uint64_t steps = 0, skipped = 0;
    double rate = 0;
    SPLAT_TRY(take_number(file.metadata, "step", steps));
    SPLAT_TRY(take_number(file.metadata, "skipped", skipped));
    SPLAT_TRY(take_number(file.metadata, "rate", rate));
    if (!std::isfinite(rate) || rate < 0)
        return invalid("optimizer state: the rate is %g, expected a finite number of 0 or more",
                       rate);
    SPLAT_TRY(check(file));
    const std::size_t expected = kinds().size() * desc_.parameters.size();
    if (file.tensors.size() != expected)
        return invalid(
            "optimizer state: %zu tensors, expected %zu: it is of other parameters, or of "
            "an optimizer with averages",
            file.tensors.size(), expected);
    SPLAT_TRY(load(file, steps));
    skipped_ = skipped;
    set_rate(rate);
    return {};
}

Result<io::NamedTensors> Optimiser::averaged() {
    io::NamedTensors tensors;
    for (const OptimiserParameter& parameter : desc_.parameters) {
        io::NamedTensor tensor;
        tensor.name = parameter.name;
        SPLAT_TRY(read_average(parameter, tensor.values.own()));
        for (std::uint32_t i = 0; i < parameter.shape.rank(); ++i)
            tensor.dims.push_back(parameter.shape[i]);
        SPLAT_TRY(tensors.add(std::move(tensor)));
    }
    return tensors;
}

}  // namespace splat::train
