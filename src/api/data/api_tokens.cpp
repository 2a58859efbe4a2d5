#include "api/api_guard.h"
#include "data/panoptic/mask_tokens.h"

using namespace splat;

namespace {

Result<data::MaskTokensDesc> tokens_of(const splat_tokens_desc* desc) {
    SPLAT_TRY(api::check_desc(desc, SPLAT_TOKENS_POOLED));
    SPLAT_TRY(api::require(desc->data, "desc.data", desc->masks, "desc.masks", desc->names,
                           "desc.names", desc->out, "desc.out"));
    data::MaskTokensDesc value;
    SPLAT_COPY(value, *desc, data, masks, names, out);
    if (desc->format != nullptr) value.format = desc->format;
    if (desc->category != nullptr) value.category = desc->category;
    value.pooled = (desc->flags & SPLAT_TOKENS_POOLED) != 0;
    if (value.pooled) value.dimension = 60;
    if (desc->dimension != 0) value.dimension = desc->dimension;
    if (desc->tokens != 0) value.tokens = desc->tokens;
    return value;
}

}  // namespace

splat_result splat_tokens_write(const splat_tokens_desc* desc, splat_tokens_info* info) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const data::MaskTokensDesc value, tokens_of(desc));
        if (info != nullptr) SPLAT_TRY(api::check_fill(info, "info"));
        SPLAT_ASSIGN(const data::MaskTokens made, data::write_mask_tokens(value));
        if (info == nullptr) return {};
        splat_tokens_info filled = {};
        SPLAT_COPY(filled, made, classes, objects, views, segments, dropped);
        api::give(filled, info);
        return {};
    });
}
