#include "core/json_writer.h"
#include "data/dataset.h"

namespace splat::data {

std::string report_text(const Dataset& dataset) {
    const DatasetIndex& index = dataset.index();
    std::uint64_t views = 0;
    for (const std::uint32_t count : index.views_of) views += count;
    JsonWriter json;
    json.begin_object().member("format", index.format).member("split", index.split);
    json.member("has_splits", index.has_splits);
    json.member("objects", index.names.size()).member("views", views);
    json.member("excluded", index.excluded).key("missing").begin_array();
    for (const auto& [name, problem] : index.missing)
        json.begin_object().member("name", name).member("problem", problem).end();
    json.end().key("not_objects").list(index.others);
    json.key("not_read").list(index.unread).member("not_read_count", index.unread_count);
    json.key("notes").begin_array();
    for (const std::string& note : {index.unread_note(), index.crop_note(dataset.resolution())})
        if (!note.empty()) json.value(note);
    json.end().member("resolution", dataset.resolution());
    json.member("stored_resolution", index.resolution).key("maps").begin_array();
    for (const MapKind kind : kMaps)
        if ((index.maps & flag_of(kind)) != 0) json.value(map_name(kind));
    json.end().key("names").list(index.names).key("views_of").list(index.views_of).end();
    return json.text();
}

}  // namespace splat::data
