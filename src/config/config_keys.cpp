#include "config/config_keys.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "config/head_keys.h"
#include "core/json_writer.h"

namespace splat::config {
namespace {

using namespace rows;

constexpr Condition kModulated{
    [](const Settings& s) { return s.network.embedding != Embedding::kNone; },
    "where cam_embd.embedding is none"};
constexpr Condition kCustom{
    [](const Settings& s) { return s.network.embedding == Embedding::kCustom; },
    "without data.custom_embedding"};
constexpr Condition kTokens{[](const Settings& s) { return s.network.token_dim > 0; },
                            "where model.token_dim is 0"};
constexpr Condition kSong{[](const Settings& s) { return s.network.network == Network::kSongUnet; },
                          "where model.network is lgm_unet"};
constexpr Condition kLgm{[](const Settings& s) { return s.network.network == Network::kLgmUnet; },
                         "unless model.network is lgm_unet"};
constexpr Condition kStepped{[](const Settings& s) {
                                 return s.training.schedule == Schedule::kStep ||
                                        s.training.step_lr_at == 0;
                             },
                             "unless opt.lr_schedule is step"};
constexpr Condition kLpips{[](const Settings& s) { return s.training.weighs(&T::lpips_weight); },
                           "while opt.lambda_lpips is 0"};
constexpr Condition kSeldomRead{[](const Settings& s) { return !s.training.scale_terms; },
                                "while opt.scale_terms is true: each step is read at once"};
constexpr Condition kEdges{[](const Settings& s) { return s.training.weighs(&T::edge_weight); },
                           "while opt.lambda_edge is 0"};
constexpr Condition kCycle{[](const Settings& s) { return s.training.cycle_every > 0; },
                           "while opt.cycle.every is 0"};
constexpr Condition kAverage{[](const Settings& s) { return s.training.ema; },
                             "while opt.ema.use is false"};
constexpr Condition kAdapted{[](const Settings& s) { return s.network.lora.rank > 0; },
                             "while opt.lora_finetune is false: all parameters are trained"};

/// A word that is checked but not stored.
constexpr Field kOnlyChecked{KeyType::kChoice, Part::kNetwork,
                             [](const Config& config, const Key& key, Settings&) {
                                 int place = 0;
                                 return read_word(config, key, place);
                             }};

/// A boolean of the network that a rule of config_file.cpp reads.
template <class Write>
constexpr Field by_rule(Part part, Write) {
    return {KeyType::kBoolean, part, nullptr, [](const Key& key, const Settings& settings) {
                return write_field(key, Write()(settings.network));
            }};
}

constexpr Field kEmbedding{
    KeyType::kChoice, Part::kNetwork, nullptr, [](const Key& key, const Settings& settings) {
        const Embedding kind = settings.network.embedding;
        return write_word(key,
                          static_cast<int>(kind == Embedding::kCustom ? Embedding::kPose : kind));
    }};

/// Published files say -1 for all objects, TrainConfig says 0.
constexpr Field kSubset{
    KeyType::kInteger, Part::kTraining,
    [](const Config& config, const Key& key, Settings& settings) -> Status {
        SPLAT_ASSIGN(const std::int64_t count, config.get<std::int64_t>(key.name, -1));
        settings.training.subset =
            static_cast<std::uint32_t>(std::clamp<std::int64_t>(count, 0, 1 << 30));
        return {};
    },
    [](const Key&, const Settings& settings) {
        const std::int64_t count = settings.training.subset;
        return ConfigEntry{"", {count == 0 ? -1 : count}, false, false};
    }};

/// opt.step_lr_at: -1 means never. Published configurations have no opt.lr_schedule: the key alone asks for the step.
constexpr Field kStepAt{
    KeyType::kInteger, Part::kTraining,
    [](const Config& config, const Key& key, Settings& settings) -> Status {
        TrainConfig& c = settings.training;
        SPLAT_ASSIGN(const std::int64_t step, config.get<std::int64_t>(key.name, 0));
        c.step_lr_at = static_cast<std::uint64_t>(std::max<std::int64_t>(step, 0));
        if (step > 0 && config.find("opt.lr_schedule") == nullptr) c.schedule = Schedule::kStep;
        return check_range(config.what(), key, static_cast<double>(step));
    },
    [](const Key& key, const Settings& settings) {
        return write_field(key, settings.training.step_lr_at);
    }};

/// An empty list: stage_entries() writes the stages.
ConfigEntry write_stages(const Key&, const Settings&) {
    return {"", {}, true, false};
}
constexpr Field kStages{KeyType::kMaps, Part::kTraining, nullptr, write_stages};

/// opt.pretrained_hf: whether to fetch weights, or their name.
constexpr Field kHub{KeyType::kAny, Part::kTraining,
                     [](const Config& config, const Key& key, Settings&) -> Status {
                         if (config.get<bool>(key.name, false).ok()) return {};
                         return config.get<std::string>(key.name, "").status();
                     }};

constexpr Key kDataKeys[] = {
    {"data.training_resolution",
     kNetwork<&P::resolution>,
     {1, 4096},
     kPublished,
     "Pixels of an image's side; a multiple of 2^(levels of model.channel_mult - 1)."},
    {"data.fov", kNetwork<&P::fov_degrees>, below(0, 180), kPublished,
     "Field of view in degrees; 0: each view has its own focal lengths, as in CO3D."},
    {"data.znear", kNetwork<&P::znear>, kAll, kPublished,
     "Depth of the nearest Gaussians, in scene units; above 0, unless data.origin_distances are "
     "added."},
    {"data.zfar", kNetwork<&P::zfar>, kAll, kPublished,
     "Depth of the farthest Gaussians, beyond data.znear."},
    {"data.input_images", kNetwork<&P::views>, {1, 1e6}, kPublished, "Input images per object."},
    {"data.origin_distances", kNetwork<&P::origin_distance>, kAll, kPublished,
     "Add to each depth the distance of the origin, a last plane of the input; always true for "
     "CO3D."},
    {"data.use_pred_depth", kNetwork<&P::depth>, kAll, kPublished,
     "The network sees a channel of depth behind RGB."},
    {"data.use_pred_normal", kNetwork<&P::normal>, kAll, kPublished,
     "The network sees three channels of normals."},
    {"data.use_mask", kNetwork<&P::mask>, kAll, kOurs,
     "The network sees a channel with the mask of the object."},
    {"data.use_pred_plane", kNetwork<&P::plane>, kAll, kOurs,
     "The network sees five channels of planes: normal, distance, id."},
    {"data.custom_embedding",
     by_rule(Part::kNetwork, [](const P& c) { return c.embedding == Embedding::kCustom; }), kAll,
     kPublished, "Vectors of data.embedding_file take the place of the embedding of poses."},
    where(kCustom, {"data.embedding_file", kTraining<&T::embedding_file>, kAll, kOurs,
                    "Vectors of a custom embedding: .safetensors or .npz with an array [views, 6 "
                    "cam_embd.dimension] for each object, named 'split/object' or by the object; a "
                    "path, or one in the folder of the data."}),
    where(kTokens,
          {"data.tokens_file", kTraining<&T::tokens_file>, kAll, kOurs,
           "Tokens of the views, in the same way: arrays [views, model.token_dim, model.tokens]."}),
    resumable({"data.root", kTraining<&T::root>, kAll, kOurs, "Folder of the data set."}),
    {"data.format", kTraining<&T::format>, kAll, kOurs,
     "Format of the data set; empty: detected from its files."},
};

constexpr Key kListKeys[] = {
    {"data.objects_file", kTraining<&T::objects_file>, kAll, kOurs,
     "Objects of Objaverse in their order, before they are split: a JSON array of names, such as "
     "the published list of LVIS; a path, or one in the folder of the data."},
    {"data.excluded_file", kTraining<&T::excluded_file>, kAll, kOurs,
     "Sequences of CO3D to leave out: any text with their names, such as bad_sequences.py of "
     "Splatter Image."},
    {"data.views_file", kTraining<&T::views_file>, kAll, kOurs,
     "Test objects of NMR in their order, and the view that predictions start from: lines "
     "'category object view', such as src_dvr.txt of PixelNeRF."},
};

constexpr Key kSourceKeys[] = {
    {"data.category", kTraining<&T::category>, kAll, kPublished,
     "Name of the data set; cars, cars_priors, chairs, nmr, objaverse, gso, hydrants and "
     "teddybears imply their depths, field of view, background and image size, the last two also "
     "the geometry and losses of CO3D."},
    {"data.subset", kSubset, kAll, kPublished, "Objects used, the first in order; 0 or less: all."},
    {"data.allow_missing", kTraining<&T::allow_missing>, kAll, kOurs,
     "Leave objects out that lack a file, and name them, instead of refusing the data set."},
    {"data.white_background", kTraining<&T::white_background>, kAll, kPublished,
     "Images and renders have a white background instead of a black one."},
    resumable({"data.cache_mib", kTraining<&T::cache_mib>, kSteps, kOurs,
               "Host memory for decoded images, in MiB."}),
    harmless(unused<std::string>("data.name", "Name of the data set for the loader.")),
    harmless(unused<std::string>("data.split", "Part of the data set.")),
};

constexpr Key kEmbeddingKeys[] = {
    {"cam_embd.embedding", kEmbedding, words("none, pose, index"), kPublished,
     "What modulates the blocks of the network: nothing (or null), camera poses, indices of "
     "views."},
    where(kModulated,
          {"cam_embd.dimension", kNetwork<&P::embedding_dim>, kCount, kPublished,
           "Sines and cosines per number; with an embedding an even number from 2 to 64."}),
    where(kModulated, {"cam_embd.film", kNetwork<&P::film>, words("reference, affine"), kOurs,
                       "How an embedding enters a block: as published weights need it, or gamma * "
                       "norm(x) + beta."}),
    harmless({"cam_embd.method", kOnlyChecked, words("film, concat"), kPublished,
              "With an embedding it must be film.", "\"film\"", false}),
    harmless({"cam_embd.encode_embedding", kOnlyChecked, words("positional, fourier"), kPublished,
              "With an embedding that is not the caller's it must be positional.", "\"positional\"",
              false}),
};

constexpr Key kModelKeys[] = {
    {"model.network", kNetwork<&P::network>, words("song_unet, lgm_unet"), kOurs,
     "Which network: that of Splatter Image and F3D-Gaus, or that of LGM."},
    where(kSong, {"model.base_dim",
                  kNetwork<&P::base_dim>,
                  {4, 4096},
                  kPublished,
                  "Channels of the first level."}),
    where(kSong, {"model.num_blocks",
                  kNetwork<&P::num_blocks>,
                  {1, 64},
                  kPublished,
                  "Blocks of each level."}),
    where(
        kSong,
        {"model.channel_mult",
         kNetwork<&P::channel_mult>,
         {1, 1024},
         kOurs,
         "Channels of each of 1 to 8 levels, in units of model.base_dim; 4096 channels at most."}),
    where(kSong, {"model.attention_resolutions",
                  kNetwork<&P::attention_resolutions>,
                  {1, 1e6},
                  kPublished,
                  "Levels with attention, given by the pixels of their side."}),
    where(kSong, {"model.cross_view_attention", kNetwork<&P::cross_view_attention>, kAll,
                  kPublished, "Attention reaches over all input images of an object."}),
    where(kSong, {"model.dropout", kNetwork<&P::dropout>, below(0, 1), kOurs,
                  "Fraction of activations that are dropped in training."}),
    where(kLgm, {"model.down", kNetwork<&P::lgm, &LgmUnetConfig::down>, Values{32, 4096}, kOurs,
                 "Channels of each of 1 to 8 levels of lgm_unet, from the image inwards."}),
    where(kLgm, {"model.down_attention", kNetwork<&P::lgm, &LgmUnetConfig::down_attention>,
                 Values{0, 1}, kOurs, "For each of them 1 if it has attention, else 0."}),
    where(kLgm, {"model.up", kNetwork<&P::lgm, &LgmUnetConfig::up>, Values{32, 4096}, kOurs,
                 "Channels of the levels on the way back; fewer than model.down: Gaussians of "
                 "fewer pixels than the image has."}),
    where(kLgm, {"model.up_attention", kNetwork<&P::lgm, &LgmUnetConfig::up_attention>,
                 Values{0, 1}, kOurs, "For each of them 1 if it has attention, else 0."}),
};

constexpr Key kGaussianKeys[] = {
    {"model.max_sh_degree",
     kNetwork<&P::sh_degree>,
     {0, 1},
     kPublished,
     "Degree of the spherical harmonics of colours."},
    {"model.isotropic", kNetwork<&P::isotropic>, kAll, kPublished,
     "Gaussians have one scale instead of three."},
    where(kOnRays, {"model.network_without_offset",
                    by_rule(Part::kNetwork, [](const P& c) { return !c.offset; }), kAll, kPublished,
                    "Gaussians stay on the rays of their pixels."}),
    where(kSong, {"model.inverted_x", kNetwork<&P::inverted_x>, kAll, kPublished,
                  "The x axis of rays points left in the image, else right."}),
    where(kSong, {"model.inverted_y", kNetwork<&P::inverted_y>, kAll, kPublished,
                  "The y axis of rays points down in the image, else up."}),
    where(kRayDepths, {"model.depth_scale", kNetwork<&P::init_depth, &HeadInit::scale>, kAll,
                       kPublished, "Gain of the initial weights of depths."}),
    where(kRayDepths, {"model.depth_bias", kNetwork<&P::init_depth, &HeadInit::bias>, kAll,
                       kPublished, "Initial bias of depths."}),
    {"model.xyz_scale", kNetwork<&P::init_offset, &HeadInit::scale>, kAll, kPublished,
     "Gain of the initial weights of offsets."},
    {"model.xyz_bias", kNetwork<&P::init_offset, &HeadInit::bias>, kAll, kPublished,
     "Initial bias of offsets."},
    {"model.opacity_scale", kNetwork<&P::init_opacity, &HeadInit::scale>, kAll, kPublished,
     "Gain of the initial weights of opacities."},
    {"model.opacity_bias", kNetwork<&P::init_opacity, &HeadInit::bias>, kAll, kPublished,
     "Initial bias of opacities, before the sigmoid."},
    {"model.scale_scale", kNetwork<&P::init_scale, &HeadInit::scale>, kAll, kPublished,
     "Gain of the initial weights of scales."},
    {"model.scale_bias", kNetwork<&P::init_scale, &HeadInit::bias>, above(0), kPublished,
     "Initial scale of Gaussians, in scene units."},
    {"model.named_resolution",
     kNetwork<&P::named_resolution>,
     {0, 4096},
     kOurs,
     "Pixels of the image whose sizes name the levels, also those of model.attention_resolutions; "
     "0: data.training_resolution."},
    {"model.token_dim", kNetwork<&P::token_dim>, kCount, kOurs,
     "Features of the tokens that the decoder attends to; 0: no tokens."},
    {"model.tokens", kNetwork<&P::tokens>, kCount, kOurs,
     "Tokens of an image; 0 where model.token_dim is 0."},
    {"model.network_with_offset",
     {KeyType::kBoolean, Part::kNetwork},
     kAll,
     kPublished,
     "The opposite of model.network_without_offset; one of the two is enough.",
     "true"},
    harmless(unused<std::string>("model.name", "Class of the network.")),
    harmless(unused<std::uint32_t>(
        "model.out_channels", "Channels of the network's output, which follow from other keys.")),
};

constexpr Key kAdapterKeys[] = {
    {"opt.freeze", kNetwork<&P::frozen>, kAll, kOurs,
     "Parts of names of parameters that are never trained."},
    {"opt.lora_finetune", by_rule(Part::kAdapters, [](const P& c) { return c.lora.rank > 0; }),
     kAll, kPublished, "Train low-rank adapters instead of the parameters.", "false"},
    where(kAdapted, {"opt.lora_rank", kAdapters<&LoraConfig::rank>, kCount, kPublished,
                     "Rank of the adapters, 1 or more; the published code always takes 4."}),
    where(kAdapted, {"opt.lora_alpha", kAdapters<&LoraConfig::alpha>, kAll, kPublished,
                     "The branch of an adapter is scaled by alpha / rank."}),
    where(kAdapted, {"opt.lora_dropout", kAdapters<&LoraConfig::dropout>, below(0, 1), kPublished,
                     "Fraction of an adapter's input that is dropped in training; without effect "
                     "in the published code."}),
    where(kAdapted, {"opt.lora_targets", kAdapters<&LoraConfig::targets>, kAll, kOurs,
                     "Parts of names of the layers that get an adapter."}),
    where(kAdapted, {"opt.train_with_adapters", kAdapters<&LoraConfig::trained>, kAll, kOurs,
                     "Parts of names of parameters that are trained besides the adapters."}),
};

constexpr Key kOptimiserKeys[] = {
    resumable({"opt.iterations", kTraining<&T::iterations>, kSteps, kPublished,
               "Updates of the parameters."}),
    {"opt.batch_size", kTraining<&T::batch_size>, {1, 4096}, kPublished, "Objects per update."},
    {"opt.micro_batch", kTraining<&T::micro_batch>, Values{1, 4096}, kOurs,
     "Objects per pass of the network; a divisor of opt.batch_size."},
    where(kSeldomRead,
          resumable({"opt.read_every", kTraining<&T::read_every>, Values{1, 65536}, kOurs,
                     "Steps whose results are read together; an interruption waits for them."})),
    resumable({"opt.recompute", kTraining<&T::recompute>, kAll, kOurs,
               "Compute activations twice: the same numbers in less memory and more time."}),
    {"opt.imgs_per_obj",
     kTraining<&T::targets>,
     {1, 256},
     kPublished,
     "Images rendered and compared per object."},
    {"opt.base_lr",
     kTraining<&T::learning_rate>,
     {0, 1000},
     kPublished,
     "Learning rate after the warm-up."},
    {"opt.betas", kTraining<&T::betas>, below(0, 1), kPublished,
     "Decay of the first and second moments of Adam."},
    {"opt.eps", kTraining<&T::eps>, above(0), kOurs, "Added to the denominator of Adam."},
    {"opt.lr_schedule", kTraining<&T::schedule>, words("constant, cosine, step"), kOurs,
     "Learning rate: constant, half a cosine that is 0 one update after the last, or a tenth from "
     "opt.step_lr_at on."},
    {"opt.warmup", kTraining<&T::warmup>, kSteps, kOurs,
     "Updates in which the learning rate rises from 0."},
    where(kStepped, {"opt.step_lr_at", kStepAt, Values{-1, 1e15}, kPublished,
                     "First update with a tenth of the learning rate, where opt.lr_schedule is "
                     "step or not given. Never: -1."}),
    {"opt.loss", kTraining<&T::pixel_loss>, words("l2, l1"), kPublished,
     "Difference of pixels: its square, or its magnitude."},
};

/// Weights of the terms of the loss from the first one named on.
template <std::size_t First, std::size_t... I>
constexpr std::array<Key, sizeof...(I)> term_keys(std::index_sequence<I...>) {
    return {{{kLossTerms[First + I].key,
              kTraining<kLossTerms[First + I].weight>,
              {0, kLossTerms[First + I].most},
              kLossTerms[First + I].published ? kPublished : kOurs,
              kLossTerms[First + I].about}...}};
}
/// The keys of edges stand behind the weight of edges.
static_assert(std::string_view(kLossTerms[1].key) == "opt.lambda_edge");
constexpr auto kFirstTermKeys = term_keys<0>(std::make_index_sequence<2>());
constexpr auto kMoreTermKeys = term_keys<2>(std::make_index_sequence<std::size(kLossTerms) - 2>());

constexpr Key kEdgeKeys[] = {
    where(kEdges, {"opt.edge_filter", kTraining<&T::edge_filter>, words("sobel, scharr"), kOurs,
                   "Derivative of the difference of edges."}),
    where(kEdges,
          {"opt.edge_by_size", kTraining<&T::edge_by_size>, kAll, kOurs,
           "Weigh the difference of edges by the size of the Gaussians that a pixel shows."}),
};

constexpr Key kUpdateKeys[] = {
    where(kLpips, {"opt.start_lpips_after", kTraining<&T::lpips_after>, kSteps, kPublished,
                   "Updates before LPIPS is part of the loss."}),
    where(kLpips, {"opt.lpips_weights", kTraining<&T::lpips_weights>, kAll, kOurs,
                   "Files of weights of VGG16 and of LPIPS."}),
    {"opt.target_resolution", kTraining<&T::target_resolution>, Values{0, 4096}, kOurs,
     "Pixels of the side of images that are compared, a divisor of data.training_resolution: "
     "targets are means of their pixels; 0: all of them."},
    {"opt.stages", kStages, kAll, kOurs,
     "Parts of the training, one after another: maps of iterations and, where they differ from "
     "opt, batch_size, base_lr, loss, target_resolution and the lambda_ of losses."},
    {"opt.scale_terms", kTraining<&T::scale_terms>, kAll, kOurs,
     "Hold scales between 1e-5 and 20; true for CO3D unless given."},
    {"opt.cycle.every", kTraining<&T::cycle_every>, kSteps, kOurs,
     "Each so many updates predict from a drawn view of a prediction, and train on the joined "
     "Gaussians; 0: none."},
    where(kCycle, {"opt.cycle.after", kTraining<&T::cycle_after>, kSteps, kOurs,
                   "Updates before the first of these."}),
    where(kCycle, {"opt.cycle.weight", kTraining<&T::cycle_weight>, above(0), kOurs,
                   "Weight of the loss in these updates."}),
    {"opt.ema.use", kTraining<&T::ema>, kAll, kPublished, "Keep averaged weights, and store them."},
    where(kAverage, {"opt.ema.beta", kTraining<&T::ema_most>, below(0, 1), kPublished,
                     "Upper limit of the average's decay."}),
    where(kAverage, {"opt.ema.update_every", kTraining<&T::ema_every>, kSteps, kPublished,
                     "Updates of the parameters per update of the average, at least 1."}),
    where(kAverage, {"opt.ema.update_after_step", kTraining<&T::ema_after>, kSteps, kPublished,
                     "First updates, in which the average is a copy."}),
    {"opt.pretrained_ckpt", kTraining<&T::pretrained>, kAll, kPublished,
     "Weights to start from: a file, or the folder of a run (model_latest.pth, "
     "weights_last.safetensors)."},
    {"opt.pretrained_hf", kHub, kAll, kPublished,
     "Start from weights of a hub, which must be fetched by hand; see opt.pretrained_ckpt.",
     nullptr, false},
    unused<std::uint32_t>("opt.epochs", "Passes over the data set; see opt.iterations."),
    {"opt.ambient_light", {}, kAll, kPublished, "Light of the renders.", nullptr, false},
    resumable({"opt.num_workers", kTraining<&T::loader_threads>, Values{0, 64}, kPublished,
               "Threads that read batches ahead; 0: one on a CPU device, up to four on a GPU."}),
};

constexpr Key kRunKeys[] = {
    resumable({"logging.ckpt_iterations", kTraining<&T::checkpoint_every>, kSteps, kPublished,
               "Updates between saved states."}),
    resumable({"logging.val_log", kTraining<&T::validate_every>, kSteps, kPublished,
               "Updates between validations, the first before update 1; 0: only at the end."}),
    resumable({"logging.loss_log", kTraining<&T::log_every>, kSteps, kPublished,
               "Updates between lines of metrics."}),
    unused<std::uint64_t>("logging.render_log",
                          "Updates between pictures of renders, which are drawn at each "
                          "validation; see logging.val_log."),
    resumable({"logging.val_objects", kTraining<&T::validation_objects>, kCount, kOurs,
               "Objects of a validation; 0: all."}),
    resumable({"logging.val_views", kTraining<&T::validation_views>, kCount, kOurs,
               "Views per object of a validation, spread over all of them; 0: all."}),
    unused<std::uint64_t>("logging.loop_log",
                          "Updates between videos; see vkrun render --animate."),
    {"general.random_seed", kTraining<&T::seed>, kSteps, kPublished,
     "Seed of the initial weights, of dropout, and of the choice of objects and views."},
    {"general.precision", kTraining<&T::precision>, words("strict, balanced, fast"), kOurs,
     "Which kernels convolutions may use: the most exact ones, or faster ones."},
    harmless(unused<std::uint32_t>("general.device", "Number of a GPU; see vkrun train --device.")),
    harmless(unused<std::uint32_t>("general.num_workers", "See opt.num_workers.")),
    unused<bool>("general.mixed_precision",
                 "Half precision, which there is not; see general.precision."),
    unused<bool>("general.multiple_gpu", "Train on several GPUs; one device is used."),
    unused<std::uint32_t>("general.num_devices", "How many GPUs; one device is used."),
};

template <class... Sections>
constexpr auto join(const Sections&... sections) {
    std::array<Key, ((sizeof(Sections) / sizeof(Key)) + ...)> all{};
    auto end = all.begin();
    ((end = std::copy(std::begin(sections), std::end(sections), end)), ...);
    return all;
}

/// Constant, so that it needs no allocation, which could fail.
constexpr auto kKeys = join(kDataKeys, kListKeys, kSourceKeys, kEmbeddingKeys, kModelKeys,
                            kGaussianKeys, kHeadKeys, kAdapterKeys, kOptimiserKeys, kFirstTermKeys,
                            kEdgeKeys, kMoreTermKeys, kUpdateKeys, kRunKeys);

}  // namespace

std::span<const Key> all_keys() {
    return kKeys;
}

const Key* find_key(std::string_view name) {
    const auto found = std::find_if(all_keys().begin(), all_keys().end(),
                                    [name](const Key& key) { return key.name == name; });
    return found == all_keys().end() ? nullptr : &*found;
}

const Key& key_of(std::string_view name) {
    const Key* key = find_key(name);
    SPLAT_ASSERT(key != nullptr);
    return *key;
}

std::string default_text(const Key& key) {
    if (key.otherwise != nullptr) return key.otherwise;
    if (key.field.write == nullptr) return "null";
    Settings settings;
    if (key.field.part == Part::kAdapters) settings.network.lora.rank = kPublishedRank;
    return config_value_text(key.field.write(key, settings));
}

const char* type_name(KeyType type) {
    constexpr const char* kNames[] = {
        "integer",          "number",          "boolean",       "text",         "choice",
        "list of integers", "list of numbers", "list of texts", "list of maps", "any"};
    return kNames[static_cast<int>(type)];
}

std::string keys_json() {
    JsonWriter json;
    json.begin_array();
    for (const Key& key : all_keys())
        json.newline()
            .begin_object()
            .member("key", key.name)
            .member("type", type_name(key.field.type))
            .member("range", range_text(key))
            .key("default")
            .raw(default_text(key))
            .member("origin", key.origin == Origin::kPublished ? "published" : "ours")
            .member("effect", key.acts)
            .member("resumable", key.resumable)
            .member("about", key.about)
            .end();
    return json.end().text();
}

}  // namespace splat::config
