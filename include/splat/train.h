/* libsplat: configurations and training.
 *
 * A trainer of the published cars model:
 *
 *   splat_trainer trainer;
 *   splat_trainer_desc desc = {.struct_size = sizeof desc};
 *   splat_trainer_create(device, &desc, &trainer); */
#ifndef SPLAT_TRAIN_H
#define SPLAT_TRAIN_H

#include "data.h"
#include "group.h"
#include "model.h"
#include "run.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Configuration --------------------------------------------------------------------------- */

/* JSON array of all keys of a configuration, in the order of their sections: {"key", "type"
 * ("integer", "number", "boolean", "text", "choice", "list of integers", "list of numbers", "list
 * of texts", "list of maps", or "any" of these), "range" (as text; the words of a choice; empty:
 * any value of the type), "default" (null: none), "origin" ("published": of Splatter Image or its
 * fork with priors; "ours"), "effect" (false: accepted, but without effect), "resumable" (true: a
 * run may go on with another value), "about" (one sentence)}.
 * Returns SPLAT_OK or SPLAT_INCOMPLETE. */
SPLAT_API splat_result splat_config_keys(char* buffer, size_t capacity, size_t* needed);

/* Say what a training of a configuration would leave out. JSON: {"warnings": [sentences]}: keys
 * that have no effect here, adapters that cannot use new input channels. splat_training_open gives
 * the same sentences as messages.
 * text, values, count   as splat_config_merge, which takes all keys that are known
 * Returns as splat_config_merge; SPLAT_ERROR_INVALID_ARGUMENT also where splat_training_open
 *   refuses (opt.pretrained_hf; adapters without opt.lora_finetune; no file of vectors) */
SPLAT_API splat_result splat_config_check(const char* text, const char* const* values, size_t count,
                                          char* buffer, size_t capacity, size_t* needed);

/* Make a configuration of network and training with every value, as JSON for splat_model_create and
 * splat_trainer_create, from the text of a YAML or JSON file and changes to it.
 * text    NULL: the defaults, those of the published cars model
 * values  `count` texts "key=value", such as "opt.base_lr=1e-4"; later ones win. With another
 *         data.category, values of the text that the old one implies become those of the new one.
 * Keys and their meanings: splat_config_keys.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_ARGUMENT (an unknown key, with the
 *   nearest known one; a value outside its range) */
SPLAT_API splat_result splat_config_merge(const char* text, const char* const* values, size_t count,
                                          char* buffer, size_t capacity, size_t* needed);

/* JSON array of the published configurations that the library has by name: {"name", "about"}.
 * Returns SPLAT_OK or SPLAT_INCOMPLETE. */
SPLAT_API splat_result splat_config_presets(char* buffer, size_t capacity, size_t* needed);

/* The text of one of them, such as "cars", in YAML, for splat_config_merge.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_ARGUMENT (NULL, no such name) */
SPLAT_API splat_result splat_config_preset(const char* name, char* buffer, size_t capacity,
                                           size_t* needed);

/* ---- Optimizer ------------------------------------------------------------------------------- */

/* Adam (Kingma & Ba 2015, without weight decay) over parameters of models, modules and tensors, in
 * groups with their own rates, with a schedule of the rate and averaged weights (EMA). A trainer
 * has one of its own. The caller synchronises calls on one optimizer and on what it updates.
 * Steps keep no range: of scales and opacities update logarithms and logits, see
 * splat_gaussians_desc.
 *
 * Twenty steps of a model and of a tensor, at a tenth of the rate for biases:
 *
 *   splat_optimizer_item items[] = {
 *       {.model = model}, {.name = "offset", .parameter = offset, .gradient = grad_offset}};
 *   splat_optimizer_group groups[] = {{.pattern = "*.bias", .rate_factor = 0.1}};
 *   splat_optimizer_desc desc = {sizeof desc, .items = items, .item_count = 2, .groups = groups,
 *                                .group_count = 1, .rate = 1e-3};
 *   splat_optimizer_create(device, &desc, &optimizer);
 *   for (int i = 0; i < 20; ++i) {
 *       splat_optimizer_zero_gradients(optimizer);
 *       ...                                          // forward, loss, backward
 *       splat_optimizer_step(optimizer, NULL);
 *   } */

/* What to update: a model, a module, or one tensor; the other handles are NULL. Frozen. */
typedef struct splat_optimizer_item {
    /* a tensor's name; or a prefix for the names of a model's or module's trainable parameters,
     * NULL: none */
    const char* name;
    splat_model model;      /* created with SPLAT_MODEL_GRADIENTS */
    splat_module module;    /* created with SPLAT_MODULE_GRADIENTS */
    splat_tensor parameter; /* float32 */
    splat_tensor gradient;  /* same shape as `parameter` */
} splat_optimizer_item;

/* Parameters with numbers of their own; 0: those of the desc. Of several groups that match a name,
 * the first has the parameter. A group without effect is refused. Frozen. */
typedef struct splat_optimizer_group {
    const char* pattern; /* matches names: '*' is any text, '?' one character */
    double rate_factor;  /* multiplies the desc's rate; 0: 1 */
    double beta1;
    double beta2;
    double eps;
} splat_optimizer_group;

/* How the rate changes with the steps. */
typedef int32_t splat_schedule;
enum {
    SPLAT_SCHEDULE_CONSTANT = 1, /* the same rate in every step */
    SPLAT_SCHEDULE_COSINE = 2,   /* half a cosine, zero one step after total_steps */
    SPLAT_SCHEDULE_STEP = 3      /* a tenth from step step_at on */
};

typedef struct splat_optimizer_desc {
    uint32_t struct_size;
    uint32_t flags;   /* 0 */
    const void* next; /* NULL */
    const splat_optimizer_item* items;
    uint64_t item_count;
    const splat_optimizer_group* groups;
    uint64_t group_count;
    double rate;             /* 0: 5e-5 */
    double beta1;            /* 0: 0.9 */
    double beta2;            /* 0: 0.999 */
    double eps;              /* 0: 1e-15 */
    splat_schedule schedule; /* 0: SPLAT_SCHEDULE_CONSTANT */
    uint32_t reserved;
    uint64_t warmup_steps; /* steps in which the rate rises from zero, in any schedule */
    uint64_t total_steps;  /* end of SPLAT_SCHEDULE_COSINE, more than warmup_steps; else 0 */
    uint64_t step_at;      /* step at which SPLAT_SCHEDULE_STEP lowers the rate; else 0 */
    /* The averages decay by min(ema_decay, 1 - (1 + step - ema_after)^(-2/3)); up to ema_after they
     * are copies. ema_decay 0: no averages; ema_every 0: every step */
    double ema_decay;
    uint64_t ema_every;
    uint64_t ema_after;
} splat_optimizer_desc;

/* Create an optimizer; its moments are zero. It keeps models, modules and tensors alive.
 * device    that of all items
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      a field of desc outside its range or without effect; an item
 *                                     with no or several objects; no parameters, two of one name,
 *                                     one listed twice; a group without effect: its pattern matches
 *                                     nothing, or only what groups before it have
 *   SPLAT_ERROR_INVALID_STATE         a model or module created without gradients
 *   SPLAT_ERROR_SHAPE_MISMATCH        a gradient of another shape than its parameter
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_optimizer_create(splat_device device, const splat_optimizer_desc* desc,
                                              splat_optimizer* optimizer);

/* What an optimizer has and what its last step did. */
typedef struct splat_optimizer_info {
    uint32_t struct_size;
    uint32_t was_skipped;    /* 1: the last step found gradients that are not finite; no update */
    uint64_t step;           /* updates done */
    uint64_t skipped;        /* steps without an update */
    double rate;             /* rate of the last step; before the first, of the next */
    uint64_t non_finite;     /* numbers of the last step's gradients that are NaN or infinite */
    uint32_t gradients_zero; /* 1: all gradients of the last step were 0, so it taught nothing */
    uint32_t averaged;       /* 1: there are averages */
    uint64_t parameters;     /* tensors */
    uint64_t elements;       /* numbers in these tensors, in the rows in use */
} splat_optimizer_info;

/* Update the parameters from their gradients, which stay. If a gradient is not finite, nothing is
 * updated: that is no error.
 * info      out, may be NULL
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (info),
 *   SPLAT_ERROR_INVALID_STATE (a mapped tensor), SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST;
 *   after the last two the parameters are undefined */
SPLAT_API splat_result splat_optimizer_step(splat_optimizer optimizer, splat_optimizer_info* info);

/* Set all gradients to zero.
 * Returns as splat_optimizer_step. */
SPLAT_API splat_result splat_optimizer_zero_gradients(splat_optimizer optimizer);

/* Reorder, drop and add rows of tensors, with their moments and averages: the Gaussians of a scene that
 * is fitted. A tensor's first dimension counts its rows; all are in use at first, and afterwards the
 * first `count`, which is all that steps update and splat_optimizer_store copies. Later rows of its
 * memory are for new ones. Gradients stay as they are.
 *
 * Keep the rows 0 and 2 of the tensors gaussians.means, gaussians.scales..., then add one:
 *
 *   const int64_t kept[] = {0, 2};
 *   splat_optimizer_gather_rows(optimizer, "gaussians.*", kept, 2);
 *   ...                                              // write row 2 of each tensor
 *   const int64_t grown[] = {0, 1, -1};
 *   splat_optimizer_gather_rows(optimizer, "gaussians.*", grown, 3);
 *
 * pattern   of the names of tensors with equally many rows, in use and in memory; '*' is any text, '?'
 *           one character
 * rows      in, `count` numbers: row i becomes row rows[i]. With -1 it is a new row: row i as it lies in
 *           the tensor, its moments are 0 and its average is its value. A step may change up to 3
 *           numbers after the last row in use: write new rows right before this call
 * count     1 to the tensors' first dimension
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a pattern that matches nothing, no rows or more than the
 *                                     tensors hold, a row that is not in use
 *   SPLAT_ERROR_SHAPE_MISMATCH        tensors with other numbers of rows
 *   SPLAT_ERROR_UNSUPPORTED           parameters of a model or module
 *   SPLAT_ERROR_INVALID_STATE         a mapped tensor
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY
 *   SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST  the parameters are undefined; else nothing changed */
SPLAT_API splat_result splat_optimizer_gather_rows(splat_optimizer optimizer, const char* pattern,
                                                   const int64_t* rows, uint64_t count);

/* Replace desc.rate, which the schedule and the groups scale.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (rate < 0, not
 * finite) */
SPLAT_API splat_result splat_optimizer_set_rate(splat_optimizer optimizer, double rate);

/* Describe an optimizer and its last step. Does not wait for a call on another thread.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT. */
SPLAT_API splat_result splat_optimizer_get_info(splat_optimizer optimizer,
                                                splat_optimizer_info* info);

/* Copy the averaged parameters, by name, to new weights; without averages the parameters.
 * Returns as splat_model_store. */
SPLAT_API splat_result splat_optimizer_store(splat_optimizer optimizer, splat_weights* weights);

/* Copy moments, averages, counters, numbers of rows and rate to new weights, to be saved as .safetensors with
 * splat_weights_save. Parameters are not in it: store them beside it.
 * Returns as splat_model_store. */
SPLAT_API splat_result splat_optimizer_save(splat_optimizer optimizer, splat_weights* state);

/* Go on from such weights, bit-exactly. On an error the optimizer is unchanged.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      weights that are no state, or that of other parameters */
SPLAT_API splat_result splat_optimizer_load(splat_optimizer optimizer, splat_weights state);

/* Destroy an optimizer; what it updated stays.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_optimizer_destroy(splat_optimizer optimizer);

/* ---- Trainer --------------------------------------------------------------------------------- */

/* A network in training: parameters, Adam's moments, averaged weights, and the rasterizer that
 * draws its Gaussians. The caller synchronises calls on one trainer. */

typedef struct splat_trainer_desc {
    uint32_t struct_size;
    uint32_t flags; /* 0 */
    const void* next;
    const char* config; /* from splat_config_merge; NULL: the defaults */
} splat_trainer_desc;

/* Create a trainer; the parameters of its network are zero. What splat_config_check warns of goes to
 * the log.
 * Returns as splat_model_create; SPLAT_ERROR_INVALID_ARGUMENT also as splat_config_check, but files
 *   of vectors are not needed; for opt.stages and opt.target_resolution, which only
 *   splat_training_open takes; and for opt.lambda_plane of a network without a Gaussian for each pixel
 *   of its input, with model.head.positions box, or with opt.cycle.every. */
SPLAT_API splat_result splat_trainer_create(splat_device device, const splat_trainer_desc* desc,
                                            splat_trainer* trainer);

/* Return the network in training, to initialise, load, store and read it: a separate handle, which
 * the caller destroys and which keeps the trainer's memory alive. Its passes apply dropout as in
 * training.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL). */
SPLAT_API splat_result splat_trainer_model(splat_trainer trainer, splat_model* model);

/* B = opt.batch_size objects with V = data.input_images input and T = opt.imgs_per_obj target
 * images; poses are relative to the object's first input image. Counts are of elements in the array
 * beside them; 0: trusted. */
typedef struct splat_trainer_batch {
    uint32_t struct_size;
    uint32_t reserved;   /* 0 */
    const float* images; /* [B*V,channels,R,R] */
    uint64_t images_count;
    const float* view_to_world; /* [B*V,4,4] row vectors */
    uint64_t view_to_world_count;
    const float* quaternions; /* [B*V,4] w x y z */
    uint64_t quaternions_count;
    const float* focals; /* [B*V,2] pixels; NULL unless data.fov is 0 */
    uint64_t focals_count;
    const float* embedding; /* [B*V,length] of a custom embedding, else NULL */
    uint64_t embedding_count;
    const float* tokens; /* [B*V,token_dim,tokens], else NULL */
    uint64_t tokens_count;
    const float* targets; /* [B*T,3,R,R] */
    uint64_t targets_count;
    const splat_camera* cameras; /* B*T, of R x R pixels */
    uint64_t cameras_count;
    uint32_t channels; /* channels per input image, as in the configuration; 0: not checked */
    uint32_t objects;  /* B, as in the configuration; 0: not checked */
    /* [B*V,5,R,R] if opt.lambda_plane > 0, else NULL; see splat_dataset_views. Pixels of one plane have
     * equal floats as their ids */
    const float* planes;
    uint64_t planes_count;
} splat_trainer_batch;

/* What a step of a training did. */
typedef struct splat_trainer_info {
    uint32_t struct_size;
    uint32_t skipped;     /* 1: loss or gradients were not finite, and nothing was updated */
    uint64_t step;        /* updates done */
    uint64_t pairs;       /* (tile, Gaussian) pairs that were drawn */
    double loss;          /* mean over the batch, like the following */
    double squared_error; /* mean of the squared differences, over pixels and channels */
    double pixel_loss;    /* the part of `loss` that compares pixels */
    double ssim;          /* structural similarity; 0 unless opt.lambda_ssim > 0 */
    double network_ms;    /* time of the network's passes */
    double render_ms;     /* time of the rasterizer's passes */
    double update_ms;     /* time of the update */
    double lpips; /* distance; 0 unless opt.lambda_lpips > 0, and before opt.start_lpips_after */
    uint64_t visible;        /* (Gaussian, target) pairs that reach a tile; 0: nothing was drawn */
    uint64_t culled;         /* (Gaussian, target) pairs that reach no tile */
    uint64_t non_finite;     /* numbers that the network gave which are NaN or infinite */
    uint32_t gradients_zero; /* 1: every gradient of a parameter is 0, so nothing is learnt */
    uint32_t reserved;
    double rate;      /* learning rate of this update, or of the one that was skipped */
    double edge_loss; /* loss of edges, mean over the batch; 0 unless opt.lambda_edge > 0 */
    double plane_loss; /* Gaussians off their planes, mean over the batch, scene units squared; 0 unless
                        * opt.lambda_plane > 0 */
} splat_trainer_info;

/* Do one update. Arrays are read before the call returns.
 * info      in/out, struct_size set: what this step did. NULL: the device decides by itself whether to update,
 *           and splat_trainer_read gives later what it did. The host reads only how many pairs are drawn, as it
 *           makes room for them, and scales for CO3D's terms; and all that is unread where it must know whether
 *           LPIPS begins, or when 16 steps, or opt.read_every if that is more, but at most 256, are unread
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH and
 *   SPLAT_ERROR_INVALID_ARGUMENT as splat_model_forward, the latter also for planes that are not finite,
 *   a plane whose normal is shorter than 0.5, more than 255 planes of a view;
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST; no update */
SPLAT_API splat_result splat_trainer_step(splat_trainer trainer, const splat_trainer_batch* batch,
                                          splat_trainer_info* info);

/* Read what the steps without `info` did, oldest first, each step once. Nothing of them is lost if a step with
 * `info`, splat_trainer_save, splat_trainer_store or splat_trainer_resume comes before; of more than 65,536
 * steps the latest are kept.
 * infos     in/out, `capacity` of them, struct_size of each set to the same; may be NULL when capacity is 0
 * count     out, how many there were; may be NULL. Those that do not fit are given by the next call
 * Returns SPLAT_OK, SPLAT_INCOMPLETE (what fits was given), SPLAT_ERROR_INVALID_HANDLE,
 *   SPLAT_ERROR_INVALID_ARGUMENT (infos), SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST; none is given then */
SPLAT_API splat_result splat_trainer_read(splat_trainer trainer, splat_trainer_info* infos,
                                          size_t capacity, size_t* count);

/* JSON: {"step" (updates by the steps that were read), "attempts" (all steps, with skipped ones), "unread" (steps
 * that were not read), "skipped" (steps without an update in a row, up to the last that was read),
 * "parameters", "trainable", "ledger" (of the last step that was read; null before the first): {"visible",
 * "culled", "non_finite", "gradients_zero"} (see splat_trainer_info), "config"}. Does not wait for a call on
 * another thread.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE */
SPLAT_API splat_result splat_trainer_report(splat_trainer trainer, char* buffer, size_t capacity,
                                            size_t* needed);

/* Store the averaged weights (opt.ema) as a state dict, or the current ones if there are none.
 * Returns as splat_model_store. */
SPLAT_API splat_result splat_trainer_store(splat_trainer trainer, splat_weights* weights);

/* Save everything that the next step depends on in a .safetensors file, whole or not at all.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL),
 *   SPLAT_ERROR_NOT_FOUND, SPLAT_ERROR_IO (cannot be written), and errors of the device. */
SPLAT_API splat_result splat_trainer_save(splat_trainer trainer, const char* path);

/* Write the same bytes to memory.
 * needed    out, bytes of the file, may be NULL; with a smaller capacity the result is
 *           SPLAT_INCOMPLETE and nothing is written to `buffer`
 * Returns as splat_trainer_save, SPLAT_INCOMPLETE. */
SPLAT_API splat_result splat_trainer_save_memory(splat_trainer trainer, void* buffer,
                                                 size_t capacity, size_t* needed);

/* Resume from such a file, bit-exactly. On an error the trainer is unchanged.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a file of another network or optimiser
 *   SPLAT_ERROR_NOT_FOUND, SPLAT_ERROR_IO  the file is not there, cannot be read
 *   SPLAT_ERROR_FORMAT                damaged (it has a checksum), or not such a file */
SPLAT_API splat_result splat_trainer_resume(splat_trainer trainer, const char* path);

/* Resume from the bytes of such a file.
 * data      in, `bytes` bytes
 * Returns as splat_trainer_resume. */
SPLAT_API splat_result splat_trainer_resume_memory(splat_trainer trainer, const void* data,
                                                   size_t bytes);

/* Destroy a trainer. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_trainer_destroy(splat_trainer trainer);

/* ---- Batches --------------------------------------------------------------------------------- */

/* The batches of a training: which objects and views a step sees, read ahead of time by threads of
 * the library (opt.num_workers; one where it is 0). Batch n depends on the seed and n alone, so a training can be
 * resumed anywhere. The caller synchronises calls on one object.
 *
 *   splat_trainer_batch batch = {.struct_size = sizeof batch};
 *   splat_batches_create(dataset, config, seed, &batches);
 *   for (uint64_t n = 0; n < 1000; ++n) {
 *       splat_batches_next(batches, n, &batch);
 *       splat_trainer_step(trainer, &batch, &info);
 *   } */

/* Begin with a data set, which may be destroyed afterwards.
 * dataset   opened at data.training_resolution, with the maps and background of the configuration
 * config    that of the trainer, from splat_config_merge; NULL: the defaults
 * seed      of the order of objects and the choice of views; a training takes
 *           general.random_seed
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL, config, a data
 *   set opened otherwise), SPLAT_ERROR_FORMAT (an object has too few views),
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY */
SPLAT_API splat_result splat_batches_create(splat_dataset dataset, const char* config,
                                            uint64_t seed, splat_batches* batches);

/* Get a batch for splat_trainer_step.
 * step      any number; the attempts of splat_trainer_report for the trainer's next step. Fast if
 *           it follows that of the call before
 * batch     in/out, struct_size set; its arrays are valid until the next call on `batches`
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL),
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, and as splat_dataset_read; the next call tries again */
SPLAT_API splat_result splat_batches_next(splat_batches batches, uint64_t step,
                                          splat_trainer_batch* batch);

/* Destroy batches. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_batches_destroy(splat_batches batches);

/* ---- Training -------------------------------------------------------------------------------- */

/* A training of Splatter Image as a run, see run.h.
 *
 *   splat_training_desc desc = {sizeof desc, .folder = "run", .config = text};
 *   splat_training_open(device, &desc, &run);
 *
 * Numbers of its events: of a step "psnr" (dB, of the step's targets; infinite if drawn exactly),
 * "pixel_loss", "rate", "pairs", "network_ms", "render_ms", "update_ms", "ssim", "edge" and "lpips"
 * where they are part of the loss, "visible", "culled", "non_finite", "gradients_zero"; as in
 * splat_trainer_info; with a group also "exchange_bytes", sent by this rank, and "exchange_ms" that the backward pass
 * does not hide, with the wait for other ranks. Of an object, and as means over the objects: "val_psnr" and
 * "val_ssim" of novel views, NaN without one, "val_psnr_conditioning" and "val_ssim_conditioning" of the input views;
 * of a validation also "val_objects", "val_views" (novel ones) and "val_views_asked". */

/* What becomes of a run that is in the folder. */
enum {
    /* go on from the latest state that can be read; begin again if none was saved yet */
    SPLAT_TRAINING_RESUME = 1u << 0,
    SPLAT_TRAINING_OVERWRITE = 1u << 1 /* replace the run in the folder; other files in it stay */
};

typedef struct splat_training_desc {
    uint32_t struct_size;
    uint32_t flags; /* SPLAT_TRAINING_ bits */
    const void* next;
    const char* folder;
    /* YAML or JSON; NULL: the defaults, or the configuration of the run that is resumed */
    const char* config;
    const char* const* values; /* changes to it, as in splat_config_merge */
    uint64_t value_count;
    /* see splat_batches_create; NULL: the split train of data.root */
    splat_dataset dataset;
    /* NULL: none; if `dataset` is NULL too, the split val of data.root where there is one */
    splat_dataset validation;
    const char* init;    /* file of weights to start from; NULL: opt.pretrained_ckpt, else random */
    uint32_t init_flags; /* SPLAT_LOAD_ bits; 0 without `init` */
    uint32_t reserved;
    /* ranks that train together, each with a device of its own (splat_device_create): all open the run with equal data,
     * configuration and `init`, and call splat_run_next until its end; the folder is rank 0's alone. opt.batch_size
     * counts the objects of all, a multiple of ranks times opt.micro_batch. An error on one is one on all,
     * "rank 2: ...". NULL: one rank */
    const splat_group* group;
} splat_training_desc;

/* Open a run, which splat_run_destroy closes: check the configuration, the data (views of every
 * object; the first batches are read) and the weights to start from; then make the folder, or lock
 * that of the run.
 *
 * On resuming, configuration and data are compared with the run's. Some values are taken and logged
 * (opt.iterations, logging.*, data.root and others); any other difference is an error.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or, with the folder untouched,
 *   SPLAT_ERROR_INVALID_ARGUMENT      desc; the configuration; a key that may not change, with the
 *                                     run's value and the given one
 *   SPLAT_ERROR_INVALID_STATE         a session has the folder open (the message names its
 *                                     process); it holds a run, no run, or something else
 *   SPLAT_ERROR_NOT_FOUND, SPLAT_ERROR_FORMAT, SPLAT_ERROR_SHAPE_MISMATCH   data or weights are
 *                                     missing, damaged or do not fit; no state can be read
 *   SPLAT_ERROR_IO                    the folder cannot be written; parts may remain
 *   and errors of the device */
SPLAT_API splat_result splat_training_open(splat_device device, const splat_training_desc* desc,
                                           splat_run* run);

/* Describe the latest attempt of a step in this session, skipped or not. With opt.read_every above 1
 * it may be a later one than that of the latest event.
 * run       of splat_training_open
 * info      in/out, struct_size set
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL; a run of another
 *   task), SPLAT_ERROR_INVALID_STATE (before the first step) */
SPLAT_API splat_result splat_training_last_step(splat_run run, splat_trainer_info* info);

/* Return the network in training.
 * run       of splat_training_open
 * Returns as splat_trainer_model. */
SPLAT_API splat_result splat_training_model(splat_run run, splat_model* model);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_TRAIN_H */
