#include "eval/saved_objects.h"

#include <cmath>
#include <limits>
#include <type_traits>

#include "core/json_tree.h"
#include "core/json_writer.h"
#include "core/shown.h"
#include "io/file.h"
#include "io/reader.h"

namespace splat::eval {
namespace {

/// A number of an object's scores: its key and where it is. Counts are exact up to 2^53.
struct Field {
    const char* key;
    std::uint64_t most;  ///< most that a count may be; 0: a number, which may be null
    std::function<double(const ObjectScores&)> get;
    std::function<void(ObjectScores&, double)> set;
};

template <class Value>
constexpr std::uint64_t most_of() {
    return std::is_integral_v<Value> ? static_cast<std::uint64_t>(std::numeric_limits<Value>::max())
                                     : 0;
}

template <class Part, class Value>
Field field_of(const char* key, Part ObjectScores::*part, Value Part::*value) {
    return {key, most_of<Value>(),
            [=](const ObjectScores& o) { return static_cast<double>(o.*part.*value); },
            [=](ObjectScores& o, double number) { o.*part.*value = static_cast<Value>(number); }};
}

template <class Value>
Field field_of(const char* key, Value ObjectScores::*value) {
    return {key, most_of<Value>(),
            [=](const ObjectScores& o) { return static_cast<double>(o.*value); },
            [=](ObjectScores& o, double number) { o.*value = static_cast<Value>(number); }};
}

const std::vector<Field>& fields() {
    using O = ObjectScores;
    static const std::vector<Field> all = {
        field_of("psnr_novel", &O::novel, &Scores::psnr),
        field_of("ssim_novel", &O::novel, &Scores::ssim),
        field_of("lpips_novel", &O::novel, &Scores::lpips),
        field_of("views_novel", &O::novel, &Scores::views),
        field_of("perfect_novel", &O::novel, &Scores::perfect),
        field_of("psnr_cond", &O::conditioning, &Scores::psnr),
        field_of("ssim_cond", &O::conditioning, &Scores::ssim),
        field_of("lpips_cond", &O::conditioning, &Scores::lpips),
        field_of("views_cond", &O::conditioning, &Scores::views),
        field_of("perfect_cond", &O::conditioning, &Scores::perfect),
        field_of("empty_views", &O::empty),
        field_of("predict_seconds", &O::predict_seconds),
        field_of("draw_seconds", &O::draw_seconds),
        field_of("drawn", &O::drawn),
        field_of("outputs_not_finite", &O::ledger, &Ledger::outputs_not_finite),
        field_of("gaussians", &O::ledger, &Ledger::gaussians),
        field_of("gaussians_not_finite", &O::ledger, &Ledger::gaussians_not_finite),
        field_of("gaussians_invisible", &O::ledger, &Ledger::invisible),
        field_of("gaussians_visible", &O::ledger, &Ledger::visible),
        field_of("images_not_finite", &O::ledger, &Ledger::images_not_finite),
        field_of("images_blank", &O::ledger, &Ledger::images_blank)};
    return all;
}

/// What objects of two evaluations must share.
std::vector<std::pair<const char*, std::string>> labels_of(const Evaluation& evaluation) {
    return {
        {"method", evaluation.method}, {"network", evaluation.network},
        {"views", evaluation.views},   {"format", evaluation.format},
        {"split", evaluation.split},   {"data_objects", std::to_string(evaluation.data_objects)}};
}

Result<ObjectScores> object_of(const JsonTree& json, std::size_t place) {
    const JsonTree* const name = json.find("object");
    if (name == nullptr || name->text() == nullptr)
        return error(Code::kFormat, "object %zu has no name", place);
    ObjectScores object;
    object.name = *name->text();
    for (const Field& field : fields()) {
        const JsonTree* const found = json.find(field.key);
        const bool null = found != nullptr && found->is_null() && field.most == 0;
        const auto number = found == nullptr ? std::nullopt : found->number();
        const auto count = found == nullptr ? std::nullopt : found->count();
        if (!null && (!number || (field.most != 0 && (!count || *count > field.most))))
            return error(Code::kFormat, "object '%s' has no number '%s'",
                         shown(object.name).c_str(), field.key);
        field.set(object, null ? std::nan("") : *number);
    }
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
        for (const Field& field : fields()) json.member(field.key, field.get(object));
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
        const JsonTree* const found = tree.value().find(key);
        if (found == nullptr || found->text() == nullptr)
            return error(Code::kFormat,
                         "'%s' has no text '%s': it is damaged, or of an earlier version; score "
                         "the objects again",
                         path.c_str(), key);
        if (*found->text() != expected)
            return error(Code::kInvalidArgument, "'%s' has scores of %s '%s', expected '%s'%s",
                         path.c_str(), key, shown(*found->text()).c_str(), expected.c_str(),
                         std::string_view(key) == "network"
                             ? ": the checksum of weights, adapters and configuration"
                             : "");
    }
    const JsonTree* const list = tree.value().find("objects");
    if (list == nullptr || list->list() == nullptr)
        return error(Code::kFormat, "'%s' has no list of objects", path.c_str());
    std::map<std::uint32_t, ObjectScores> objects;
    for (std::size_t i = 0; i < list->list()->size(); ++i) {
        auto object = object_of((*list->list())[i], i);
        if (!object.ok())
            return Status(Code::kFormat, "'" + path + "': " + object.status().message());
        const auto number = number_of(object.value().name);
        if (!number)
            return error(Code::kInvalidArgument, "'%s': object '%s' is not among those to score",
                         path.c_str(), shown(object.value().name).c_str());
        objects[*number] = std::move(object.value());
    }
    return objects;
}

}  // namespace splat::eval
