#pragma once

#include "prior_models/network.h"
#include "prior_models/onnx_runtime.h"

namespace splat::prior_models {

/// An ONNX model, run by ONNX Runtime. Thread-safe.
class OnnxSession : public Network {
  public:
    /// threads: 0: one per core.
    ///
    /// Errors  kNotFound without the file; kFormat, naming it, for what the runtime refuses
    static Result<std::unique_ptr<OnnxSession>> create(std::shared_ptr<const OnnxRuntime> runtime,
                                                       const std::string& path,
                                                       std::uint32_t threads);

    ~OnnxSession() override;

    [[nodiscard]] const std::vector<NetworkPort>& inputs() const override { return inputs_; }
    [[nodiscard]] const std::vector<NetworkPort>& outputs() const override { return outputs_; }
    [[nodiscard]] const std::string& path() const override { return path_; }
    [[nodiscard]] const std::string& runtime_version() const override {
        return runtime_->version();
    }
    Result<std::vector<NetworkTensor>> run(const NetworkTensor& input, std::int64_t tokens,
                                           std::span<const std::size_t> wanted) const override;

  private:
    OnnxSession(std::shared_ptr<const OnnxRuntime> runtime, std::string path)
        : runtime_(std::move(runtime)), path_(std::move(path)) {}
    Status open(std::uint32_t threads);
    Status read_ports();
    Result<NetworkPort> read_port(std::size_t index, bool input) const;
    Result<NetworkTensor> read_output(OrtValue* value, const std::string& name) const;
    [[nodiscard]] Status check(OrtStatus* outcome, const char* what) const;

    std::shared_ptr<const OnnxRuntime> runtime_;
    std::string path_;
    OrtSession* session_ = nullptr;
    OrtMemoryInfo* memory_ = nullptr;
    std::vector<NetworkPort> inputs_, outputs_;
};

}  // namespace splat::prior_models
