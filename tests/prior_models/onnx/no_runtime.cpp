// A library that is no ONNX Runtime.

extern "C" [[gnu::visibility("default")]] int no_onnx_runtime() {
    return 0;
}
