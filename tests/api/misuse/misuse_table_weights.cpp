// The rows of files of weights.
#include <cmath>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr const char* kNoWeightsFile = "/nonexistent/weights.npz";

}  // namespace

void MisuseTable::weights_rows() {
    const auto on_weights = [this](const char* name,
                                   std::function<splat_result(splat_weights)> call) {
        handles<splat_weights>(name, "weights", std::move(call), kHandle);
    };
    add("splat_weights_load", "path", "NULL", kArgument,
        [this] { return splat_weights_load(nullptr, 0, outputs.weights.out()); });
    add("splat_weights_load", "path", "no file", kNotFound,
        [this] { return splat_weights_load(kNoWeightsFile, 0, outputs.weights.out()); });
    add("splat_weights_load", "weights", "NULL", kArgument,
        [] { return splat_weights_load(kNoWeightsFile, 0, nullptr); });
    on_weights("splat_weights_save",
               [](splat_weights w) { return splat_weights_save(w, kNoWeightsFile, 0); });
    add("splat_weights_save", "path", "NULL", kArgument,
        [this] { return splat_weights_save(weights_, nullptr, 0); });
    add("splat_weights_save", "path", "a missing folder", kNotFound,
        [this] { return splat_weights_save(weights_, kNoWeightsFile, 0); });
    add("splat_weights_save", "path", "an unknown extension", SPLAT_ERROR_UNSUPPORTED,
        [this] { return splat_weights_save(weights_, "/nonexistent/a.bin", 0); });
    for (const std::uint32_t flags : {1U, 4U, 1U << 31U})
        add("splat_weights_load", "flags", "unknown", kArgument, [this, flags] {
            return splat_weights_load(kNoWeightsFile, flags, outputs.weights.out());
        });
    for (const std::uint32_t flags : {2U, 1U << 31U})
        add("splat_weights_save", "flags", "unknown", kArgument,
            [this, flags] { return splat_weights_save(weights_, kNoWeightsFile, flags); });
    on_weights("splat_weights_count",
               [this](splat_weights w) { return splat_weights_count(w, outputs.count.out()); });
    add("splat_weights_count", "count", "NULL", kArgument,
        [this] { return splat_weights_count(weights_, nullptr); });
    on_weights("splat_weights_get_info", [this](splat_weights w) {
        return splat_weights_get_info(w, 0, outputs.weights_info.out());
    });
    infos<splat_weights_info>("splat_weights_get_info", "info", [this](splat_weights_info* info) {
        return splat_weights_get_info(weights_, 0, info);
    });
    on_weights("splat_weights_find",
               [this](splat_weights w) { return splat_weights_find(w, "a", outputs.count.out()); });
    for (const char* name : {"", "c", "A"})
        add("splat_weights_find", "name", "none", kNotFound,
            [this, name] { return splat_weights_find(weights_, name, outputs.count.out()); });
    add("splat_weights_find", "name", "NULL", kArgument,
        [this] { return splat_weights_find(weights_, nullptr, outputs.count.out()); });
    add("splat_weights_find", "index", "NULL", kArgument,
        [this] { return splat_weights_find(weights_, "a", nullptr); });
    on_weights("splat_weights_read", [this](splat_weights w) {
        return splat_weights_read(w, 0, *outputs.values.out(), 64);
    });
    for (const std::uint32_t index : {2U, UINT32_MAX}) {
        add("splat_weights_get_info", "index", "too high", kArgument, [this, index] {
            return splat_weights_get_info(weights_, index, outputs.weights_info.out());
        });
        add("splat_weights_read", "index", "too high", kArgument, [this, index] {
            return splat_weights_read(weights_, index, *outputs.values.out(), 64);
        });
    }
    add("splat_weights_read", "values", "NULL", kArgument,
        [this] { return splat_weights_read(weights_, 0, nullptr, 64); });
    add("splat_weights_read", "bytes", "too few", kArgument,
        [this] { return splat_weights_read(weights_, 0, *outputs.values.out(), 15); });
    on_weights("splat_weights_report", [this](splat_weights w) {
        return splat_weights_report(w, *outputs.text.out(), 16, outputs.size.out());
    });
    for (const char* parameter : {"buffer", "capacity", "needed"})
        add("splat_weights_report", parameter, "NULL or 0", SPLAT_INCOMPLETE,
            [this] { return splat_weights_report(weights_, nullptr, 0, nullptr); });
    fold_rows();
    handles<splat_weights>("splat_weights_destroy", "weights", splat_weights_destroy, SPLAT_OK);
}

void MisuseTable::fold_rows() {
    handles<splat_weights>(
        "splat_weights_fold", "weights",
        [this](splat_weights w) {
            return splat_weights_fold(w, nullptr, 1, 0, outputs.weights.out());
        },
        kHandle);
    handles<splat_weights>(
        "splat_weights_fold", "adapters",
        [this](splat_weights w) {
            return splat_weights_fold(weights_, w, 1, 0, outputs.weights.out());
        },
        kArgument);
    add("splat_weights_fold", "adapters", "none", kArgument,
        [this] { return splat_weights_fold(weights_, weights_, 1, 0, outputs.weights.out()); });
    add("splat_weights_fold", "alpha", "not finite", kArgument,
        [this] { return splat_weights_fold(weights_, nullptr, NAN, 0, outputs.weights.out()); });
    add("splat_weights_fold", "flags", "unknown", kArgument,
        [this] { return splat_weights_fold(weights_, nullptr, 1, 2, outputs.weights.out()); });
    add("splat_weights_fold", "folded", "NULL", kArgument,
        [this] { return splat_weights_fold(weights_, nullptr, 1, 0, nullptr); });
}

}  // namespace splat::test
