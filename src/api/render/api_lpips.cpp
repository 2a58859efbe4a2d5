#include "api/api_guard.h"
#include "api/core/image_view.h"
#include "api/handles.h"
#include "core/finite.h"

using namespace splat;

namespace {

Status check_finite(const char* name, std::span<const float> values) {
    const std::size_t bad = find_not_finite(values);
    if (bad == values.size()) return {};
    return invalid("%s holds %g at %zu, expected finite numbers", name,
                   static_cast<double>(values[bad]), bad);
}

}  // namespace

splat_result splat_lpips_create(splat_device device, const splat_lpips_desc* desc,
                                splat_lpips* lpips) {
    const auto make = [&](const auto& owner) -> api::Lpipses::Made {
        SPLAT_TRY(api::check_desc(desc, 0));
        if (desc->weight_count == 0)
            return invalid("splat_lpips_desc.weight_count is 0, expected at least 1");
        SPLAT_TRY(api::require(desc->weights, "splat_lpips_desc.weights"));
        std::vector<std::shared_ptr<api::WeightsObject>> files;
        std::vector<const io::NamedTensors*> tensors;
        for (std::uint32_t i = 0; i < desc->weight_count; ++i) {
            SPLAT_ASSIGN(auto file,
                         api::Weights::find(desc->weights[i], format("weights[%u]", i).c_str()));
            tensors.push_back(&file->file.tensors);
            files.push_back(std::move(file));
        }
        SPLAT_TRY(owner->test(api::kNetworkKernels));
        auto object = std::make_shared<api::LpipsObject>(owner->context);
        object->side = desc->side;
        model::LpipsDesc wanted;
        wanted.side = desc->side;
        wanted.gradients = false;
        const std::lock_guard lock(object->context->mutex);
        SPLAT_TRY(object->context->device().alive());
        for (const io::NamedTensors* given : tensors) SPLAT_TRY(given->unchanged());
        SPLAT_ASSIGN(object->net, model::LpipsNet::create(*object->context, wanted, tensors));
        return object;
    };
    return api::create_of(device, lpips, make);
}

splat_result splat_lpips_compare(splat_lpips lpips, const splat_image* a, const splat_image* b,
                                 double* value) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const api::ImageView first, api::image_to_read(a, "a"));
        SPLAT_ASSIGN(const api::ImageView second, api::image_to_read(b, "b"));
        SPLAT_TRY(api::require(value, "value"));
        SPLAT_ASSIGN(const auto object, api::find(lpips));
        SPLAT_TRY(api::check_image_size(first, "a", object->side, object->side, 3));
        SPLAT_TRY(api::check_image_size(second, "b", object->side, object->side, 3));
        const std::vector<float> render = api::planes_of(first);
        const std::vector<float> target = api::planes_of(second);
        SPLAT_TRY(check_finite("a", render));
        SPLAT_TRY(check_finite("b", target));
        const std::lock_guard lock(object->context->mutex);
        SPLAT_ASSIGN(*value, object->net->compare(render, target));
        return {};
    });
}
