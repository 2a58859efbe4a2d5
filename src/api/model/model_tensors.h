#pragma once

#include "api/handles.h"

namespace splat::api {

/// Memory of a model that a name of splat_model_tensor means.
struct ModelTensor {
    vk::BufferView view;  ///< the shape alone until bind_model_tensor()
    std::shared_ptr<vk::OutsideUse> use;
    bool of_pass = false;      ///< an output: undefined before the first pass
    bool of_backward = false;  ///< an input's gradient: undefined before the first backward pass
    vk::BufferView model::Model::Outputs::*rows = nullptr;  ///< the view is a part of these
    std::uint64_t offset = 0;                               ///< bytes of `rows` before the part
};

/// Errors: kNotFound, kInvalidArgument (no such object), kInvalidState (no such gradient is
/// computed), kUnsupported (the device cannot bind the object's part).
Result<ModelTensor> find_model_tensor(model::Model& network, std::uint32_t objects,
                                      const std::string& name);

/// Give a tensor of rows its memory. The first of them makes the rows, which each pass fills from then on. Errors:
/// those of Model::outputs.
Status bind_model_tensor(model::Model& network, ModelTensor& tensor);

/// Errors: kInvalidState before the first forward pass.
Status expect_ran(const ModelObject& object);

/// The outputs, in the order of splat_model_gradients, then "raw".
struct ModelOutput {
    const char* name;
    Shape shape;
    vk::BufferView model::Model::Outputs::*rows;  ///< nullptr for "raw", which has no gradient
};
std::vector<ModelOutput> model_outputs(const model::Model& network);

}  // namespace splat::api
