// objects.json of an evaluation: what is accepted is written and read back.

#include "eval/saved_objects.h"
#include "fuzz/by_path/folder.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    static const fuzz::Folder folder({eval::kObjectsFile});
    std::map<std::string, std::uint32_t> numbers;
    const auto number_of = [&numbers](const std::string& name) -> std::optional<std::uint32_t> {
        return numbers.emplace(name, static_cast<std::uint32_t>(numbers.size())).first->second;
    };
    eval::Evaluation like;
    like.format = "srn";
    like.split = "test";
    folder.write(0, file);
    auto read = eval::load_objects(folder.path(), like, number_of);
    if (read.status().code() == Code::kInvalidArgument) return;  // another evaluation's
    if (!fuzz::accepted(read.status())) return;
    like.objects = std::move(read.value());
    const std::string text = eval::objects_text(like);
    folder.write(0, io::as_bytes(text));
    const auto again = eval::load_objects(folder.path(), like, number_of);
    fuzz::require(again.ok() && again.value().size() == like.objects.size());
}
