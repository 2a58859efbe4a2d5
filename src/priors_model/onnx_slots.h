#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace splat::priors_model {

// ONNX Runtime's C interface, version 11, as far as it is used: a table of functions whose places never
// change. Source: ONNX Runtime's header of its C API; tests/interop/onnx_slots.sh compares the places with another
// project's list.

extern "C" {
struct OrtStatus;
struct OrtEnv;
struct OrtSession;
struct OrtSessionOptions;
struct OrtRunOptions;
struct OrtMemoryInfo;
struct OrtValue;
struct OrtTypeInfo;
struct OrtTensorTypeAndShapeInfo;
struct OrtAllocator;

using OrtSlot = void (*)();

struct OrtApiBase {
    const OrtSlot* (*GetApi)(std::uint32_t version);
    const char* (*GetVersionString)();
};

using OrtGetApiBaseFunction = const OrtApiBase* (*)();
using OrtLogFunction = void (*)(void* user, int severity, const char* category, const char* id,
                                const char* code, const char* message);
}

inline constexpr std::uint32_t kOrtApiVersion = 11;

/// Element types.
inline constexpr int kOrtFloat = 1, kOrtInt64 = 7, kOrtHalf = 10;

/// Severity of messages: errors.
inline constexpr int kOrtLogError = 3;

/// SPLAT_ORT_SLOT(place, name, parameters): functions that return an OrtStatus*, null if they succeed.
#define SPLAT_ORT_CALLS(SPLAT_ORT_SLOT)                                                            \
    SPLAT_ORT_SLOT(4, CreateEnvWithCustomLogger,                                                   \
                   (OrtLogFunction, void* user, int severity, const char* id, OrtEnv**))           \
    SPLAT_ORT_SLOT(7, CreateSession,                                                               \
                   (const OrtEnv*, const char* path, const OrtSessionOptions*, OrtSession**))      \
    SPLAT_ORT_SLOT(                                                                                \
        9, Run,                                                                                    \
        (OrtSession*, const OrtRunOptions*, const char* const* input_names,                        \
         const OrtValue* const* inputs, std::size_t input_count, const char* const* output_names,  \
         std::size_t output_count, OrtValue** outputs))                                            \
    SPLAT_ORT_SLOT(10, CreateSessionOptions, (OrtSessionOptions**))                                \
    SPLAT_ORT_SLOT(19, DisableCpuMemArena, (OrtSessionOptions*))                                   \
    SPLAT_ORT_SLOT(24, SetIntraOpNumThreads, (OrtSessionOptions*, int))                            \
    SPLAT_ORT_SLOT(30, SessionGetInputCount, (const OrtSession*, std::size_t*))                    \
    SPLAT_ORT_SLOT(31, SessionGetOutputCount, (const OrtSession*, std::size_t*))                   \
    SPLAT_ORT_SLOT(33, SessionGetInputTypeInfo, (const OrtSession*, std::size_t, OrtTypeInfo**))   \
    SPLAT_ORT_SLOT(34, SessionGetOutputTypeInfo, (const OrtSession*, std::size_t, OrtTypeInfo**))  \
    SPLAT_ORT_SLOT(36, SessionGetInputName,                                                        \
                   (const OrtSession*, std::size_t, OrtAllocator*, char**))                        \
    SPLAT_ORT_SLOT(37, SessionGetOutputName,                                                       \
                   (const OrtSession*, std::size_t, OrtAllocator*, char**))                        \
    SPLAT_ORT_SLOT(49, CreateTensorWithDataAsOrtValue,                                             \
                   (const OrtMemoryInfo*, void* data, std::size_t bytes, const std::int64_t* dims, \
                    std::size_t rank, int type, OrtValue**))                                       \
    SPLAT_ORT_SLOT(50, IsTensor, (const OrtValue*, int*))                                          \
    SPLAT_ORT_SLOT(51, GetTensorMutableData, (OrtValue*, void**))                                  \
    SPLAT_ORT_SLOT(55, CastTypeInfoToTensorInfo,                                                   \
                   (const OrtTypeInfo*, const OrtTensorTypeAndShapeInfo**))                        \
    SPLAT_ORT_SLOT(60, GetTensorElementType, (const OrtTensorTypeAndShapeInfo*, int*))             \
    SPLAT_ORT_SLOT(61, GetDimensionsCount, (const OrtTensorTypeAndShapeInfo*, std::size_t*))       \
    SPLAT_ORT_SLOT(62, GetDimensions,                                                              \
                   (const OrtTensorTypeAndShapeInfo*, std::int64_t*, std::size_t))                 \
    SPLAT_ORT_SLOT(65, GetTensorTypeAndShape, (const OrtValue*, OrtTensorTypeAndShapeInfo**))      \
    SPLAT_ORT_SLOT(69, CreateCpuMemoryInfo, (int allocator, int memory, OrtMemoryInfo**))          \
    SPLAT_ORT_SLOT(76, AllocatorFree, (OrtAllocator*, void*))                                      \
    SPLAT_ORT_SLOT(78, GetAllocatorWithDefaultOptions, (OrtAllocator**))

/// The same of functions that return nothing.
#define SPLAT_ORT_RELEASES(SPLAT_ORT_SLOT)                                          \
    SPLAT_ORT_SLOT(92, ReleaseEnv, (OrtEnv*))                                       \
    SPLAT_ORT_SLOT(93, ReleaseStatus, (OrtStatus*))                                 \
    SPLAT_ORT_SLOT(94, ReleaseMemoryInfo, (OrtMemoryInfo*))                         \
    SPLAT_ORT_SLOT(95, ReleaseSession, (OrtSession*))                               \
    SPLAT_ORT_SLOT(96, ReleaseValue, (OrtValue*))                                   \
    SPLAT_ORT_SLOT(98, ReleaseTypeInfo, (OrtTypeInfo*))                             \
    SPLAT_ORT_SLOT(99, ReleaseTensorTypeAndShapeInfo, (OrtTensorTypeAndShapeInfo*)) \
    SPLAT_ORT_SLOT(100, ReleaseSessionOptions, (OrtSessionOptions*))

/// The functions that are used.
struct OrtApi {
#define SPLAT_ORT_CALL(place, name, parameters) OrtStatus*(*name)parameters = nullptr;
#define SPLAT_ORT_RELEASE(place, name, parameters) void(*name) parameters = nullptr;
    SPLAT_ORT_CALLS(SPLAT_ORT_CALL)
    SPLAT_ORT_RELEASES(SPLAT_ORT_RELEASE)
#undef SPLAT_ORT_CALL
#undef SPLAT_ORT_RELEASE
    const char* (*GetErrorMessage)(const OrtStatus*) = nullptr;
};

/// Name and place of every function of OrtApi.
struct OrtPlace {
    const char* name;
    std::size_t place;
};
std::span<const OrtPlace> ort_places();

/// The functions of a table.
OrtApi ort_api(const OrtSlot* table);

}  // namespace splat::priors_model
