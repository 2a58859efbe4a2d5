// A library that says it is an ONNX Runtime too old for us.
#include "exported.h"
#include "prior_models/onnx_slots.h"

namespace {

const splat::prior_models::OrtSlot* no_table(std::uint32_t) {
    return nullptr;
}
const char* old_version() {
    return "1.2.3";
}

}  // namespace

extern "C" SPLAT_EXPORTED const splat::prior_models::OrtApiBase* OrtGetApiBase() {
    static const splat::prior_models::OrtApiBase base{no_table, old_version};
    return &base;
}
