#include "fuzz/target.h"
#include "io/weights_formats.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const io::MemorySource source(file);
    const auto read = io::read_safetensors(source, {64, 1U << 20U, 1000});
    if (!fuzz::accepted(read.status())) return;
    const auto written = io::write_safetensors(read.value().tensors, read.value().metadata);
    fuzz::require(written.ok());
    const io::Buffer bytes = written.value().joined();
    const auto again = io::read_safetensors(io::MemorySource(bytes));
    fuzz::require(again.ok() && again.value().tensors.size() == read.value().tensors.size());
    for (const io::NamedTensor& tensor : read.value().tensors) {
        const io::NamedTensor* other = again.value().tensors.find(tensor.name);
        fuzz::require(other != nullptr && other->dims == tensor.dims);
    }
}
