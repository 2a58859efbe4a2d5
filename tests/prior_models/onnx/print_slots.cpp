// print_slots: name and place of every function of ONNX Runtime that is used.
#include <cstdio>

#include "prior_models/onnx_slots.h"

int main() {
#define SPLAT_PRINT(place, result, name, parameters) std::printf("%s %d\n", #name, place);
    SPLAT_ORT_SLOTS(SPLAT_PRINT)
#undef SPLAT_PRINT
    return 0;
}
