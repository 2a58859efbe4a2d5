#include "api/api_guard.h"
#include "core/log.h"
#include "data/co3d_prepare.h"

using namespace splat;

namespace {

Result<data::Co3dPreparation> preparation_of(const splat_co3d_desc* desc) {
    SPLAT_TRY(api::check_desc(desc, SPLAT_CO3D_STORED_POSES));
    SPLAT_TRY(api::require(desc->raw, "desc.raw", desc->out, "desc.out", desc->category,
                           "desc.category"));
    data::Co3dPreparation value;
    SPLAT_COPY(value, *desc, raw, out, category);
    if (desc->subset != nullptr) value.subset = desc->subset;
    if (desc->split != nullptr) value.split = desc->split;
    if (desc->size != 0) value.size = desc->size;
    value.limit = desc->limit;
    value.stored_poses = (desc->flags & SPLAT_CO3D_STORED_POSES) != 0;
    return value;
}

}  // namespace

splat_result splat_co3d_prepare(const splat_co3d_desc* desc, splat_co3d_info* info) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const data::Co3dPreparation preparation, preparation_of(desc));
        if (info != nullptr) SPLAT_TRY(api::check_fill(info, "info"));
        SPLAT_ASSIGN(const data::Co3dPrepared made,
                     data::prepare_co3d(preparation, [](std::size_t done, std::size_t all) {
                         log(LogLevel::kInfo, format("co3d: sequence %zu of %zu", done, all));
                     }));
        if (info == nullptr) return {};
        splat_co3d_info filled = {};
        SPLAT_COPY(filled, made, sequences, kept, left_out, frames);
        api::give(filled, info);
        return {};
    });
}
