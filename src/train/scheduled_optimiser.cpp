#include "train/scheduled_optimiser.h"

#include <charconv>
#include <cmath>

namespace splat::train {
namespace {

constexpr const char* kStateFormat = "libsplat optimizer state 1";

/// A number of the file's metadata. Errors: kInvalidArgument if there is none.
template <class Number>
Status take_number(const io::Metadata& metadata, const char* key, Number& number) {
    for (const auto& [name, text] : metadata) {
        if (name != key) continue;
        const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), number);
        if (failed == std::errc() && end == text.data() + text.size()) return {};
    }
    return error(Code::kInvalidArgument,
                 "optimizer state: no number '%s' in its metadata: the weights are no state", key);
}

Status check_format(const io::Metadata& metadata) {
    for (const auto& [name, text] : metadata)
        if (name == "format" && text == kStateFormat) return {};
    return error(Code::kInvalidArgument,
                 "optimizer state: the metadata have no format '%s': the weights are no state",
                 kStateFormat);
}

}  // namespace

Status ScheduledOptimiser::step(ScheduledStep& result) {
    ScheduledStep made;
    made.rate = rate();
    SPLAT_ASSIGN(made.gradients, optimiser_.measure_gradients());
    made.was_skipped = made.gradients.non_finite > 0;
    if (made.was_skipped)
        ++skipped_;
    else
        SPLAT_TRY(optimiser_.step(made.rate));
    made.step = optimiser_.steps();
    made.skipped = skipped_;
    result = made;
    return {};
}

Result<io::WeightsFile> ScheduledOptimiser::state() {
    io::WeightsFile file;
    SPLAT_TRY(optimiser_.save(file.tensors));
    file.metadata = {{"format", kStateFormat},
                     {"step", std::to_string(optimiser_.steps())},
                     {"skipped", std::to_string(skipped_)},
                     {"rate", format("%.17g", schedule_.learning_rate)}};
    return file;
}

Status ScheduledOptimiser::load(const io::WeightsFile& file) {
    SPLAT_TRY(check_format(file.metadata));
    std::uint64_t steps = 0, skipped = 0;
    double rate = 0;
    SPLAT_TRY(take_number(file.metadata, "step", steps));
    SPLAT_TRY(take_number(file.metadata, "skipped", skipped));
    SPLAT_TRY(take_number(file.metadata, "rate", rate));
    if (!std::isfinite(rate) || rate < 0)
        return error(Code::kInvalidArgument,
                     "optimizer state: the rate is %g, expected a finite number of 0 or more",
                     rate);
    SPLAT_TRY(optimiser_.check(file.tensors));
    const std::size_t each = optimiser_.averages() ? 3 : 2;
    const std::size_t expected = each * optimiser_.parameters().size();
    if (file.tensors.size() != expected)
        return error(Code::kInvalidArgument,
                     "optimizer state: %zu tensors, expected %zu: it is of other parameters, or of "
                     "an optimizer with averages",
                     file.tensors.size(), expected);
    SPLAT_TRY(optimiser_.load(file.tensors, steps));
    skipped_ = skipped;
    schedule_.learning_rate = rate;
    return {};
}

Result<io::NamedTensors> ScheduledOptimiser::averages() {
    io::NamedTensors tensors;
    for (const OptimiserParameter& parameter : optimiser_.parameters()) {
        io::NamedTensor tensor;
        tensor.name = parameter.name;
        SPLAT_TRY(optimiser_.read_average(parameter, tensor.values.own()));
        for (std::uint32_t i = 0; i < parameter.shape.rank(); ++i)
            tensor.dims.push_back(parameter.shape[i]);
        SPLAT_TRY(tensors.add(std::move(tensor)));
    }
    return tensors;
}

}  // namespace splat::train
