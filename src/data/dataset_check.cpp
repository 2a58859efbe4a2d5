#include "data/dataset_check.h"

#include <algorithm>
#include <cstring>
#include <map>

#include "core/hash.h"
#include "core/json_writer.h"

namespace splat::data {
namespace {

/// Most sentences of one kind that are listed; the others are counted.
constexpr std::size_t kListed = 10;

class Checker {
  public:
    Checker(const Dataset& dataset, std::uint32_t object) : dataset_(dataset), object_(object) {
        const auto& problems = dataset.index().problems;
        if (object < problems.size()) found_.problems = problems[object];
    }

    ObjectCheck run() {
        const std::uint32_t views = dataset_.index().views_of[object_];
        if (views != 0 || found_.problems.empty()) check_cameras();
        for (std::uint32_t view = 0; view < views; ++view) check_image(view, MapKind::kRgb);
        for (const MapKind kind : kMaps)
            if ((dataset_.index().maps & flag_of(kind)) != 0)
                for (std::uint32_t view = 0; view < views; ++view) check_image(view, kind);
        if (images_.size() < loaded_)
            found_.warnings.push_back(
                format("%zu of %zu images are duplicates", loaded_ - images_.size(), loaded_));
        shorten(found_.problems, "problems");
        shorten(found_.warnings, "warnings");
        found_.hash = hash_.value();
        return std::move(found_);
    }

  private:
    void check_cameras() {
        const auto cameras = dataset_.reader().cameras(object_);
        if (!cameras.ok()) {
            found_.problems.push_back(cameras.status().message());
            return;
        }
        const auto depths = depth_range(dataset_.reader(), object_);
        if (depths.ok())
            found_.depths = depths.value();
        else
            found_.problems.push_back(depths.status().message());
        std::map<scene::Mat4, std::size_t> poses;
        for (std::size_t i = 0; i < cameras.value().size(); ++i) {
            const StoredView& view = cameras.value()[i];
            hash_.add_number(view.camera_to_world);
            hash_.add_number(view.focal_x);
            hash_.add_number(view.focal_y);
            const auto [place, fresh] = poses.emplace(view.camera_to_world, i);
            if (!fresh)
                found_.warnings.push_back(
                    format("views %zu and %zu have the same pose", place->second, i));
        }
    }

    void check_image(std::uint32_t view, MapKind kind) {
        const auto width = dataset_.reader().width(object_, view, kind);
        if (!width.ok()) {
            found_.problems.push_back(width.status().message());
            return;
        }
        if (found_.width == 0) found_.width = width.value();
        if (width.value() != found_.width) {
            found_.problems.push_back(
                format("view %u: %s has %u x %u pixels, the first image %u x %u", view,
                       map_name(kind), width.value(), width.value(), found_.width, found_.width));
            return;
        }
        const auto loaded = dataset_.reader().map(object_, view, kind);
        if (!loaded.ok()) {
            found_.problems.push_back(loaded.status().message());
            return;
        }
        const io::Image& image = loaded.value();
        Hash own;
        for (Hash* hash : {&own, &hash_}) {
            hash->add_number(image.width);
            hash->add_number(image.channels);
            hash->add(image.samples.data(), image.samples.size() * sizeof image.samples[0]);
        }
        if (kind == MapKind::kMask &&
            std::ranges::none_of(image.samples, [](std::uint16_t sample) { return sample != 0; }))
            found_.warnings.push_back(format("the mask of view %u is empty", view));
        if (kind != MapKind::kRgb) return;
        ++loaded_;
        images_.emplace(own.value(), view);
        const auto [least, most] = std::ranges::minmax_element(image.samples);
        if (*least == *most)
            found_.warnings.push_back(format("view %u is of one colour (%u)", view, *least));
    }

    static void shorten(std::vector<std::string>& sentences, const char* what) {
        if (sentences.size() <= kListed) return;
        const std::size_t more = sentences.size() - kListed;
        sentences.resize(kListed);
        sentences.push_back(format("and %zu more %s", more, what));
    }

    const Dataset& dataset_;
    std::uint32_t object_;
    ObjectCheck found_;
    Hash hash_;
    std::size_t loaded_ = 0;
    std::map<std::uint64_t, std::uint32_t> images_;  ///< by their hash
};

}  // namespace

Result<ObjectCheck> check_object(const Dataset& dataset, std::uint32_t object) {
    const std::size_t objects = dataset.index().names.size();
    if (object >= objects)
        return invalid("object is %u, expected less than %zu, the number of objects", object,
                       objects);
    return Checker(dataset, object).run();
}

Result<std::string> check_text(const Dataset& dataset, std::uint32_t object) {
    SPLAT_ASSIGN(const ObjectCheck found, check_object(dataset, object));
    JsonWriter json;
    json.begin_object().member("name", dataset.index().names[object]);
    json.member("views", dataset.index().views_of[object]).member("width", found.width);
    json.member("hash", format("%016llx", llu(found.hash)));
    json.key("problems").list(found.problems).key("warnings").list(found.warnings);
    if (found.depths.known) {
        const HoldingRange holding = holding_range(found.depths);
        json.key("depths").begin_object();
        json.member("from", found.depths.by_points ? "points" : "cameras");
        json.member("near", found.depths.near).member("far", found.depths.far);
        json.member("znear", holding.znear).member("zfar", holding.zfar).end();
    }
    json.end();
    return json.text();
}

}  // namespace splat::data
