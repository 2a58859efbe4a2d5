#include "priors_model/onnx_slots.h"

namespace splat::priors_model {
namespace {

constexpr std::size_t kGetErrorMessage = 2;

#define SPLAT_ORT_PLACE(place, name, parameters) {#name, place},
constexpr OrtPlace kPlaces[] = {{"GetErrorMessage", kGetErrorMessage},
                                SPLAT_ORT_CALLS(SPLAT_ORT_PLACE)
                                    SPLAT_ORT_RELEASES(SPLAT_ORT_PLACE)};
#undef SPLAT_ORT_PLACE

}  // namespace

std::span<const OrtPlace> ort_places() {
    return kPlaces;
}

OrtApi ort_api(const OrtSlot* table) {
    OrtApi api;
#define SPLAT_ORT_TAKE(place, name, parameters) \
    api.name = reinterpret_cast<decltype(api.name)>(table[place]);
    SPLAT_ORT_CALLS(SPLAT_ORT_TAKE)
    SPLAT_ORT_RELEASES(SPLAT_ORT_TAKE)
#undef SPLAT_ORT_TAKE
    api.GetErrorMessage = reinterpret_cast<decltype(api.GetErrorMessage)>(table[kGetErrorMessage]);
    return api;
}

}  // namespace splat::priors_model
