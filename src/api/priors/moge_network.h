#pragma once

#include "api/core/device_object.h"
#include "prior_models/network.h"

namespace splat::api {

/// MoGe-2 of a file of weights, run by a device, with the inputs and outputs of its ONNX export. All tensors are
/// checked before the device is tested and used. Errors: those of io::load_weights() and vision::MogeModel, which name
/// the file; of the device.
Result<std::unique_ptr<prior_models::Network>> open_moge(DeviceObject& device,
                                                         const std::string& path);

}  // namespace splat::api
