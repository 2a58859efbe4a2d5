// per_object.csv and scores.txt of an evaluation.

#include <cmath>

#include "eval/score_table.h"
#include "fuzz/by_path/folder.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    static const fuzz::Folder folder({"scores"});
    folder.write(0, file);
    const auto table = eval::read_scores(folder.path("scores"));
    if (!fuzz::accepted(table.status())) return;
    fuzz::require(!table.value().objects.empty());
    for (const auto& [metric, values] : table.value().values)
        for (const auto& [object, value] : values) fuzz::require(std::isfinite(value));
    for (const eval::MetricSamples& samples : eval::samples_of(table.value(), table.value()))
        fuzz::require(samples.a == samples.b);
}
