#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "io/image.h"
#include "prior_models/finish.h"
#include "prior_models/network.h"

namespace splat::prior_models {

/// Opens a network of the library's own from a file of weights.
using OpenWeights = std::function<Result<std::unique_ptr<Network>>(const std::string& path)>;

struct PriorModelDesc {
    std::string preset;         ///< a name, or JSON; empty: by the model's file
    std::string model;          ///< ONNX file or weights; empty: the preset's in models_folder()
    std::string runtime;        ///< library; empty: see OnnxRuntime::load()
    std::uint32_t threads = 0;  ///< 0: one per core
    std::uint32_t tokens = 0;   ///< value of an input of tokens; 0: the preset's
    OpenWeights open_weights = {};
};

/// Something for each map of a picture that is wanted.
template <class T>
class PerMap {
  public:
    std::optional<T>& operator[](data::MapKind map) { return values_[place_of(map)]; }
    const std::optional<T>& operator[](data::MapKind map) const { return values_[place_of(map)]; }

  private:
    static std::size_t place_of(data::MapKind map) { return static_cast<std::size_t>(map) - 1; }
    std::optional<T> values_[std::size(data::kMaps)];
};
using WantedMaps = PerMap<MapForm>;
using PriorMaps = PerMap<PriorMap>;

/// A network that makes maps of pictures. Thread-safe.
class PriorModel {
  public:
    /// A file of weights (.safetensors, .pt, .pth) is opened by desc.open_weights, any other one by ONNX Runtime.
    ///
    /// Errors  those of OnnxRuntime::load() and OnnxSession::create(), or of open_weights; kNotFound for a preset or a
    ///         file, with what to do; kFormat, naming file, input or output, for a model of another interface, and for
    ///         the weights of another preset; kInvalidArgument for tokens where the preset has none
    static Result<std::unique_ptr<PriorModel>> create(const PriorModelDesc& desc);

    [[nodiscard]] const Preset& preset() const { return preset_; }
    [[nodiscard]] const Network& network() const { return *network_; }

    /// Sides of the input; 0: by the picture.
    [[nodiscard]] Extent input_size() const { return fixed_; }

    /// Maps of pictures of 8 bits, each of its picture's size. Pictures with inputs of one size run at
    /// once if the model takes several.
    ///
    /// Errors  kInvalidArgument for a map that the preset lacks, and without any; those of input_extent(),
    ///         Network::run() and finish()
    Result<std::vector<PriorMaps>> run(std::span<const io::Image> pictures,
                                       std::span<const WantedMaps> wanted) const;

  private:
    PriorModel(Preset preset, std::unique_ptr<Network> network)
        : preset_(std::move(preset)), network_(std::move(network)) {}
    Status check_input();
    Status check_outputs();
    [[nodiscard]] Status check_output(const PresetOutput& output, const NetworkPort& port) const;
    Result<std::size_t> output_place(const std::string& name, std::int32_t index) const;
    [[nodiscard]] Status check_wanted(const WantedMaps& wanted) const;
    Status run_batch(std::span<const io::Image> pictures, std::span<const WantedMaps> wanted,
                     Extent size, std::vector<PriorMaps>& all) const;

    /// Numbers of the outputs that a map is made of.
    struct Places {
        std::size_t main = 0;
        std::optional<std::size_t> scale, mask;
    };

    Preset preset_;
    std::unique_ptr<Network> network_;
    std::vector<Places> places_;  ///< places of the preset's outputs
    Extent fixed_;
    bool batches_ = false;  ///< the model takes any number of pictures
};

}  // namespace splat::prior_models
