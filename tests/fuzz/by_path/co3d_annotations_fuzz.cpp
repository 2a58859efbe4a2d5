// Annotations of CO3D's raw release: the lists of a subset, the frames and the sequences, plain or gzip.

#include "data/co3d_raw.h"
#include "fuzz/by_path/folder.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes input) {
    static const fuzz::Folder folder(
        {"c/set_lists/set_lists_s.json", "c/frame_annotations.jgz", "c/sequence_annotations.jgz"});
    const auto files = fuzz::files_of<3>(input);
    for (std::size_t i = 0; i < files.size(); ++i) folder.write(i, files[i]);
    const auto read = data::read_raw_co3d(folder.path(), "c", "s", "train");
    if (!fuzz::accepted(read.status())) return;
    for (const data::RawSequence& sequence : read.value())
        for (const data::RawFrame& frame : sequence.frames)
            fuzz::require(frame.width > 0 && frame.height > 0);
}
