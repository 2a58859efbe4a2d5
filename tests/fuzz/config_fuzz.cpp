#include "core/config.h"

#include "fuzz/target.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    for (const auto& read :
         {read_yaml_config(io::as_text(file), "x"), read_json_config(io::as_text(file), "x")}) {
        if (!read.ok()) continue;
        fuzz::require(read.value().entries().size() <= kMaxConfigEntries);
        for (const ConfigEntry& entry : read.value().entries()) {
            fuzz::require(read.value().find(entry.key) == &entry);
            fuzz::require(entry.list || entry.values.size() == (entry.map ? 0U : 1U));
        }
    }
}
