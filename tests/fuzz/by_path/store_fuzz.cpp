// store.json: what is accepted is written and read back.

#include "fuzz/by_path/folder.h"
#include "tables/store.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    static const fuzz::Folder folder({"store.json"});
    folder.write(0, file);
    const auto read = tables::read_store_text(folder.path());
    if (!fuzz::accepted(read.status())) return;
    const tables::StoreIndex& index = read.value();
    std::uint64_t views = 0;
    for (const tables::StoreObject& object : index.objects) views += object.views;
    fuzz::require(index.resolution > 0);
    fuzz::require(index.object_files.objects != 0 ? index.objects.empty()
                                                  : views == index.frames.size());
    const std::string text = tables::store_text(index);
    folder.write(0, io::as_bytes(text));
    const auto again = tables::read_store_text(folder.path());
    fuzz::require(again.ok() && again.value().maps == index.maps);
    fuzz::require(tables::store_text(again.value()) == text);
}
