// A library that says it is an ONNX Runtime too old for us.
#include "priors_model/onnx_slots.h"

namespace {

const splat::priors_model::OrtSlot* no_table(std::uint32_t) {
    return nullptr;
}
const char* old_version() {
    return "1.2.3";
}

}  // namespace

extern "C" [[gnu::visibility("default")]] const splat::priors_model::OrtApiBase* OrtGetApiBase() {
    static const splat::priors_model::OrtApiBase base{no_table, old_version};
    return &base;
}
