#pragma once

#include <memory>
#include <string>

#include "core/no_copy.h"
#include "core/status.h"
#include "prior_models/onnx_slots.h"

namespace splat::prior_models {

/// ONNX Runtime, loaded while the program runs. Sessions keep it alive; its library stays loaded.
/// Thread-safe.
class OnnxRuntime : NoCopy {
  public:
    /// The library `path`; empty: the first of $SPLAT_ONNXRUNTIME_LIBRARY, libonnxruntime.so.1 or
    /// libonnxruntime.so (Windows: onnxruntime.dll) beside this library, and the same names on the loader's path.
    ///
    /// Errors  kNotFound if there is none, with the way to get it; kUnsupported for one that cannot
    ///         be loaded, is no ONNX Runtime, or is older than 1.11
    static Result<std::shared_ptr<const OnnxRuntime>> load(const std::string& path);

    ~OnnxRuntime();

    [[nodiscard]] const OrtApi& api() const { return api_; }
    [[nodiscard]] const OrtEnv* env() const { return env_; }
    [[nodiscard]] const std::string& version() const { return version_; }  ///< "1.30.0"

    /// Take over the outcome of a call. Errors: `code` with "<what>: <the runtime's first line>";
    /// kOutOfHostMemory if that says so.
    Status check(OrtStatus* outcome, Code code, const std::string& what) const;

  private:
    OnnxRuntime() = default;
    static Result<std::shared_ptr<const OnnxRuntime>> open(const std::string& path);

    OrtApi api_;
    OrtEnv* env_ = nullptr;
    std::string version_;
};

}  // namespace splat::prior_models
