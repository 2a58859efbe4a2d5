#include "data/view_vectors.h"

namespace splat::data {

Result<ViewVectors> ViewVectors::load(const std::string& path, std::vector<std::int64_t> shape,
                                      const DatasetIndex& index, const char* what) {
    ViewVectors made;
    SPLAT_ASSIGN(made.file_, io::load_weights(path));
    made.length_ = 1;
    for (const std::int64_t side : shape) made.length_ *= static_cast<std::size_t>(side);
    for (std::size_t i = 0; i < index.names.size(); ++i) {
        std::string name = index.split + "/" + index.names[i];
        const io::NamedTensor* tensor = made.file_.tensors.find(name);
        if (tensor == nullptr) tensor = made.file_.tensors.find(index.names[i]);
        if (tensor == nullptr)
            return not_found(
                "'%s' ('%s') has no array '%s' or '%s', expected one for each object of "
                "the data set",
                path.c_str(), what, name.c_str(), index.names[i].c_str());
        name = tensor->name;
        std::vector<std::int64_t> expected = {index.views_of[i]};
        expected.insert(expected.end(), shape.begin(), shape.end());
        if (tensor->dims != expected)
            return error(Code::kShape,
                         "'%s' ('%s'): '%s' has the shape %s, expected %s: one row for each view",
                         path.c_str(), what, name.c_str(), io::dims_text(tensor->dims).c_str(),
                         io::dims_text(expected).c_str());
        if (const Status finite = io::check_finite(*tensor); !finite.ok())
            return error(finite.code(), "'%s' ('%s'): %s", path.c_str(), what,
                         finite.message().c_str());
        made.names_.push_back(std::move(name));
    }
    return made;
}

void ViewVectors::append(std::uint32_t object, std::span<const std::uint32_t> views,
                         std::vector<float>& to) const {
    const io::NamedTensor* tensor = file_.tensors.find(names_[object]);
    SPLAT_ASSERT(tensor != nullptr);
    for (const std::uint32_t view : views) {
        const float* const row = tensor->values.data() + view * length_;
        to.insert(to.end(), row, row + length_);
    }
}

}  // namespace splat::data
