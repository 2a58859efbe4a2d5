#include "fit/fit_set.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "ops/gather_rows.h"
#include "params/fit_params.h"
#include "vk/launch.h"

namespace splat::fit {
namespace {

constexpr std::uint32_t kGroup = 64;
constexpr std::uint32_t kStatistics = 2;  ///< floats of a Gaussian

float real(double value) {
    return static_cast<float>(value);
}

params::FitAdam adam_of(const Rates& rates, std::uint64_t step) {
    return {real(rates.beta1),
            real(1 - rates.beta1),
            real(rates.beta2),
            real(1 - rates.beta2),
            real(1 / std::sqrt(1 - std::pow(rates.beta2, static_cast<double>(step)))),
            real(rates.eps)};
}

}  // namespace

Result<FitSet> FitSet::create(vk::Context& context, std::uint32_t capacity,
                              std::uint32_t sh_degree) {
    FitSet made(context);
    const gaussians::SetDesc desc{.gaussians = capacity, .sh_degree = sh_degree};
    const std::uint64_t each = 16 * std::max<std::uint64_t>(desc.color_quads(), 3);
    const std::uint64_t most = context.device().info().limits.max_storage_buffer_bytes / each;
    if (capacity > most)
        return unsupported(
            "a fit of up to %u Gaussians of degree %u, but the device takes at most %llu: allow "
            "fewer Gaussians, or a lower degree",
            capacity, sh_degree, llu(most));
    SPLAT_ASSIGN(made.set_, gaussians::allocate_set(context, desc));
    SPLAT_ASSIGN(made.gradients_, gaussians::allocate_set(context, desc));
    made.set_.count = made.gradients_.count = 0;
    const auto make = [&](vk::Buffer& buffer, std::uint64_t bytes) -> Status {
        SPLAT_ASSIGN(buffer, context.memory().allocate(bytes, vk::MemoryKind::kDevice,
                                                       "parameters of a fit"));
        return context.fill(buffer.range(), 0);
    };
    for (vk::Buffer* const buffer : {&made.raw_, &made.m_, &made.v_})
        SPLAT_TRY(make(*buffer, made.set_.gaussians.bytes()));
    for (vk::Buffer* const buffer : {&made.m_colors_, &made.v_colors_})
        SPLAT_TRY(make(*buffer, made.set_.colors.bytes()));
    SPLAT_TRY(make(made.statistics_, std::uint64_t{capacity} * kStatistics * sizeof(float)));
    return made;
}

std::array<FitSet::Array, 6> FitSet::arrays() const {
    const std::uint32_t colors = 4 * set_.desc.color_quads();
    return {{{"gaussians", &raw_, gaussians::kGaussianFloats, false},
             {"colors", &set_.colors, colors, false},
             {"m:gaussians", &m_, gaussians::kGaussianFloats, true},
             {"v:gaussians", &v_, gaussians::kGaussianFloats, true},
             {"m:colors", &m_colors_, colors, true},
             {"v:colors", &v_colors_, colors, true}}};
}

vk::BufferView FitSet::rows_of(const vk::Buffer& buffer, std::uint32_t length,
                               std::uint32_t rows) const {
    vk::BufferView view = buffer.range().part(0, vk::quad_bytes(std::uint64_t{rows} * length));
    view.shape = {rows, length};
    return view;
}

Status FitSet::begin(const scene::Gaussians& scene) {
    // The activated set is made from the parameters as every step makes it.
    const std::size_t count = scene.count();
    SPLAT_ASSERT(count > 0 && count <= set_.desc.gaussians);
    std::vector<float> raw(count * gaussians::kGaussianFloats);
    std::vector<float> colors(count * 4 * set_.desc.color_quads());
    const std::size_t there = std::size_t{3} * scene::sh_coefficients(scene.sh_degree);
    const std::size_t taken = std::min<std::size_t>(there, set_.desc.color_floats());
    for (std::size_t i = 0; i < count; ++i) {
        float* const to = &raw[i * gaussians::kGaussianFloats];
        std::copy_n(&scene.means[3 * i], 3, to);
        to[3] = scene.opacity_logits[i];
        std::copy_n(&scene.log_scales[3 * i], 3, to + 4);
        std::copy_n(&scene.rotations[4 * i], 4, to + 8);
        std::copy_n(&scene.sh[i * there], taken, &colors[i * 4 * set_.desc.color_quads()]);
    }
    set_.count = gradients_.count = static_cast<std::uint32_t>(count);
    SPLAT_TRY(context_->write(raw_.range(), raw.data(), raw.size() * sizeof(float)));
    SPLAT_TRY(context_->write(set_.colors.range(), colors.data(), colors.size() * sizeof(float)));
    for (const Array& array : arrays())
        if (array.moments) SPLAT_TRY(context_->fill(array.buffer->range(), 0));
    SPLAT_TRY(context_->fill(statistics_.range(), 0));
    return activate();
}

gaussians::SetViews FitSet::drawn(std::uint32_t sh_degree) const {
    gaussians::SetViews views = set_.views();
    views.version = 0;  // every step changes it
    views.sh_degree = sh_degree;
    return views;
}

gaussians::SetViews FitSet::gradients(std::uint32_t sh_degree) const {
    gaussians::SetViews views = gradients_.views();
    views.count = set_.count;
    views.sh_degree = sh_degree;
    return views;
}

Status FitSet::update(vk::Recorder& recorder, const Rates& rates, std::uint64_t step,
                      std::uint32_t sh_degree, const vk::BufferView& exported,
                      std::uint32_t views) {
    const params::FitAdam adam = adam_of(rates, step);
    const double first = 1 - std::pow(rates.beta1, static_cast<double>(step));
    const std::uint32_t size = vk::workgroup_size(recorder.device(), kGroup);
    const std::uint32_t count = set_.count, sparse = rates.skip_zeros ? 1 : 0;
    const auto part = [&](const vk::Buffer& buffer) {
        return rows_of(buffer, gaussians::kGaussianFloats, count);
    };
    const auto color_part = [&](const vk::Buffer& buffer) {
        return rows_of(buffer, 4 * set_.desc.color_quads(), count);
    };
    // Kernels for CPUs bind what they change twice: they read through texel buffers.
    const bool twice = recorder.kernels() == vk::Kernels::kCpu;
    const vk::BufferView changed[] = {part(raw_), part(set_.gaussians), part(m_), part(v_)};
    std::vector<vk::Access> accesses;
    for (const vk::BufferView& view : changed)
        accesses.push_back(twice ? vk::read(view) : vk::read_write(view));
    accesses.push_back(vk::read(part(gradients_.gaussians)));
    accesses.push_back(vk::read(exported));
    accesses.push_back(vk::read_write(rows_of(statistics_, kStatistics, count)));
    for (const vk::BufferView& view : changed)
        if (twice) accesses.push_back(vk::write(view));
    vk::Groups groups = vk::groups_for(recorder.device(), std::uint64_t{3} * count, size);
    SPLAT_TRY(recorder.dispatch({
        .op = "fit_adam_set",
        .shader = "fit_adam_set",
        .constants = {{params::kWorkgroupSizeId, size}, {params::kFitSparseId, sparse}},
        .push = params::FitAdamSetParams{count, views, groups[0], real(rates.mean / first),
                                         real(rates.logit / first), real(rates.log_scale / first),
                                         real(rates.rotation / first), adam,
                                         real(rates.opacity_weight / count),
                                         real(rates.scale_weight / (3.0 * count))},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = 200.0 * count, .bytes = 450.0 * count},
        .may_alias = true,  // a quad is written by the invocation that read it
    }));
    const gaussians::SetDesc active{.sh_degree = sh_degree};
    const std::uint64_t quads = std::uint64_t{count} * active.color_quads();
    groups = vk::groups_for(recorder.device(), quads, size);
    SPLAT_TRY(recorder.dispatch({
        .op = "fit_adam_colors",
        .shader = "fit_adam_colors",
        .constants = {{params::kWorkgroupSizeId, size},
                      {params::kFitColorQuadsId, set_.desc.color_quads()},
                      {params::kFitActiveQuadsId, active.color_quads()},
                      {params::kFitSparseId, sparse}},
        .push = params::FitAdamColorsParams{static_cast<std::uint32_t>(quads), groups[0],
                                            real(rates.constant / first), real(rates.rest / first),
                                            adam},
        .accesses = {vk::read(color_part(set_.colors)), vk::read(color_part(gradients_.colors)),
                     vk::read(color_part(m_colors_)), vk::read(color_part(v_colors_)),
                     vk::write(color_part(set_.colors)), vk::write(color_part(m_colors_)),
                     vk::write(color_part(v_colors_))},
        .groups = groups,
        .work = {.flops = 60.0 * static_cast<double>(quads),
                 .bytes = 112.0 * static_cast<double>(quads)},
        .may_alias = true,
    }));
    return rates.noise > 0 ? add_noise(recorder, rates, step) : Status{};
}

Status FitSet::add_noise(vk::Recorder& recorder, const Rates& rates, std::uint64_t step) {
    const auto low = [](std::uint64_t word) { return static_cast<std::uint32_t>(word); };
    const std::uint32_t size = vk::workgroup_size(recorder.device(), kGroup);
    const vk::Groups groups = vk::groups_for(recorder.device(), set_.count, size);
    const vk::BufferView raw = rows_of(raw_, gaussians::kGaussianFloats, set_.count);
    const vk::BufferView set = rows_of(set_.gaussians, gaussians::kGaussianFloats, set_.count);
    return recorder.dispatch({
        .op = "fit_noise",
        .shader = "fit_noise",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::FitNoiseParams{set_.count, groups[0], real(rates.noise), low(step),
                                       low(step >> 32), low(rates.seed), low(rates.seed >> 32)},
        .accesses = {vk::read(set), vk::read(raw), vk::write(raw), vk::write(set)},
        .groups = groups,
        .work = {.flops = 300.0 * set_.count, .bytes = 96.0 * set_.count},
        .may_alias = true,  // a quad is written by the invocation that read it
    });
}

Result<std::vector<Score>> FitSet::scores() {
    const std::size_t count = set_.count;
    std::vector<float> sums(count * kStatistics), set(count * gaussians::kGaussianFloats);
    SPLAT_TRY(context_->read(statistics_.range(), sums.data(), sums.size() * sizeof(float)));
    SPLAT_TRY(context_->read(set_.gaussians.range(), set.data(), set.size() * sizeof(float)));
    std::vector<Score> scores(count);
    for (std::size_t i = 0; i < count; ++i) {
        const float* const gaussian = &set[i * gaussians::kGaussianFloats];
        scores[i] = {sums[2 * i] / std::max(sums[2 * i + 1], 1.0F), gaussian[3]};
    }
    return scores;
}

Status FitSet::gather(vk::Recorder& recorder, std::uint32_t rows, const vk::Buffer& sources,
                      const vk::Buffer& moments, const vk::Buffer& scratch) {
    for (const Array& array : arrays()) {
        const vk::BufferView to = rows_of(scratch, array.length, rows);
        SPLAT_TRY(ops::gather_rows(recorder, {rows, array.length},
                                   (array.moments ? moments : sources).view({rows}),
                                   rows_of(*array.buffer, array.length, set_.count), {}, to));
        SPLAT_TRY(recorder.copy(to, rows_of(*array.buffer, array.length, rows)));
    }
    return recorder.fill(statistics_.range(), 0);
}

Status FitSet::split(vk::Recorder& recorder, std::uint32_t rows, const vk::Buffer& changes) {
    const std::uint32_t size = vk::workgroup_size(recorder.device(), kGroup);
    const vk::Groups groups = vk::groups_for(recorder.device(), rows, size);
    const vk::BufferView raw = rows_of(raw_, gaussians::kGaussianFloats, rows);
    return recorder.dispatch({
        .op = "fit_split",
        .shader = "fit_split",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::FitSplitParams{rows, groups[0]},
        .accesses = {vk::read(raw), vk::read(changes.view({rows, 3})), vk::write(raw),
                     vk::write(rows_of(set_.gaussians, gaussians::kGaussianFloats, rows))},
        .groups = groups,
        .work = {.flops = 100.0 * rows, .bytes = 156.0 * rows},
        .may_alias = true,
    });
}

Status FitSet::rearrange(vk::Recorder& recorder, std::span<const Row> rows) {
    SPLAT_ASSERT(!rows.empty() && rows.size() <= set_.desc.gaussians);
    const auto count = static_cast<std::uint32_t>(rows.size());
    std::vector<std::uint32_t> sources(count), moments(count), changes;
    for (std::uint32_t i = 0; i < count; ++i) {
        SPLAT_ASSERT(rows[i].source < set_.count);
        sources[i] = rows[i].source;
        moments[i] = rows[i].role == params::kFitKeep ? sources[i] : ops::kNewRow;
        changes.insert(changes.end(), {rows[i].role, std::bit_cast<std::uint32_t>(rows[i].logit),
                                       std::bit_cast<std::uint32_t>(rows[i].log_scale)});
    }
    rows_.clear();
    const auto make = [&](std::uint64_t bytes) -> Status {
        SPLAT_ASSIGN(vk::Buffer made,
                     context_->memory().allocate(bytes, vk::MemoryKind::kDevice, "rows of a fit"));
        rows_.push_back(std::move(made));
        return {};
    };
    for (const std::vector<std::uint32_t>* const words : {&sources, &moments, &changes}) {
        const std::uint64_t bytes = words->size() * sizeof(std::uint32_t);
        SPLAT_TRY(make(bytes));
        SPLAT_TRY(context_->write(rows_.back().range(), words->data(), bytes));
    }
    const std::uint32_t longest = std::max(gaussians::kGaussianFloats, 4 * set_.desc.color_quads());
    SPLAT_TRY(make(std::uint64_t{count} * longest * sizeof(float)));
    SPLAT_TRY(gather(recorder, count, rows_[0], rows_[1], rows_[3]));
    return split(recorder, count, rows_[2]);
}

void FitSet::rearranged(std::span<const Row> rows) {
    set_.count = gradients_.count = static_cast<std::uint32_t>(rows.size());
    rows_.clear();
}

Status FitSet::activate() {
    const std::uint32_t count = set_.count;
    SPLAT_ASSIGN(const vk::Buffer changes,
                 context_->memory().allocate(std::uint64_t{count} * 12, vk::MemoryKind::kDevice,
                                             "rows of a fit"));
    vk::Recorder recorder(*context_);
    SPLAT_TRY(recorder.fill(changes.range(), params::kFitKeep));
    SPLAT_TRY(split(recorder, count, changes));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    return context_->run(list);
}

Result<scene::Gaussians> FitSet::scene(std::uint32_t sh_degree) {
    const std::size_t count = set_.count, stride = std::size_t{4} * set_.desc.color_quads();
    std::vector<float> raw(count * gaussians::kGaussianFloats), colors(count * stride);
    SPLAT_TRY(context_->read(raw_.range(), raw.data(), raw.size() * sizeof(float)));
    SPLAT_TRY(context_->read(set_.colors.range(), colors.data(), colors.size() * sizeof(float)));
    scene::Gaussians scene;
    scene.sh_degree = std::min(sh_degree, set_.desc.sh_degree);
    const std::size_t floats = std::size_t{3} * scene::sh_coefficients(scene.sh_degree);
    for (std::size_t i = 0; i < count; ++i) {
        const float* const from = &raw[i * gaussians::kGaussianFloats];
        scene.means.insert(scene.means.end(), from, from + 3);
        scene.opacity_logits.push_back(from[3]);
        scene.log_scales.insert(scene.log_scales.end(), from + 4, from + 7);
        const float length = std::sqrt(from[8] * from[8] + from[9] * from[9] + from[10] * from[10] +
                                       from[11] * from[11]);
        for (std::size_t k = 8; k < 12; ++k)
            scene.rotations.push_back(length > 0 ? from[k] / length : (k == 8 ? 1.0F : 0.0F));
        scene.sh.insert(scene.sh.end(), &colors[i * stride], &colors[i * stride] + floats);
    }
    return scene;
}

Status FitSet::save(io::NamedTensors& tensors) {
    const auto add = [&](const char* name, const vk::Buffer& buffer,
                         std::uint32_t length) -> Status {
        io::NamedTensor tensor;
        tensor.name = name;
        tensor.dims = {set_.count, length};
        LargeVector<float>& values = tensor.values.own();
        values.resize(std::size_t{set_.count} * length);
        SPLAT_TRY(context_->read(buffer.range(), values.data(), values.size() * sizeof(float)));
        return tensors.add(std::move(tensor));
    };
    for (const Array& array : arrays()) SPLAT_TRY(add(array.name, *array.buffer, array.length));
    return add("statistics", statistics_, kStatistics);
}

Status FitSet::load(const io::NamedTensors& tensors) {
    const io::NamedTensor* const first = tensors.find("gaussians");
    const std::int64_t rows = first == nullptr || first->dims.empty() ? 0 : first->dims[0];
    if (rows < 1 || rows > set_.desc.gaussians)
        return invalid("the state has %lld Gaussians, expected 1 to %u", lld(rows),
                       set_.desc.gaussians);
    const auto load = [&](const char* name, const vk::Buffer& buffer, std::uint32_t length,
                          bool write) -> Status {
        const io::NamedTensor* const tensor = tensors.find(name);
        if (tensor == nullptr) return invalid("the state lacks '%s'", name);
        if (tensor->dims != std::vector<std::int64_t>{rows, length})
            return invalid("'%s' of the state has another shape, expected [%lld,%u]", name,
                           lld(rows), length);
        if (!write) return {};
        return context_->write(buffer.range(), tensor->values.data(),
                               tensor->values.size() * sizeof(float));
    };
    for (const bool write : {false, true}) {
        for (const Array& array : arrays())
            SPLAT_TRY(load(array.name, *array.buffer, array.length, write));
        SPLAT_TRY(load("statistics", statistics_, kStatistics, write));
    }
    set_.count = gradients_.count = static_cast<std::uint32_t>(rows);
    return activate();
}

}  // namespace splat::fit
