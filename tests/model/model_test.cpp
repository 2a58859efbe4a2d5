#include "model/model.h"

#include <gtest/gtest.h>

#include <limits>

#include "model/adapters.h"
#include "model/small_model.h"

namespace splat::test {
namespace {

class ModelRules : public ModelTest {};
SPLAT_INSTANTIATE_KERNELS(ModelRules);

TEST_P(ModelRules, StartsTheSameFromASeed) {
    const auto first = make(small_config());
    const auto second = make(small_config());
    const Inputs inputs(small_config());
    EXPECT_EQ(run(*first, inputs), run(*second, inputs));
    ASSERT_OK(second->init(8));
    EXPECT_NE(run(*first, inputs), run(*second, inputs));
}

TEST_P(ModelRules, ObjectsOfABatchAreIndependent) {
    ModelOptions two;
    two.objects = 2;
    const auto pair = make(small_config(), two);
    const auto single = make(small_config());
    randomise(*pair, 40);
    randomise(*single, 40);
    const Inputs both(small_config(), 2, 60);
    Inputs first(small_config(), 1, 60);
    first.images.assign(both.images.begin(),
                        both.images.begin() + static_cast<std::ptrdiff_t>(both.images.size() / 2));
    const std::vector<float> together = run(*pair, both);
    const std::vector<float> alone = run(*single, first);
    const std::vector<float> head(together.begin(),
                                  together.begin() + static_cast<std::ptrdiff_t>(alone.size()));
    EXPECT_LE(relative_l2(head, alone), 1e-6)
        << "the sums of a larger batch may be tiled otherwise";
}

/// What a pass gave is counted: of two objects in one pass, and in two.
TEST_P(ModelRules, CountsWhatIsNotFiniteOrTooFaint) {
    for (const std::uint64_t most_bytes : {0, 1}) {
        ModelOptions options;
        options.objects = 2;
        options.most_bytes = most_bytes;
        const auto model = make(small_config(), options);
        const auto count = [&] {
            run(*model, Inputs(small_config(), 2));
            return model->ledger();
        };
        model::Ledger ledger = count();
        EXPECT_EQ(ledger.gaussians, 512U);
        EXPECT_EQ(ledger.non_finite(), 0U);
        EXPECT_EQ(ledger.set.faint, 0U);
        const nn::Parameter* bias = model->parameters().find("network_with_offset.out.bias");
        ASSERT_NE(bias, nullptr);
        std::vector<float> values = read(bias->value);
        values[4] = -20;  // the logit of the opacity, see GradientsAddUp in tests/api
        ASSERT_OK(model->parameters().write(*bias, values));
        EXPECT_EQ(count().set.faint, 512U);
        values[4] = std::numeric_limits<float>::quiet_NaN();
        ASSERT_OK(model->parameters().write(*bias, values));
        ledger = count();
        EXPECT_EQ(ledger.non_finite(), 2 * 512U) << "of the network and of the opacities";
    }
}

/// Adapters and attention to tokens start without effect.
TEST_P(ModelRules, AdditionsChangeNothingAtFirst) {
    const auto plain = make(small_config());
    ModelConfig more = small_config();
    more.lora.rank = 3;
    const auto adapted = make(more);
    more = small_config();
    more.tokens = 5;
    more.token_dim = 7;
    const auto attending = make(more);
    const Inputs inputs(small_config());
    const std::vector<float> expected = run(*plain, inputs);
    EXPECT_EQ(run(*adapted, inputs), expected);
    EXPECT_EQ(run(*attending, Inputs(more)), expected);
}

/// Activations that the backward pass recomputes have the same bits, also with dropout and attention, and
/// take less memory.
TEST_P(ModelRules, RecomputedGradientsAreTheSame) {
    ModelConfig modulated = small_config();
    modulated.dropout = 0.2F;
    modulated.embedding = model::Embedding::kPose;
    modulated.tokens = 5;
    modulated.token_dim = 7;
    ModelConfig adapted = small_config();
    adapted.lora.rank = 3;
    adapted.lora.dropout = 0.1F;
    for (const ModelConfig& config : {modulated, adapted}) {
        ModelOptions options;
        options.gradients = options.input_gradient = options.build.training = true;
        const auto kept = make(config, options);
        options.recompute = true;
        const auto again = make(config, options);
        EXPECT_LT(again->executor().memory().bound, kept->executor().memory().bound);
        const Inputs inputs(config);
        std::vector<std::vector<float>> results[2];
        for (Model* model : {kept.get(), again.get()}) {
            auto& result = results[model == again.get() ? 1 : 0];
            randomise(*model, 90);
            result.push_back(run(*model, inputs));
            write_gradients(*model, 91);
            ASSERT_OK(model->backward());
            for (const auto input : {Model::Input::kImages, Model::Input::kTokens}) {
                if (input == Model::Input::kTokens && config.tokens == 0) continue;
                const auto gradient = need(model->input_gradient(input));
                result.push_back(gradient);
            }
            result.push_back(read(model->raw_output()));
            for (const nn::Parameter& parameter : model->parameters().all())
                if (parameter.grad.block != nullptr) result.push_back(read(parameter.grad));
        }
        EXPECT_EQ(results[0], results[1]);
        EXPECT_NE(results[0][1], std::vector<float>(results[0][1].size(), 0.0F));
    }
}

TEST_P(ModelRules, MergedAdaptersPredictTheSame) {
    ModelConfig config = small_config();
    config.lora.rank = 3;
    config.lora.alpha = 6;
    const auto adapted = make(config);
    const auto merged = make(small_config());
    randomise(*adapted, 80);
    auto state = need(model::save_state(*adapted));
    auto adapters = need(model::save_adapters(*adapted));
    auto folded = need(model::merge_adapters(state, adapters.tensors, 6, 1));
    model::LoadReport report;
    ASSERT_OK(model::load_state(*merged, folded, {}, report));
    const Inputs inputs(config);
    const std::vector<float> expected = run(*adapted, inputs);
    const std::vector<float> got = run(*merged, inputs);
    double worst = 0;
    for (std::size_t i = 0; i < got.size(); ++i)
        worst = std::max(worst, std::abs(static_cast<double>(got[i] - expected[i])));
    EXPECT_LE(worst, 1e-6) << "float32 sums of the same numbers in another order; seen 4.5e-8";
    ASSERT_OK(model::load_state(
        *merged, model::merge_adapters(state, adapters.tensors, 0, 1).value(), {}, report));
    EXPECT_GT(relative_l2(run(*merged, inputs), expected), 1e-3) << "without adapters";

    auto unfolded = need(model::merge_adapters(folded, adapters.tensors, 6, -1));
    for (const io::NamedTensor& tensor : unfolded)
        for (std::size_t i = 0; i < tensor.values.size(); ++i) {
            const float original = state.find(tensor.name)->values[i];
            const float between = folded.find(tensor.name)->values[i];
            // One rounding each way, of half an ulp.
            const double bound = 0x1p-24 * static_cast<double>(std::abs(between)) +
                                 0x1p-24 * static_cast<double>(std::abs(tensor.values[i]));
            ASSERT_LE(
                std::abs(static_cast<double>(tensor.values[i]) - static_cast<double>(original)),
                bound)
                << tensor.name << " " << i;
        }
}

TEST_P(ModelRules, SavesWhatItLoads) {
    const auto first = make(small_config());
    const auto second = make(small_config());
    randomise(*first, 90);
    auto state = need(model::save_state(*first));
    model::LoadReport report;
    ASSERT_OK(model::load_state(*second, state, {}, report));
    EXPECT_TRUE(report.fresh.empty() && report.left_out.empty() && report.widened.empty());
    const Inputs inputs(small_config());
    EXPECT_EQ(run(*second, inputs), run(*first, inputs));
}

/// A ray grid that differs from the configuration's by the rounding of a float16 file counts as the same.
TEST_P(ModelRules, RoundedRaysAreTheSame) {
    const auto model = make(small_config());
    auto state = need(model::save_state(*model));
    const model::LoadOptions take{.source = {}, .graft = false, .take_rays = true};
    for (const auto type : {io::NumberType::kF16, io::NumberType::kF32}) {
        io::NamedTensors changed;
        for (io::NamedTensor tensor : state) {
            if (tensor.name.ends_with("ray_dirs")) {
                tensor.type = type;
                for (float& ray : tensor.values.own())
                    ray *= 1 + 0x1p-12F;  // less than half an ulp
            }
            ASSERT_OK(changed.add(std::move(tensor)));
        }
        model::LoadReport report;
        ASSERT_OK(model::load_state(*model, changed, take, report));
        EXPECT_EQ(report.rays_differ, type == io::NumberType::kF32);
    }
}

/// Without offset the names are those of the published code; files of earlier versions can be read too.
TEST_P(ModelRules, ANetworkWithoutOffsetHasItsName) {
    ModelConfig config = small_config();
    config.offset = false;
    const auto first = make(config);
    const auto second = make(config);
    randomise(*first, 95);
    const auto state = need(model::save_state(*first));
    io::NamedTensors earlier;
    for (io::NamedTensor tensor : state) {
        EXPECT_FALSE(tensor.name.starts_with("network_with_offset.")) << tensor.name;
        if (tensor.name.starts_with("network_wo_offset."))
            tensor.name = "network_with_offset." + tensor.name.substr(18);
        ASSERT_OK(earlier.add(std::move(tensor)));
    }
    EXPECT_NE(state.find("network_wo_offset.out.bias"), nullptr);
    model::LoadReport report;
    const Inputs inputs(config);
    const io::NamedTensors* const files[] = {&state, &earlier};
    for (const io::NamedTensors* file : files) {
        ASSERT_OK(second->init(8));
        ASSERT_OK(model::load_state(*second, *file, {}, report));
        EXPECT_TRUE(report.fresh.empty() && report.left_out.empty());
        EXPECT_EQ(run(*second, inputs), run(*first, inputs));
    }
}

/// New channels of a widened network have no influence, whatever they hold, until it is trained.
TEST_P(ModelRules, GraftsByMeaning) {
    ModelConfig narrow = small_config();
    narrow.normal = narrow.plane = true;
    ModelConfig wide = narrow;
    wide.depth = wide.mask = true;
    const auto from = make(narrow);
    const auto to = make(wide);
    randomise(*from, 100);
    auto state = need(model::save_state(*from));
    model::LoadOptions options;
    model::LoadReport report;
    EXPECT_ERROR(model::load_state(*to, state, options, report), Code::kShape, "graft");
    options.graft = true;
    EXPECT_ERROR(model::load_state(*to, state, options, report), Code::kShape,
                 "name the file's channels");
    EXPECT_EQ(model::likely_channels(narrow, state), model::channels_of(narrow));
    EXPECT_EQ(model::likely_channels(wide, state), model::ImageChannels{});
    options.source = model::channels_of(narrow);
    ASSERT_OK(model::load_state(*to, state, options, report));
    ASSERT_EQ(report.widened.size(), 1U);

    const Inputs thirteen(wide);
    Inputs eleven(narrow);
    const std::size_t plane = std::size_t{wide.resolution} * wide.resolution;
    const auto put = [&](std::size_t to_plane, std::size_t from_plane) {
        std::copy_n(thirteen.images.begin() + static_cast<std::ptrdiff_t>(from_plane * plane),
                    plane, eleven.images.begin() + static_cast<std::ptrdiff_t>(to_plane * plane));
    };
    for (std::size_t c = 0; c < 3; ++c) put(c, c);          // RGB
    for (std::size_t c = 0; c < 3; ++c) put(3 + c, 4 + c);  // normals behind the depth
    for (std::size_t c = 0; c < 5; ++c) put(6 + c, 8 + c);  // planes behind the mask
    EXPECT_LE(relative_l2(run(*to, thirteen), run(*from, eleven)), 1e-6);
}

TEST_P(ModelRules, RefusesStatesOfOtherNetworks) {
    const auto model = make(small_config());
    auto state = need(model::save_state(*model));
    const auto without = [&](const char* name) {
        io::NamedTensors rest;
        for (const io::NamedTensor& tensor : state)
            if (tensor.name != name) {
                EXPECT_OK(rest.add(tensor));
            }
        return rest;
    };
    const char* out = "network_with_offset.out.weight";
    model::LoadReport report;
    EXPECT_ERROR(model::load_state(*model, without(out), {}, report), Code::kInvalidArgument,
                 "no tensor 'network_with_offset.out.weight' [24, 24, 1, 1]");
    io::NamedTensors changed = without(out);
    ASSERT_OK(changed.add({out, {24, 23, 1, 1}, io::NumberType::kF32, std::vector<float>(552)}));
    EXPECT_ERROR(model::load_state(*model, changed, {}, report), Code::kShape,
                 "has shape [24, 23, 1, 1], expected [24, 24, 1, 1]");
    changed = without(out);
    ASSERT_OK(
        changed.add({out, {24, 24, 1, 1}, io::NumberType::kF32, std::vector<float>(576, NAN)}));
    EXPECT_ERROR(model::load_state(*model, changed, {}, report), Code::kInvalidArgument,
                 "holds nan at element 0");
    changed = without("nothing");
    ASSERT_OK(changed.add({"extra", {1}, io::NumberType::kF32, {1}}));
    EXPECT_ERROR(model::load_state(*model, changed, {}, report), Code::kInvalidArgument,
                 "1 tensors that this network lacks, one is 'extra'");
    ModelConfig other = small_config();
    other.fov_degrees = 30;
    const auto narrow = make(other);
    EXPECT_ERROR(model::load_state(*narrow, state, {}, report), Code::kInvalidArgument,
                 "another field of view");
}

/// The ray grid is checked before any parameter is written.
TEST_P(ModelRules, ARefusedRayGridChangesNothing) {
    const auto from = make(small_config());
    const auto to = make(small_config());
    randomise(*from, 110);
    const auto state = need(model::save_state(*from));
    const auto before = need(model::save_state(*to));
    const auto with_rays = [&](std::vector<std::int64_t> dims, std::vector<float> values) {
        io::NamedTensors changed;
        for (const io::NamedTensor& tensor : state)
            if (tensor.name != "ray_dirs") {
                EXPECT_OK(changed.add(tensor));
            }
        EXPECT_OK(changed.add({"ray_dirs", std::move(dims), io::NumberType::kF32, values}));
        return changed;
    };
    std::vector<float> broken = from->rays();
    broken[7] = NAN;
    const std::vector<std::int64_t> dims = {1, 3, 16, 16};
    model::LoadReport report;
    model::LoadOptions options;
    EXPECT_ERROR(model::load_state(*to, with_rays(dims, broken), options, report),
                 Code::kInvalidArgument, "'ray_dirs' holds nan at element 7");
    options.take_rays = true;
    EXPECT_ERROR(model::load_state(*to, with_rays(dims, broken), options, report),
                 Code::kInvalidArgument, "'ray_dirs' holds nan at element 7");
    options.graft = true;
    EXPECT_ERROR(
        model::load_state(*to, with_rays({1, 3, 2, 2}, std::vector<float>(12)), options, report),
        Code::kShape, "'ray_dirs' has shape [1, 3, 2, 2], expected [1, 3, 16, 16]");
    const auto after = need(model::save_state(*to));
    for (const io::NamedTensor& tensor : after)
        EXPECT_EQ(tensor.values, before.find(tensor.name)->values) << tensor.name;
}

/// Poses and view indices modulate like a given vector of their sines and cosines.
TEST_P(ModelRules, EmbedsPosesAndIndices) {
    ModelConfig config = small_config();
    config.views = 2;
    const auto encoded = [](const std::vector<double>& scalars, std::uint32_t dimension) {
        std::vector<float> values;
        for (const double s : scalars)
            for (const bool sine : {false, true})
                for (std::uint32_t j = 0; j < dimension / 2; ++j) {
                    const double angle = s * std::pow(10000.0, -2.0 * j / dimension);
                    values.push_back(static_cast<float>(sine ? std::sin(angle) : std::cos(angle)));
                }
        return values;
    };
    Inputs inputs(config);
    inputs.poses[16 + 8] = 0.5F;    // the second view's axis,
    inputs.poses[16 + 12] = -2.5F;  // the second view's place
    const std::vector<float> poses = encoded({0, 0, 0, 0, 0, 1, -2.5, 0, 0, 0.5, 0, 1}, 2);
    const std::vector<float> indices = encoded({0, 1}, 12);
    const auto predict = [&](model::Embedding kind, std::uint32_t dimension,
                             const std::vector<float>& given) {
        config.embedding = kind;
        config.embedding_dim = dimension;
        const auto model = make(config);
        if (!model) return std::vector<float>();
        randomise(*model, 70);
        model::ModelInput input = inputs.view();
        input.embedding = given;
        EXPECT_OK(model->set_input(input));
        EXPECT_OK(model->forward());
        return read(model->raw_output());
    };
    const std::vector<float> by_pose = predict(model::Embedding::kPose, 2, {});
    const std::vector<float> by_index = predict(model::Embedding::kIndex, 12, {});
    EXPECT_LE(relative_l2(by_pose, predict(model::Embedding::kCustom, 2, poses)), 1e-6);
    EXPECT_LE(relative_l2(by_index, predict(model::Embedding::kCustom, 2, indices)), 1e-6);
    EXPECT_GT(relative_l2(by_pose, by_index), 1e-4) << "they have an effect";
}

/// Which parameters get gradients, by parts of their names.
TEST_P(ModelRules, TrainsWhatIsChosen) {
    ModelOptions options;
    options.gradients = true;
    const auto trained = [&](const ModelConfig& config) {
        std::vector<std::string> names;
        const auto model = make(config, options);
        if (!model) return names;
        for (const nn::Parameter& parameter : model->parameters().all())
            if (parameter.grad.block != nullptr) names.push_back(parameter.name);
        return names;
    };
    const auto all_have = [](const std::vector<std::string>& names, auto&& rule) {
        return !names.empty() && std::all_of(names.begin(), names.end(), rule);
    };
    const auto has = [](const std::string& name, const char* part) {
        return name.find(part) != std::string::npos;
    };
    ModelConfig config = small_config();
    const std::size_t all = trained(config).size();
    config.frozen = {"norm", "16x16_conv."};
    const std::vector<std::string> rest = trained(config);
    EXPECT_LT(rest.size(), all);
    EXPECT_TRUE(all_have(rest, [&](const std::string& name) {
        return !has(name, "norm") && !has(name, "16x16_conv.");
    }));
    config.lora.rank = 2;
    config.lora.trained = {"16x16_conv.", "out.bias"};
    config.frozen = {"qkv", "conv.weight"};
    const std::vector<std::string> chosen = trained(config);
    EXPECT_TRUE(all_have(chosen, [&](const std::string& name) {
        return (has(name, "lora_") && !has(name, "qkv")) || has(name, "16x16_conv.bias") ||
               has(name, "out.bias");
    }));
    EXPECT_EQ(std::count_if(chosen.begin(), chosen.end(),
                            [&](const std::string& name) { return !has(name, "lora_"); }),
              2);

    const auto status = [&](void (*change)(ModelConfig&)) {
        ModelConfig changed = small_config();
        changed.lora.rank = 2;
        change(changed);
        return Model::create(context(), changed, options).status();
    };
    EXPECT_ERROR(status([](ModelConfig& c) { c.frozen = {"nrom"}; }), Code::kInvalidArgument,
                 "opt.freeze has 'nrom'");
    EXPECT_ERROR(status([](ModelConfig& c) { c.lora.targets = {"skip"}; }), Code::kInvalidArgument,
                 "opt.lora_targets has 'skip'");
    EXPECT_ERROR(status([](ModelConfig& c) { c.lora.trained = {"conv9"}; }), Code::kInvalidArgument,
                 "opt.train_with_adapters has 'conv9'");
}

/// The message names the key to change and the layer that refuses it.
TEST_P(ModelRules, NamesTheKeyWithoutAValidNetwork) {
    ModelConfig config = small_config();
    config.base_dim = 36;
    config.channel_mult = {1, 4};
    EXPECT_ERROR(Model::create(context(), config, {}), Code::kInvalidArgument,
                 "layer 'network_with_offset.encoder.enc.8x8_block0.norm1' has 144 channels, which "
                 "do not divide into its 32 groups; model.base_dim is 36");
    ModelOptions options;
    options.gradients = true;
    config = small_config();
    config.frozen = {"network_with_offset."};
    EXPECT_ERROR(Model::create(context(), config, options), Code::kInvalidArgument,
                 "opt.freeze leave no parameter to be trained");
    EXPECT_OK(Model::create(context(), config, {}));
    config = small_config();
    config.lora.rank = 2;
    config.lora.targets.clear();
    EXPECT_ERROR(Model::create(context(), config, options), Code::kInvalidArgument,
                 "opt.lora_targets, opt.train_with_adapters and opt.freeze leave no parameter");
    config.lora.trained = {"out.bias"};
    EXPECT_OK(Model::create(context(), config, options));
}

TEST_P(ModelRules, RefusesInputsThatDoNotFit) {
    const auto model = make(small_config());
    const Inputs good(small_config());
    Inputs bad = good;
    bad.images.pop_back();
    EXPECT_ERROR(model->set_input(bad.view()), Code::kShape, "'images' has 767 numbers");
    bad = good;
    bad.poses[3] = INFINITY;
    EXPECT_ERROR(model->set_input(bad.view()), Code::kInvalidArgument,
                 "'view_to_world' holds inf at 3");
}

}  // namespace
}  // namespace splat::test
