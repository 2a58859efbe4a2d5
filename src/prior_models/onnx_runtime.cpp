#include "prior_models/onnx_runtime.h"

#include <filesystem>
#include <vector>

#include "core/environment.h"
#include "core/log.h"
#include "core/os/library.h"
#include "core/os/path.h"

namespace splat::prior_models {
namespace {

namespace fs = std::filesystem;

#if defined(_WIN32)
constexpr const char* kLibraryNames[] = {"onnxruntime.dll"};
constexpr const char* kMember = "bin/napi-v6/win32/x64/onnxruntime.dll";
#else
constexpr const char* kLibraryNames[] = {"libonnxruntime.so.1", "libonnxruntime.so"};
#if defined(__aarch64__)
constexpr const char* kMember = "bin/napi-v6/linux/arm64/libonnxruntime.so.1";
#else
constexpr const char* kMember = "bin/napi-v6/linux/x64/libonnxruntime.so.1";
#endif
#endif

void log_message(void*, int, const char*, const char*, const char*, const char* message) {
    log(LogLevel::kDebug, std::string("ONNX Runtime: ") + message);
}

bool exists(const std::string& path) {
    std::error_code none;
    return fs::exists(os::path_of(path), none);
}

Status no_library() {
    return not_found(
        "ONNX Runtime, which runs these models, is not installed: run 'npm pack "
        "onnxruntime-node@1.30.0', take package/%s out of the .tgz, and put it into '%s', or "
        "name it in SPLAT_ONNXRUNTIME_LIBRARY",
        kMember, library_folder().c_str());
}

/// The file names to load, best first.
Result<std::vector<std::string>> candidates(const std::string& path) {
    for (const auto& [given, source] :
         {std::pair(path, "the library given"),
          std::pair(environment("SPLAT_ONNXRUNTIME_LIBRARY").value_or(""),
                    "SPLAT_ONNXRUNTIME_LIBRARY")}) {
        if (given.empty()) continue;
        if (!exists(given))
            return not_found("%s is '%s', but there is no such file", source, given.c_str());
        return std::vector<std::string>{given};
    }
    std::vector<std::string> names;
    for (const char* const name : kLibraryNames)
        if (const std::string beside = os::text_of(os::path_of(library_folder()) / name);
            exists(beside))
            names.push_back(beside);
    names.insert(names.end(), std::begin(kLibraryNames), std::end(kLibraryNames));
    return names;
}

}  // namespace

Status OnnxRuntime::check(OrtStatus* outcome, Code code, const std::string& what) const {
    if (outcome == nullptr) return {};
    std::string text = api_.GetErrorMessage(outcome);
    api_.ReleaseStatus(outcome);
    if (text.find("bad_alloc") != std::string::npos ||
        text.find("Failed to allocate memory") != std::string::npos)
        code = Code::kOutOfHostMemory;
    constexpr std::size_t kLongest = 300;
    text = text.substr(0, std::min(text.find('\n'), kLongest));
    return Status(code, what + ": " + text);
}

Result<std::shared_ptr<const OnnxRuntime>> OnnxRuntime::open(const std::string& path) {
    std::string failed;
    void* const library = os::load_library(path, failed);
    if (library == nullptr) return unsupported("cannot load ONNX Runtime: %s", failed.c_str());
    const auto get_base =
        reinterpret_cast<OrtGetApiBaseFunction>(os::function_of(library, "OrtGetApiBase"));
    if (get_base == nullptr)
        return unsupported("'%s' is no ONNX Runtime: it has no OrtGetApiBase", path.c_str());
    const OrtApiBase* const base = get_base();
    const OrtSlot* const table = base->GetApi(kOrtApiVersion);
    if (table == nullptr)
        return unsupported("'%s' is ONNX Runtime %s, expected 1.%u or later", path.c_str(),
                           base->GetVersionString(), kOrtApiVersion);
    std::shared_ptr<OnnxRuntime> runtime(new OnnxRuntime);
#define SPLAT_ORT_TAKE(place, result, name, parameters) \
    runtime->api_.name = reinterpret_cast<decltype(OrtApi::name)>(table[place]);
    SPLAT_ORT_SLOTS(SPLAT_ORT_TAKE)
#undef SPLAT_ORT_TAKE
    runtime->version_ = base->GetVersionString();
    SPLAT_TRY(runtime->check(runtime->api_.CreateEnvWithCustomLogger(
                                 log_message, nullptr, kOrtLogError, "libsplat", &runtime->env_),
                             Code::kUnsupported, "ONNX Runtime does not start"));
    return std::shared_ptr<const OnnxRuntime>(std::move(runtime));
}

Result<std::shared_ptr<const OnnxRuntime>> OnnxRuntime::load(const std::string& path) {
    SPLAT_ASSIGN(const std::vector<std::string> names, candidates(path));
    for (const std::string& name : names) {
        const bool file = os::name_start(name) != 0;
        auto runtime = open(name);
        // A bare name that the loader does not find is no error yet.
        if (runtime.ok() || file) return runtime;
        if (std::string none; os::load_library(name, none) != nullptr) return runtime;
    }
    return no_library();
}

OnnxRuntime::~OnnxRuntime() {
    if (env_ != nullptr) api_.ReleaseEnv(env_);
}

}  // namespace splat::prior_models
