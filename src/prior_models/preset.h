#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/status.h"
#include "data/dataset_reader.h"
#include "data/resample.h"

namespace splat::prior_models {

/// The size of a model's input.
enum class Fit {
    kStretch,     ///< width x height
    kMinimal,     ///< MiDaS: aspect kept, by the factor of the side that changes less
    kUpperBound,  ///< MiDaS: aspect kept, at most width x height
    kLowerBound,  ///< MiDaS: aspect kept, at least width x height
    kOwn,         ///< the picture's own
};

/// How a picture becomes the input: resampled, divided by `scale`, then (x - mean) / std, for RGB.
struct PresetInput {
    bool channels_last = false;  ///< NHWC, else NCHW
    Fit fit = Fit::kStretch;
    std::uint32_t width = 0, height = 0;
    std::uint32_t multiple = 1;  ///< both sides are multiples of it; not for kStretch and kOwn
    data::ValueFilter filter = data::ValueFilter::kPillowBilinear;
    bool by_maximum = false;  ///< the scale is the greatest sample of the resampled picture
    double scale = 255;
    std::array<double, 3> mean{}, std{1, 1, 1};
    std::int64_t tokens = 0;  ///< value of the second input, "num_tokens"; 0: there is none
};

/// What depth numbers mean.
enum class DepthOf {
    kInverse,   ///< larger is nearer, any scale
    kDistance,  ///< along the camera's axis, any scale
    kPoints,    ///< MoGe's: points whose depth lacks a shift
};

/// How one of the model's outputs becomes a map.
struct PresetOutput {
    data::MapKind map = data::MapKind::kMask;
    std::string name;            ///< name of the output; empty: `index`
    std::int32_t index = 0;      ///< number of the output; -1: the last
    bool channels_last = false;  ///< [height,width,channels], else [channels,height,width]
    std::uint32_t channel = 0;   ///< the first that is used
    bool sigmoid = false;
    bool min_max = false;  ///< masks: from the least to the greatest; depth always is
    DepthOf depth = DepthOf::kInverse;
    std::array<float, 3> signs{1, 1, 1};  ///< from the model's axes to x right, y down, z forward
    data::ValueFilter filter = data::ValueFilter::kCubic;
    bool bytes_first = false;               ///< reduced to 8 bits before it is resampled, not after
    std::optional<std::uint8_t> threshold;  ///< masks: above it 255, else 0
    std::string scale, mask;                ///< kPoints: names of these outputs; may be empty
};

/// Where a model's file can be had.
struct PresetFile {
    std::string name;
    std::string url;          ///< empty: none is known
    std::uint64_t bytes = 0;  ///< 0: not known
    std::string sha256;       ///< empty: not known
};

/// The interface of one kind of model, as data.
struct Preset {
    std::string name, title;
    PresetInput input;
    std::vector<PresetOutput> outputs;  ///< one output per map
    PresetFile file;
    std::string licence, note;

    [[nodiscard]] std::uint32_t maps() const;  ///< flags
    [[nodiscard]] const PresetOutput* find(data::MapKind map) const;
};

/// A preset from its JSON; README.md lists the members. Errors: kInvalidArgument, naming the preset and the member,
/// for members that are unknown, missing, or of a wrong kind or range.
Result<Preset> parse_preset(const std::string& text);

/// Names of the embedded presets, sorted.
std::vector<std::string> preset_names();

/// The JSON of an embedded preset. Errors: kNotFound, with the nearest name or all.
Result<std::string> preset_text(const std::string& name);

/// A preset by name, or from its JSON if `text` starts with '{'. Errors: as both.
Result<Preset> preset_of(const std::string& text);

/// The preset whose file has this name, or this name but for the extension. Errors: kNotFound.
Result<Preset> preset_of_file(const std::string& path);

/// Where models are looked for: $SPLAT_PRIORS_DIR, else $XDG_DATA_HOME/libsplat/priors, else
/// $HOME/.local/share/libsplat/priors, on Windows %LOCALAPPDATA%/libsplat/priors; empty if none is set.
std::string models_folder();

/// Where the preset's model is looked for: its file in models_folder(), or, where that is not and would be weights, the
/// same name with .safetensors, .pt or .onnx.
std::string preset_path(const Preset& preset);

}  // namespace splat::prior_models
