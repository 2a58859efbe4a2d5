// COCO's panoptic annotations or a palette, and a mask of theirs. The mask has the path "a.png".

#include "data/panoptic/mask_tokens.h"
#include "fuzz/by_path/folder.h"

using namespace splat;

namespace {

void check_segments(const io::Image& mask, const std::vector<data::Segment>& segments) {
    std::uint64_t area = 0;
    for (std::size_t i = 0; i < segments.size(); ++i) {
        const data::Segment& segment = segments[i];
        fuzz::require(!segment.name.empty() && segment.area > 0);
        fuzz::require(segment.left + segment.width <= mask.width);
        fuzz::require(segment.top + segment.height <= mask.height);
        fuzz::require(segment.area <= std::uint64_t{segment.width} * segment.height);
        if (i > 0) fuzz::require(segments[i - 1].area >= segment.area);
        area += segment.area;
    }
    fuzz::require(area <= std::uint64_t{mask.width} * mask.height);
}

}  // namespace

SPLAT_FUZZ_TARGET(io::Bytes input) {
    const auto [names, picture] = fuzz::files_of<2>(input);
    io::ImageOptions small;
    small.max_side = 64;
    const auto mask = io::read_png(picture, small);
    static const fuzz::Folder folder({"a.json", "a.gpl"});
    for (const std::size_t kind : {0U, 1U}) {
        folder.write(kind, names);
        const auto read = data::MaskNames::load(folder.path(kind == 0 ? "a.json" : "a.gpl"));
        if (!fuzz::accepted(read.status()) || !mask.ok()) continue;
        const auto segments = read.value().segments(mask.value(), "a.png");
        if (!fuzz::accepted(segments.status())) continue;
        check_segments(mask.value(), segments.value());
        data::MaskTokensDesc desc;
        desc.tokens = 3;
        for (const float value :
             data::tokens_of(segments.value(), mask.value().width, mask.value().height, desc))
            fuzz::require(value >= -1 && value <= 1);
    }
}
