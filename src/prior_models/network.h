#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/no_copy.h"
#include "core/status.h"

namespace splat::prior_models {

/// Element types, by ONNX's numbers.
inline constexpr int kOrtFloat = 1, kOrtInt64 = 7, kOrtHalf = 10;

/// What a network declares of an input or output.
struct NetworkPort {
    std::string name;
    int type = 0;                    ///< kOrtFloat, ...; 0: no tensor
    std::vector<std::int64_t> dims;  ///< -1: any
};

/// "float32 [1,3,?,?]"
std::string port_text(const NetworkPort& port);
std::string shape_text(std::span<const std::int64_t> dims);

/// Numbers with a shape, row-major.
struct NetworkTensor {
    std::vector<std::int64_t> dims;
    std::vector<float> values;
};

/// A network of a file, ready to run: an ONNX model, or one whose operators are the library's own. Thread-safe.
class Network : NoCopy {
  public:
    virtual ~Network() = default;

    [[nodiscard]] virtual const std::vector<NetworkPort>& inputs() const = 0;
    [[nodiscard]] virtual const std::vector<NetworkPort>& outputs() const = 0;
    [[nodiscard]] virtual const std::string& path() const = 0;

    /// Version of ONNX Runtime, "1.30.0"; empty for one of the library's own.
    [[nodiscard]] virtual const std::string& runtime_version() const = 0;

    /// The preset of the network by what the file holds; empty if that does not tell.
    [[nodiscard]] virtual std::string preset() const { return {}; }

    /// Run with the first input, whose type may be float32 or float16; `tokens` goes to the second, of int64, if the
    /// network has one. Returns the outputs of these numbers.
    ///
    /// Errors  kFormat, naming file and output, for what the network refuses and for outputs that are not of
    ///         float32 or float16; kOutOfHostMemory; of the library's own networks those of the device
    virtual Result<std::vector<NetworkTensor>> run(const NetworkTensor& input, std::int64_t tokens,
                                                   std::span<const std::size_t> wanted) const = 0;
};

}  // namespace splat::prior_models
