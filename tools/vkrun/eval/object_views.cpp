#include "vkrun/eval/object_views.h"

namespace vkrun {

ObjectViews read_views(splat_evaluator evaluator, std::uint32_t object, bool wanted) {
    auto info = sized<splat_evaluator_info>();
    check(splat_evaluator_get_info(evaluator, &info));
    auto views = sized<splat_evaluated_views>();
    check(splat_evaluator_read(evaluator, object, &views), kBadData);
    ObjectViews read{views.inputs, info.resolution, {}, {}, {}};
    if (!wanted) return read;
    read.numbers.resize(std::size_t{views.inputs} + views.novel);
    read.cameras.resize(read.numbers.size());
    read.images.resize(read.cameras.size() * 3 * read.side * read.side);
    views.numbers = read.numbers.data();
    views.number_count = read.numbers.size();
    views.cameras = read.cameras.data();
    views.camera_count = read.cameras.size();
    views.images = read.images.data();
    views.image_count = read.images.size();
    check(splat_evaluator_read(evaluator, object, &views), kBadData);
    return read;
}

std::vector<float> drawn_images(splat_evaluator evaluator, std::uint32_t object,
                                const ObjectViews& views) {
    std::vector<float> images(views.images.size());
    auto wanted = sized<splat_evaluated_views>();
    wanted.drawn = images.data();
    wanted.drawn_count = images.size();
    check(splat_evaluator_read(evaluator, object, &wanted));
    return images;
}

}  // namespace vkrun
