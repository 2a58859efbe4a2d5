// Trainer::checkpoint and resume: one file of weights with the whole state of a training.

#include "config/config_file.h"
#include "core/json.h"
#include "core/number_in.h"
#include "train/trainer.h"

namespace splat::train {
namespace {

constexpr const char* kFormat = "libsplat training state 1";

Result<std::uint64_t> number_of(const io::Metadata& metadata, const std::string& key) {
    for (const auto& [name, text] : metadata) {
        if (name != key) continue;
        if (const auto value = number_in<std::uint64_t>(text)) return *value;
    }
    return damaged("checkpoint: no number '%s' in its metadata: the file is not a training state",
                   key.c_str());
}

}  // namespace

Result<io::WeightsFile> Trainer::checkpoint() {
    SPLAT_TRY(read());
    io::WeightsFile file;
    SPLAT_ASSIGN(file.tensors, model::save_state(*model_));
    SPLAT_TRY(optimiser_->save(file.tensors));
    file.metadata = {{"format", kFormat},
                     {"step", std::to_string(optimiser_->steps())},
                     {"attempts", std::to_string(attempts_)},
                     {"crc32", std::to_string(io::crc32_of(file.tensors))},
                     {"config", config::merged_config_text({model_->config(), config_})}};
    return file;
}

Status Trainer::resume(const io::WeightsFile& file) {
    SPLAT_ASSIGN(const std::uint64_t steps, number_of(file.metadata, "step"));
    SPLAT_ASSIGN(const std::uint64_t attempts, number_of(file.metadata, "attempts"));
    SPLAT_ASSIGN(const std::uint64_t expected, number_of(file.metadata, "crc32"));
    const std::uint32_t sum = io::crc32_of(file.tensors);
    if (sum != expected)
        return damaged("checkpoint: its checksum is %08x, expected %08llx: the file is damaged",
                       sum, llu(expected));
    SPLAT_TRY(read());
    // The state of the optimiser does not belong to a state dict.
    io::NamedTensors weights;
    for (const io::NamedTensor& tensor : file.tensors)
        if (tensor.name.find(':') == std::string::npos) SPLAT_TRY(weights.add(tensor));
    SPLAT_TRY(optimiser_->check(file));
    model::LoadOptions options;
    options.take_rays = true;  // keep the rays that the training began with
    model::LoadReport report;
    SPLAT_TRY(model::load_state(*model_, weights, options, report));
    if (!report.fresh.empty())
        return damaged("checkpoint: '%s' is missing", report.fresh.front().c_str());
    SPLAT_TRY(optimiser_->load(file, steps));
    steps_ = steps;
    attempts_ = attempts_read_ = attempts;
    skipped_in_a_row_ = 0;
    return {};
}

}  // namespace splat::train
