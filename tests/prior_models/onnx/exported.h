#pragma once

/// What a library that stands for an ONNX Runtime gives its callers.
#if defined(_WIN32)
#define SPLAT_EXPORTED __declspec(dllexport)
#else
#define SPLAT_EXPORTED __attribute__((visibility("default")))
#endif
