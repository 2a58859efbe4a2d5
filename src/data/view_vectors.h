#pragma once

#include <span>
#include <string>
#include <vector>

#include "data/dataset_reader.h"
#include "io/weights_file.h"

namespace splat::data {

/// Numbers for each view of each object, which a network takes besides images: embeddings, tokens.
///
/// The file is .safetensors or .npz (float32) and holds one array for each object: [views, shape...], in
/// the order of the data set's views. Its name is "split/object" ("train/000000_car") or, where the file
/// has no such array, the object's name. Other arrays are not used.
class ViewVectors {
  public:
    /// shape   of one view: {length} of an embedding, {token_dim, tokens} of tokens
    /// what    the configuration's key, for messages
    ///
    /// Errors  kNotFound for an object without an array, kShape for one of another shape,
    ///         kInvalidArgument for numbers that are not finite; those of io::load_weights()
    static Result<ViewVectors> load(const std::string& path, std::vector<std::int64_t> shape,
                                    const DatasetIndex& index, const char* what);

    /// Append the numbers of these views of an object of the index.
    void append(std::uint32_t object, std::span<const std::uint32_t> views,
                std::vector<float>& to) const;

  private:
    io::WeightsFile file_;
    std::vector<std::string> names_;  ///< names of the objects' arrays
    std::size_t length_ = 0;          ///< numbers per view
};

}  // namespace splat::data
