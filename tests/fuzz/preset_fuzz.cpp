#include "priors_model/preset.h"

#include "fuzz/target.h"
#include "priors_model/prepare.h"

namespace {

using namespace splat;

void check(io::Bytes file) {
    const auto read = priors_model::parse_preset(std::string(io::as_text(file)));
    if (!read.ok()) {
        fuzz::require(read.status().code() == Code::kInvalidArgument);
        return;
    }
    const priors_model::Preset& preset = read.value();
    fuzz::require(!preset.name.empty() && !preset.outputs.empty() && preset.maps() != 0);
    for (const priors_model::PresetOutput& output : preset.outputs)
        fuzz::require(preset.find(output.map) == &output);
    const priors_model::PresetInput& input = preset.input;
    for (const priors_model::Extent picture :
         {priors_model::Extent{1, 1}, {16384, 1}, {3, 16384}, {640, 480}}) {
        const auto size = priors_model::input_extent(input, picture);
        if (!size.ok()) continue;
        fuzz::require(size.value().width > 0 && size.value().height > 0);
        if (input.fit == priors_model::Fit::kStretch || input.fit == priors_model::Fit::kOwn)
            continue;
        fuzz::require(size.value().width % input.multiple == 0);
        fuzz::require(size.value().height % input.multiple == 0);
    }
}

}  // namespace

SPLAT_FUZZ_TARGET(check)
