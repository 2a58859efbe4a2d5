/* A library whose objects lend a text and numbers. Before the call that lends them ends, it sends a
 * message, whose handler may dispose the object; to destroy an object wipes both. Programs.cs compares
 * what it gets. splat_version_string and splat_build_info are generated beside this file. */
#include <splat.h>
#include <stdlib.h>
#include <string.h>

struct lender {
    char text[8];
    float numbers[2];
};

static splat_log_callback handler;

splat_result splat_log_set_callback(splat_log_callback callback, void* user,
                                    splat_log_level level) {
    (void)user;
    (void)level;
    handler = callback;
    return SPLAT_OK;
}

static splat_result make(void* handle) {
    const struct lender filled = {"lent", {1, 2}};
    struct lender* made = malloc(sizeof *made);
    *made = filled;
    memcpy(handle, &made, sizeof made);
    return SPLAT_OK;
}

/* The memory stays, so that a text that is read too late is a wrong one. */
static splat_result wipe(void* object) {
    const struct lender wiped = {"wiped", {0, 0}};
    memcpy(object, &wiped, sizeof wiped);
    return SPLAT_OK;
}

static const char* lend(void* object) {
    if (handler != NULL) handler(NULL, SPLAT_LOG_WARNING, "lent");
    return ((struct lender*)object)->text;
}

#define DESTROY(kind)                                          \
    splat_result splat_##kind##_destroy(splat_##kind object) { \
        return wipe(object);                                   \
    }

DESTROY(device)
DESTROY(dataset)
DESTROY(weights)
DESTROY(prior_model)
DESTROY(predictor)
DESTROY(evaluator)
DESTROY(model)
DESTROY(module)
DESTROY(run)
DESTROY(batches)

splat_result splat_device_create(const splat_device_desc* desc, splat_device* device) {
    (void)desc;
    return make(device);
}

splat_result splat_dataset_open(const splat_dataset_desc* desc, splat_dataset* dataset) {
    (void)desc;
    return make(dataset);
}

splat_result splat_dataset_report(splat_dataset dataset, char* buffer, size_t capacity,
                                  size_t* needed) {
    (void)dataset;
    if (capacity > 0) *buffer = 0;
    *needed = 1;
    return capacity > 0 ? SPLAT_OK : SPLAT_INCOMPLETE;
}

splat_result splat_weights_load(const char* path, uint32_t flags, splat_weights* weights) {
    (void)path;
    (void)flags;
    return make(weights);
}

splat_result splat_weights_get_info(splat_weights weights, uint32_t index,
                                    splat_weights_info* info) {
    (void)index;
    info->name = info->dtype = lend(weights);
    return SPLAT_OK;
}

splat_result splat_prior_model_create(const splat_prior_model_desc* desc,
                                      splat_prior_model* model) {
    (void)desc;
    return make(model);
}

splat_result splat_prior_model_get_info(splat_prior_model model, splat_prior_model_info* info) {
    info->preset = info->licence = info->note = info->path = info->runtime_version = lend(model);
    return SPLAT_OK;
}

splat_result splat_predictor_create(splat_device device, const splat_predictor_desc* desc,
                                    splat_predictor* predictor) {
    (void)device;
    (void)desc;
    return make(predictor);
}

splat_result splat_predictor_get_info(splat_predictor predictor, splat_predictor_info* info) {
    info->category = lend(predictor);
    return SPLAT_OK;
}

splat_result splat_evaluator_create(const splat_evaluator_desc* desc, splat_evaluator* evaluator) {
    (void)desc;
    return make(evaluator);
}

splat_result splat_evaluator_score(splat_evaluator evaluator, uint32_t object,
                                   splat_object_scores* scores) {
    (void)object;
    scores->name = lend(evaluator);
    return SPLAT_OK;
}

splat_result splat_evaluator_score_images(splat_evaluator evaluator, uint32_t object,
                                          const float* images, uint64_t count,
                                          splat_object_scores* scores) {
    (void)images;
    (void)count;
    return splat_evaluator_score(evaluator, object, scores);
}

splat_result splat_model_create(splat_device device, const splat_model_desc* desc,
                                splat_model* model) {
    (void)device;
    (void)desc;
    return make(model);
}

/* One port, whose list is asked for twice. */
static splat_result ports_of(void* owner, splat_port* ports, uint32_t capacity, uint32_t* count) {
    *count = 1;
    if (capacity == 0) return SPLAT_INCOMPLETE;
    ports->name = lend(owner);
    return SPLAT_OK;
}

splat_result splat_model_ports(splat_model model, splat_port_kind kind, splat_port* ports,
                               uint32_t capacity, uint32_t* count) {
    (void)kind;
    return ports_of(model, ports, capacity, count);
}

splat_result splat_module_create(splat_device device, const splat_module_desc* desc,
                                 splat_module* module) {
    (void)device;
    (void)desc;
    return make(module);
}

splat_result splat_module_ports(splat_module module, splat_port_kind kind, splat_port* ports,
                                uint32_t capacity, uint32_t* count) {
    (void)kind;
    return ports_of(module, ports, capacity, count);
}

splat_result splat_training_open(splat_device device, const splat_training_desc* desc,
                                 splat_run* run) {
    (void)device;
    (void)desc;
    return make(run);
}

splat_result splat_run_next(splat_run run, splat_run_event* event) {
    event->text = event->name = lend(run);
    return SPLAT_OK;
}

splat_result splat_batches_create(splat_dataset dataset, const char* config, uint64_t seed,
                                  splat_batches* batches) {
    (void)dataset;
    (void)config;
    (void)seed;
    return make(batches);
}

splat_result splat_batches_next(splat_batches batches, uint64_t step, splat_trainer_batch* batch) {
    (void)step;
    (void)lend(batches);
    batch->images = ((struct lender*)batches)->numbers;
    batch->images_count = 2;
    return SPLAT_OK;
}
