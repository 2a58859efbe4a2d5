// write_onnx_samples FOLDER PRESET...: a small model with the interface of each preset, FOLDER/PRESET.onnx, and
// FOLDER/nan.onnx, a u2net whose output is not finite.
#include <string>

#include "prior_models/onnx/sample_models.h"

int main(int argc, char** argv) {
    if (argc < 2) return 2;
    const std::string folder = argv[1];
    for (int i = 2; i < argc; ++i)
        splat::test::sample_model(argv[i]).save(folder + "/" + argv[i] + ".onnx");
    splat::test::OnnxGraph nan;
    nan.input("x", splat::test::kOnnxFloat, {1, 3, 320, 320}).node("Sub", {"x", "x"}, "zero");
    nan.node("Div", {"zero", "zero"}, "y");
    nan.output("y", splat::test::kOnnxFloat, {1, 3, 320, 320});
    nan.save(folder + "/nan.onnx");
    return 0;
}
