#pragma once

#include <cstddef>
#include <cstdint>

#include "core/os/path.h"

namespace splat::prior_models {

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
using OrtPathLetter = std::filesystem::path::value_type;

struct OrtApiBase {
    const OrtSlot* (*GetApi)(std::uint32_t version);
    const char* (*GetVersionString)();
};

using OrtGetApiBaseFunction = const OrtApiBase* (*)();
using OrtLogFunction = void (*)(void* user, int severity, const char* category, const char* id,
                                const char* code, const char* message);
}

inline constexpr std::uint32_t kOrtApiVersion = 11;

/// Severity of messages: errors.
inline constexpr int kOrtLogError = 3;

/// SPLAT_ORT_SLOT(place, result, name, parameters): the functions that are used. An OrtStatus* is null for success.
#define SPLAT_ORT_SLOTS(SPLAT_ORT_SLOT)                                                            \
    SPLAT_ORT_SLOT(2, const char*, GetErrorMessage, (const OrtStatus*))                            \
    SPLAT_ORT_SLOT(4, OrtStatus*, CreateEnvWithCustomLogger,                                       \
                   (OrtLogFunction, void* user, int severity, const char* id, OrtEnv**))           \
    SPLAT_ORT_SLOT(                                                                                \
        7, OrtStatus*, CreateSession,                                                              \
        (const OrtEnv*, const OrtPathLetter* path, const OrtSessionOptions*, OrtSession**))        \
    SPLAT_ORT_SLOT(                                                                                \
        9, OrtStatus*, Run,                                                                        \
        (OrtSession*, const OrtRunOptions*, const char* const* input_names,                        \
         const OrtValue* const* inputs, std::size_t input_count, const char* const* output_names,  \
         std::size_t output_count, OrtValue** outputs))                                            \
    SPLAT_ORT_SLOT(10, OrtStatus*, CreateSessionOptions, (OrtSessionOptions**))                    \
    SPLAT_ORT_SLOT(19, OrtStatus*, DisableCpuMemArena, (OrtSessionOptions*))                       \
    SPLAT_ORT_SLOT(24, OrtStatus*, SetIntraOpNumThreads, (OrtSessionOptions*, int))                \
    SPLAT_ORT_SLOT(30, OrtStatus*, SessionGetInputCount, (const OrtSession*, std::size_t*))        \
    SPLAT_ORT_SLOT(31, OrtStatus*, SessionGetOutputCount, (const OrtSession*, std::size_t*))       \
    SPLAT_ORT_SLOT(33, OrtStatus*, SessionGetInputTypeInfo,                                        \
                   (const OrtSession*, std::size_t, OrtTypeInfo**))                                \
    SPLAT_ORT_SLOT(34, OrtStatus*, SessionGetOutputTypeInfo,                                       \
                   (const OrtSession*, std::size_t, OrtTypeInfo**))                                \
    SPLAT_ORT_SLOT(36, OrtStatus*, SessionGetInputName,                                            \
                   (const OrtSession*, std::size_t, OrtAllocator*, char**))                        \
    SPLAT_ORT_SLOT(37, OrtStatus*, SessionGetOutputName,                                           \
                   (const OrtSession*, std::size_t, OrtAllocator*, char**))                        \
    SPLAT_ORT_SLOT(49, OrtStatus*, CreateTensorWithDataAsOrtValue,                                 \
                   (const OrtMemoryInfo*, void* data, std::size_t bytes, const std::int64_t* dims, \
                    std::size_t rank, int type, OrtValue**))                                       \
    SPLAT_ORT_SLOT(50, OrtStatus*, IsTensor, (const OrtValue*, int*))                              \
    SPLAT_ORT_SLOT(51, OrtStatus*, GetTensorMutableData, (OrtValue*, void**))                      \
    SPLAT_ORT_SLOT(55, OrtStatus*, CastTypeInfoToTensorInfo,                                       \
                   (const OrtTypeInfo*, const OrtTensorTypeAndShapeInfo**))                        \
    SPLAT_ORT_SLOT(60, OrtStatus*, GetTensorElementType, (const OrtTensorTypeAndShapeInfo*, int*)) \
    SPLAT_ORT_SLOT(61, OrtStatus*, GetDimensionsCount,                                             \
                   (const OrtTensorTypeAndShapeInfo*, std::size_t*))                               \
    SPLAT_ORT_SLOT(62, OrtStatus*, GetDimensions,                                                  \
                   (const OrtTensorTypeAndShapeInfo*, std::int64_t*, std::size_t))                 \
    SPLAT_ORT_SLOT(65, OrtStatus*, GetTensorTypeAndShape,                                          \
                   (const OrtValue*, OrtTensorTypeAndShapeInfo**))                                 \
    SPLAT_ORT_SLOT(69, OrtStatus*, CreateCpuMemoryInfo,                                            \
                   (int allocator, int memory, OrtMemoryInfo**))                                   \
    SPLAT_ORT_SLOT(76, OrtStatus*, AllocatorFree, (OrtAllocator*, void*))                          \
    SPLAT_ORT_SLOT(78, OrtStatus*, GetAllocatorWithDefaultOptions, (OrtAllocator**))               \
    SPLAT_ORT_SLOT(92, void, ReleaseEnv, (OrtEnv*))                                                \
    SPLAT_ORT_SLOT(93, void, ReleaseStatus, (OrtStatus*))                                          \
    SPLAT_ORT_SLOT(94, void, ReleaseMemoryInfo, (OrtMemoryInfo*))                                  \
    SPLAT_ORT_SLOT(95, void, ReleaseSession, (OrtSession*))                                        \
    SPLAT_ORT_SLOT(96, void, ReleaseValue, (OrtValue*))                                            \
    SPLAT_ORT_SLOT(98, void, ReleaseTypeInfo, (OrtTypeInfo*))                                      \
    SPLAT_ORT_SLOT(99, void, ReleaseTensorTypeAndShapeInfo, (OrtTensorTypeAndShapeInfo*))          \
    SPLAT_ORT_SLOT(100, void, ReleaseSessionOptions, (OrtSessionOptions*))

/// The functions that are used.
struct OrtApi {
#define SPLAT_ORT_MEMBER(place, result, name, parameters) result(*name) parameters = nullptr;
    SPLAT_ORT_SLOTS(SPLAT_ORT_MEMBER)
#undef SPLAT_ORT_MEMBER
};

}  // namespace splat::prior_models
