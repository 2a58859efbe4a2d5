// print_slots: name and place of every function of ONNX Runtime that is used.
#include <cstdio>

#include "priors_model/onnx_slots.h"

int main() {
    for (const splat::priors_model::OrtPlace& place : splat::priors_model::ort_places())
        std::printf("%s %zu\n", place.name, place.place);
    return 0;
}
