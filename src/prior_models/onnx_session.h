#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "prior_models/onnx_runtime.h"

namespace splat::prior_models {

/// What a model declares of an input or output.
struct OnnxPort {
    std::string name;
    int type = 0;                    ///< kOrtFloat, ...; 0: no tensor
    std::vector<std::int64_t> dims;  ///< -1: any
};

/// "float32 [1,3,?,?]"
std::string port_text(const OnnxPort& port);
std::string shape_text(std::span<const std::int64_t> dims);

/// Numbers with a shape, row-major.
struct OnnxTensor {
    std::vector<std::int64_t> dims;
    std::vector<float> values;
};

/// A model, ready to run. Thread-safe.
class OnnxSession : NoCopy {
  public:
    /// threads: 0: one per core.
    ///
    /// Errors  kNotFound without the file; kFormat, naming it, for what the runtime refuses
    static Result<std::unique_ptr<OnnxSession>> create(std::shared_ptr<const OnnxRuntime> runtime,
                                                       const std::string& path,
                                                       std::uint32_t threads);

    ~OnnxSession();

    [[nodiscard]] const std::vector<OnnxPort>& inputs() const { return inputs_; }
    [[nodiscard]] const std::vector<OnnxPort>& outputs() const { return outputs_; }
    [[nodiscard]] const OnnxRuntime& runtime() const { return *runtime_; }
    [[nodiscard]] const std::string& path() const { return path_; }

    /// Run with the first input, whose type may be float32 or float16; `tokens` goes to the second, of int64, if the
    /// model has one. Returns the outputs of these numbers.
    ///
    /// Errors  kFormat, naming file and output, for what the runtime refuses and for outputs that are not of
    ///         float32 or float16; kOutOfHostMemory
    Result<std::vector<OnnxTensor>> run(const OnnxTensor& input, std::int64_t tokens,
                                        std::span<const std::size_t> wanted) const;

  private:
    OnnxSession(std::shared_ptr<const OnnxRuntime> runtime, std::string path)
        : runtime_(std::move(runtime)), path_(std::move(path)) {}
    Status open(std::uint32_t threads);
    Status read_ports();
    Result<OnnxPort> read_port(std::size_t index, bool input) const;
    Result<OnnxTensor> read_output(OrtValue* value, const std::string& name) const;
    [[nodiscard]] Status check(OrtStatus* outcome, const char* what) const;

    std::shared_ptr<const OnnxRuntime> runtime_;
    std::string path_;
    OrtSession* session_ = nullptr;
    OrtMemoryInfo* memory_ = nullptr;
    std::vector<OnnxPort> inputs_, outputs_;
};

}  // namespace splat::prior_models
