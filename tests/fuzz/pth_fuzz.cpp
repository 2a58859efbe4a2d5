#include <cstring>

#include "fuzz/checksums.h"
#include "fuzz/target.h"
#include "io/torch/pickle.h"
#include "io/weights_formats.h"

using namespace splat;

namespace {

/// What is read can be written, and is read again bit by bit.
void check_writing(const io::WeightsFile& file) {
    const auto written = io::write_pth(file.tensors, file.metadata);
    fuzz::require(written.ok());
    const io::Buffer bytes = written.value().joined();
    const auto again = io::read_pth(io::MemorySource(bytes));
    fuzz::require(again.ok() && again.value().tensors.size() == file.tensors.size());
    for (std::size_t i = 0; i < file.tensors.size(); ++i) {
        const io::NamedTensor& a = file.tensors[i];
        const io::NamedTensor& b = again.value().tensors[i];
        fuzz::require(a.name == b.name && a.dims == b.dims && a.values.size() == b.values.size());
        fuzz::require(a.values.empty() || std::memcmp(a.values.data(), b.values.data(),
                                                      a.values.size() * sizeof(float)) == 0);
    }
}

}  // namespace

/// The pickle is also read alone.
SPLAT_FUZZ_TARGET(io::Bytes file) {
    const io::MemorySource source(file);
    const DecodeLimits small{64, 1U << 20U, 1000};
    const auto read = io::read_pth(source, small);
    if (fuzz::accepted(read.status())) {
        fuzz::require(read.value().tensors.elements() * 4 <= small.allowed(file.size()));
        for (const io::NamedTensor& tensor : read.value().tensors)
            fuzz::require(io::count_elements(tensor.dims, "").value() == tensor.values.size());
        check_writing(read.value());
    }
    DecodeBudget budget(file.size(), small);
    const auto pickle = io::Pickle::read({file.begin(), file.end()}, budget);
    if (!fuzz::accepted(pickle.status())) return;
    const io::PickleNode& root = pickle.value().root();
    for (const std::uint32_t item : root.items) static_cast<void>(pickle.value()[item].kind);
    static_cast<void>(pickle.value().find(root, "model_state_dict"));
}

SPLAT_FUZZ_MUTATOR(fuzz::repair_zip)
