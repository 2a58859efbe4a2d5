// A library that is no ONNX Runtime.
#include "exported.h"

extern "C" SPLAT_EXPORTED int no_onnx_runtime() {
    return 0;
}
