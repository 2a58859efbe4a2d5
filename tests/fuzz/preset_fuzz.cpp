#include "prior_models/preset.h"

#include "fuzz/target.h"
#include "prior_models/prepare.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const auto read = prior_models::parse_preset(std::string(io::as_text(file)));
    if (!read.ok()) {
        fuzz::require(read.status().code() == Code::kInvalidArgument);
        return;
    }
    const prior_models::Preset& preset = read.value();
    fuzz::require(!preset.name.empty() && !preset.outputs.empty() && preset.maps() != 0);
    for (const prior_models::PresetOutput& output : preset.outputs)
        fuzz::require(preset.find(output.map) == &output);
    const prior_models::PresetInput& input = preset.input;
    for (const prior_models::Extent picture :
         {prior_models::Extent{1, 1}, {16384, 1}, {3, 16384}, {640, 480}}) {
        const auto size = prior_models::input_extent(input, picture);
        if (!size.ok()) continue;
        fuzz::require(size.value().width > 0 && size.value().height > 0);
        if (input.fit == prior_models::Fit::kStretch || input.fit == prior_models::Fit::kOwn)
            continue;
        fuzz::require(size.value().width % input.multiple == 0);
        fuzz::require(size.value().height % input.multiple == 0);
    }
}
