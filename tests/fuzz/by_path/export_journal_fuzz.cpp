// export_<split>.json: the list of an export's files.

#include "tables/journal.h"

#include "fuzz/by_path/folder.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    static const fuzz::Folder folder({"export_x.json"});
    folder.write(0, file);
    static_cast<void>(fuzz::accepted(tables::Journal::verify(folder.path(), "x")));
}
