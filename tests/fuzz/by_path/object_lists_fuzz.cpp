// Lists of objects, of excluded sequences and of source views.

#include "data/object_lists.h"

#include "fuzz/by_path/folder.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    static const fuzz::Folder folder({"list"});
    folder.write(0, file);
    const std::string path = folder.path("list");
    const auto objects = data::load_object_list(path);
    if (fuzz::accepted(objects.status())) fuzz::require(!objects.value().empty());
    const auto excluded = data::load_excluded_sequences(path);
    if (fuzz::accepted(excluded.status())) fuzz::require(!excluded.value().empty());
    const auto views = data::load_source_views(path);
    if (!fuzz::accepted(views.status())) return;
    for (const data::SourceView& view : views.value())
        fuzz::require(!view.category.empty() && !view.object.empty());
}
