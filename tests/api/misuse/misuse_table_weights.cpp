// The rows of files of weights.
#include <cmath>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr const char* kNoWeightsFile = "/nonexistent/weights.npz";

}  // namespace

void MisuseTable::weights_rows() {
    add("splat_weights_load", "path", "no file", kNotFound,
        [this] { return splat_weights_load(kNoWeightsFile, 0, out<splat_weights>()); });
    add("splat_weights_save", "path", "a missing folder", kNotFound,
        [this] { return splat_weights_save(weights_, kNoWeightsFile, 0); });
    add("splat_weights_save", "path", "an unknown extension", SPLAT_ERROR_UNSUPPORTED,
        [this] { return splat_weights_save(weights_, "/nonexistent/a.bin", 0); });
    for (const std::uint32_t flags : {1U, 4U, 1U << 31U})
        add("splat_weights_load", "flags", "unknown", kArgument, [this, flags] {
            return splat_weights_load(kNoWeightsFile, flags, out<splat_weights>());
        });
    add("splat_weights_save", "flags", "of loading", kArgument,
        [this] { return splat_weights_save(weights_, "/nonexistent/a.npz", SPLAT_WEIGHTS_COPY); });
    add("splat_weights_save_memory", "flags", "of loading", kArgument, [this] {
        return splat_weights_save_memory(weights_, SPLAT_WEIGHTS_NPZ, SPLAT_WEIGHTS_COPY,
                                         values_out(), 64, out<std::size_t>());
    });
    for (const char* name : {"", "c", "A"})
        add("splat_weights_find", "name", "none", kNotFound,
            [this, name] { return splat_weights_find(weights_, name, out<std::uint32_t>()); });
    for (const std::uint32_t index : {2U, UINT32_MAX}) {
        add("splat_weights_get_info", "index", "too high", kArgument, [this, index] {
            return splat_weights_get_info(weights_, index, out<splat_weights_info>());
        });
        add("splat_weights_read", "index", "too high", kArgument,
            [this, index] { return splat_weights_read(weights_, index, values_out(), 64); });
    }
    add("splat_weights_read", "values", "NULL", kArgument,
        [this] { return splat_weights_read(weights_, 0, nullptr, 64); });
    add("splat_weights_read", "bytes", "too few", kArgument,
        [this] { return splat_weights_read(weights_, 0, values_out(), 15); });
    fold_rows();
}

void MisuseTable::fold_rows() {
    handles<splat_weights>(
        "splat_weights_fold", "adapters",
        [this](splat_weights w) {
            return splat_weights_fold(weights_, w, 1, 0, out<splat_weights>());
        },
        kArgument);
    add("splat_weights_fold", "adapters", "none", kArgument,
        [this] { return splat_weights_fold(weights_, weights_, 1, 0, out<splat_weights>()); });
    add("splat_weights_fold", "alpha", "not finite", kArgument,
        [this] { return splat_weights_fold(weights_, nullptr, NAN, 0, out<splat_weights>()); });
}

}  // namespace splat::test
