#pragma once

#include <functional>
#include <string>

#include "model/song_unet.h"
#include "support/golden_file.h"
#include "vk/context.h"

namespace splat::test {

/// The layers of a network alone.
class Layers : public model::SongUnet {
  public:
    using SongUnet::block;
    using SongUnet::BlockShape;
    using SongUnet::conv;
    using SongUnet::embedding_;
    using SongUnet::graph_;
    using SongUnet::resample;
    using SongUnet::SongUnet;

    /// [N*H*W, 2C]: a recorded mask in place of dropout's generator, as scale and shift of each pixel.
    nn::ValueId mask = nn::kNoValue;

  protected:
    nn::ValueId dropout(nn::ValueId x, float p) override;
};

/// One case of a golden file: inputs and parameters `<name>.…`, see golden/net/INDEX.md.
struct GoldenLayer {
    const Golden& golden;
    std::string name;
    model::ModelConfig config = {};
    std::function<nn::ValueId(Layers&, nn::ValueId x)> build = {};
    model::Precision precision = model::Precision::kStrict;

    [[nodiscard]] std::string key(const char* what) const { return name + "." + what; }
};

/// Builds the layer, runs it forward and backward and compares y, d_x, d_emb and every d.<parameter>;
/// a parameter has a gradient exactly where the file holds one.
void expect_golden_layer(vk::Context& context, const GoldenLayer& layer);

}  // namespace splat::test
