#include "fuzz/checksums.h"
#include "fuzz/target.h"
#include "io/weights_formats.h"
#include "io/zip.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const io::MemorySource source(file);
    const DecodeLimits small{64, 1U << 20U, 1000};
    const auto zip = io::Zip::open(source, "zip", small);
    if (fuzz::accepted(zip.status())) {
        std::uint64_t total = 0;
        io::Buffer bytes;
        for (const io::ZipEntry& entry : zip.value().entries())
            if (zip.value().read(entry, bytes).ok()) total += bytes.size();
        fuzz::require(total <= small.allowed(file.size()));
    }
    const auto read = io::read_npz(source, small);
    if (!fuzz::accepted(read.status())) return;
    const auto written = io::write_npz(read.value().tensors);
    fuzz::require(written.ok());
    const io::Buffer bytes = written.value().joined();
    const auto again = io::read_npz(io::MemorySource(bytes));
    fuzz::require(again.ok() && again.value().tensors.size() == read.value().tensors.size());
}

SPLAT_FUZZ_MUTATOR(fuzz::repair_zip)
