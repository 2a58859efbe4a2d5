#pragma once

#include "api/handles.h"

namespace splat::api {

/// The address of a tensor's elements for as long as it lives. Errors: kUnsupported.
Result<void*> host_pointer(const TensorObject& tensor);

/// A DLPack tensor of the same memory, which keeps the tensor alive until its deleter is called.
/// Errors: kUnsupported.
Result<DLManagedTensorVersioned*> dlpack_of(std::shared_ptr<TensorObject> tensor);

}  // namespace splat::api
