#include "eval/saved_objects.h"

#include <limits>
#include <type_traits>

#include "core/json_tree.h"
#include "core/json_writer.h"
#include "core/shown.h"
#include "io/file.h"
#include "io/reader.h"

namespace splat::eval {
namespace {

/// Call visit(key, number) for each number of an object's scores, in the order of files.
template <class Object, class Visit>
void each_number(Object& object, const Visit& visit) {
    for (const auto& [scores, which] :
         {std::pair{&object.novel, "novel"}, {&object.conditioning, "cond"}}) {
        for (const auto& [name, mean] : kScoreMeans)
            visit(std::string(name) + "_" + which, scores->*mean);
        visit(std::string("views_") + which, scores->views);
        visit(std::string("perfect_") + which, scores->perfect);
    }
    visit("empty_views", object.empty);
    visit("predict_seconds", object.predict_seconds);
    visit("draw_seconds", object.draw_seconds);
    visit("drawn", object.drawn);
    for (const auto& [name, count] : kLedgerCounts) visit(name, object.ledger.*count);
}

/// Take a number, which may be null, or a count, exact up to 2^53. Returns whether there is one that fits.
template <class Value>
bool take_number(const JsonTree* found, Value& value) {
    if (found == nullptr) return false;
    if constexpr (std::is_integral_v<Value>) {
        const auto count = found->count();
        if (!count || *count > std::numeric_limits<Value>::max()) return false;
        value = static_cast<Value>(*count);
    } else {
        const auto number = found->is_null() ? std::nan("") : found->number();
        if (!number) return false;
        value = *number;
    }
    return true;
}

/// What objects of two evaluations must share.
std::vector<std::pair<const char*, std::string>> labels_of(const Evaluation& evaluation) {
    return {
        {"method", evaluation.method}, {"network", evaluation.network},
        {"views", evaluation.views},   {"format", evaluation.format},
        {"split", evaluation.split},   {"data_objects", std::to_string(evaluation.data_objects)}};
}

Result<ObjectScores> object_of(const JsonTree& json, std::size_t place) {
    const std::string* const name = json["object"].text();
    if (name == nullptr) return damaged("object %zu has no name", place);
    ObjectScores object;
    object.name = *name;
    std::string lacking;
    each_number(object, [&](const std::string& key, auto& value) {
        if (!take_number(json.find(key), value) && lacking.empty()) lacking = key;
    });
    // splat_ledger holds these counts in 32 bits.
    for (const auto& [key, count] : {std::pair{"images_not_finite", &Ledger::images_not_finite},
                                     {"images_blank", &Ledger::images_blank}})
        if (object.ledger.*count > UINT32_MAX && lacking.empty()) lacking = key;
    if (!lacking.empty())
        return damaged("object '%s' has no number '%s'", shown(object.name).c_str(),
                       lacking.c_str());
    return object;
}

}  // namespace

std::string objects_text(const Evaluation& evaluation) {
    JsonWriter json;
    json.begin_object().newline(2).member("schema", 1);
    json.newline(2).member("weights", evaluation.method.empty() ? evaluation.weights : "");
    for (const auto& [key, text] : labels_of(evaluation)) json.newline(2).member(key, text);
    json.newline(2).key("objects").begin_array();
    for (const auto& [index, object] : evaluation.objects) {
        json.newline(4).begin_object().member("object", object.name);
        each_number(object, [&](const std::string& key, const auto& value) {
            json.member(key, static_cast<double>(value));
        });
        json.end();
    }
    json.newline(2).end().newline(0).end();
    return json.text();
}

Result<std::map<std::uint32_t, ObjectScores>> load_objects(
    const std::string& folder, const Evaluation& like,
    const std::function<std::optional<std::uint32_t>(const std::string& name)>& number_of) {
    const std::string path = folder + "/" + kObjectsFile;
    SPLAT_ASSIGN(const io::Buffer bytes, io::read_file(path, kMaxJsonBytes));
    const auto tree = io::from_file(parse_json_tree(io::as_text(bytes), kObjectsFile));
    if (!tree.ok()) return Status(Code::kFormat, "'" + path + "': " + tree.status().message());
    for (const auto& [key, expected] : labels_of(like)) {
        const std::string* const found = tree.value()[key].text();
        if (found == nullptr)
            return damaged(
                "'%s' has no text '%s': it is damaged, or of an earlier version; score "
                "the objects again",
                path.c_str(), key);
        if (*found != expected)
            return invalid("'%s' has scores of %s '%s', expected '%s'%s", path.c_str(), key,
                           shown(*found).c_str(), expected.c_str(),
                           std::string_view(key) == "network"
                               ? ": the checksum of weights, adapters and configuration"
                               : "");
    }
    const JsonTree::List* const list = tree.value()["objects"].list();
    if (list == nullptr) return damaged("'%s' has no list of objects", path.c_str());
    SPLAT_ASSIGN(ImageTable images, read_image_scores(folder));
    std::map<std::uint32_t, ObjectScores> objects;
    for (std::size_t i = 0; i < list->size(); ++i) {
        auto object = object_of((*list)[i], i);
        if (!object.ok())
            return Status(Code::kFormat, "'" + path + "': " + object.status().message());
        const auto number = number_of(object.value().name);
        if (!number)
            return invalid("'%s': object '%s' is not among those to score", path.c_str(),
                           shown(object.value().name).c_str());
        object.value().novel_views = std::move(images[object.value().name]);
        objects[*number] = std::move(object.value());
    }
    return objects;
}

}  // namespace splat::eval
