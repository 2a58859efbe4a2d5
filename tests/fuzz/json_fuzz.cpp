// The three parsers of JSON (trees, events, flat objects) accept the same texts, with one exception: the parser of
// events passes on a name that appears twice in an object, and the others refuse it.

#include "core/json.h"

#include "core/json_tree.h"
#include "fuzz/target.h"
#include "support/parsed_json.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const std::string_view text = io::as_text(file);
    const auto tree = parse_json_tree(text, "x");
    const Status events = visit_json(text, "x", [](const JsonEvent&) { return Status(); });
    const bool twice = tree.status().message().find("appears twice") != std::string::npos;
    fuzz::require(twice || events.ok() == tree.ok());
    if (tree.ok()) fuzz::require(parse_json(text, "x").ok());  // throws where it refuses
    const auto flat = parse_flat_json(text, "x");
    if (!flat.ok()) return;
    fuzz::require(tree.ok() && tree.value().is_object());
    for (const JsonScalar& member : flat.value())
        fuzz::require(tree.value().find(member.name) != nullptr);
}
