#include "api/api_guard.h"
#include "core/decode_budget.h"

namespace api = splat::api;

splat_result splat_decode_set_limits(const splat_decode_limits* limits) {
    return api::guarded([&]() -> splat::Status {
        splat::DecodeLimits made;
        if (limits != nullptr) {
            SPLAT_TRY(api::check_desc(limits, 0));
            if (limits->bytes_times_file != 0) made.times_file = limits->bytes_times_file;
            if (limits->bytes_besides != 0) made.besides = limits->bytes_besides;
            if (limits->items != 0) made.max_items = limits->items;
            if (limits->jpeg_scans != 0) made.max_jpeg_scans = limits->jpeg_scans;
        }
        splat::set_decode_limits(made);
        return {};
    });
}
