/* libsplat: weights, operators, and networks from images to Gaussians.
 *
 * A network of the cars model with published weights:
 *
 *   splat_model model;
 *   splat_weights weights;
 *   splat_model_desc desc = {.struct_size = sizeof desc};
 *   splat_model_create(device, &desc, &model);
 *   splat_weights_load("model_best.pth", 0, &weights);
 *   splat_model_load(model, weights, 0); */
#ifndef SPLAT_MODEL_H
#define SPLAT_MODEL_H

#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Weights --------------------------------------------------------------------------------- */

/* Named tensors of network weights; needs no device and never changes. Thread-safe.
 *
 * float32 values of a .safetensors file of 1 MiB or more are not copied: the file stays open and
 * mapped (see SPLAT_WEIGHTS_COPY). It may be removed or replaced by a new file of the same name,
 * but must not be written in place, as cp does. Functions that use values, including those of
 * folded weights, refuse a file whose size or time has changed (SPLAT_ERROR_IO). A write racing
 * with the call may be read. A file truncated during a call, or lost with its disk, ends the process (SIGBUS). */

/* How weights are read or written. */
enum {
    SPLAT_WEIGHTS_HALF = 1u << 0, /* to write: float16 */
    SPLAT_WEIGHTS_COPY = 1u << 1  /* to load: copy all values, and leave no file open */
};

/* What a tensor of weights is. */
typedef struct splat_weights_info {
    uint32_t struct_size;
    uint32_t rank;                /* number of dimensions */
    int64_t dims[SPLAT_MAX_RANK]; /* elements, outermost first; a 0 means none */
    uint64_t elements;            /* number of all elements */
    const char* name;  /* name of the tensor; lives, like dtype, as long as the weights */
    const char* dtype; /* type in the file: "float32", "int64", ...; read as float32 */
} splat_weights_info;

/* Load a .safetensors, .pth (torch.save; no code of its pickle is run) or .npz file, recognised by
 * its contents. Values that are not finite are kept.
 * path      or a name of splat_builtin_weights, such as "cars64", where no file is called so
 * flags     SPLAT_WEIGHTS_COPY
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, flags
 *   SPLAT_ERROR_NOT_FOUND, SPLAT_ERROR_IO  the file is not there, cannot be read
 *   SPLAT_ERROR_FORMAT                damaged, truncated, or not weights
 *   SPLAT_ERROR_UNSUPPORTED           a pickle that holds more than weights, another number type */
SPLAT_API splat_result splat_weights_load(const char* path, uint32_t flags, splat_weights* weights);

/* Load weights from the `bytes` bytes of such a file, which are copied.
 * Returns as splat_weights_load. */
SPLAT_API splat_result splat_weights_load_memory(const void* data, size_t bytes,
                                                 splat_weights* weights);

/* A tensor in the caller's memory, row-major. Frozen. */
typedef struct splat_named_array {
    const char* name;
    const float* values;
    uint64_t value_count;         /* floats: the product of dims, 1 for rank 0 */
    int64_t dims[SPLAT_MAX_RANK]; /* outermost first; a 0 means no elements */
    uint32_t rank;
    uint32_t reserved; /* 0 */
} splat_named_array;

/* Make weights of arrays, which are copied, in their order.
 * arrays    `count` of them; no array at all makes empty weights
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a rank, a negative dimension, a name used twice
 *   SPLAT_ERROR_SHAPE_MISMATCH        value_count does not fit dims */
SPLAT_API splat_result splat_weights_from_arrays(const splat_named_array* arrays, uint64_t count,
                                                 splat_weights* weights);

/* Write .safetensors (with the metadata), .pth (a checkpoint of the published code: iteration, loss
 * and best_PSNR of the metadata, else 0, and model_state_dict) or .npz by the extension; the file
 * appears whole or not at all.
 * flags     SPLAT_WEIGHTS_HALF
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, flags, values beyond float16, metadata that is no number
 *   SPLAT_ERROR_NOT_FOUND             there is no such folder
 *   SPLAT_ERROR_IO                    the file cannot be written, or the mapped one has changed
 *   SPLAT_ERROR_UNSUPPORTED           another extension */
SPLAT_API splat_result splat_weights_save(splat_weights weights, const char* path, uint32_t flags);

/* A format of files of weights. */
typedef int32_t splat_weights_format;
enum {
    SPLAT_WEIGHTS_SAFETENSORS = 1, /* numbers, names and metadata, without code */
    SPLAT_WEIGHTS_NPZ = 2,         /* arrays of NumPy */
    SPLAT_WEIGHTS_PTH = 3          /* a checkpoint of PyTorch */
};

/* Write the same bytes to memory.
 * needed    out, bytes of the file, may be NULL; with a smaller capacity the result is
 *           SPLAT_INCOMPLETE and nothing is written to `buffer`
 * Returns as splat_weights_save, SPLAT_INCOMPLETE. */
SPLAT_API splat_result splat_weights_save_memory(splat_weights weights, splat_weights_format format,
                                                 uint32_t flags, void* buffer, size_t capacity,
                                                 size_t* needed);

/* Count the tensors. Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL). */
SPLAT_API splat_result splat_weights_count(splat_weights weights, uint32_t* count);

/* Describe a tensor.
 * index     from 0, in the order of the file
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (info, no such index). */
SPLAT_API splat_result splat_weights_get_info(splat_weights weights, uint32_t index,
                                              splat_weights_info* info);

/* Find the index of a tensor by its name.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL),
 *   SPLAT_ERROR_NOT_FOUND. */
SPLAT_API splat_result splat_weights_find(splat_weights weights, const char* name, uint32_t* index);

/* Copy the values of a tensor as float32.
 * values    out, `bytes` bytes, at least those of the values
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL, no such index,
 *   too few bytes), SPLAT_ERROR_IO (the mapped file has changed). */
SPLAT_API splat_result splat_weights_read(splat_weights weights, uint32_t index, float* values,
                                          size_t bytes);

/* Give the values of a tensor without a copy, as float32 whatever their type in the file. The file
 * of mapped values must not be written in place as long as they are read.
 * values    out, row-major, read only; lives as long as the weights; NULL if there are no elements
 * count     out, floats, may be NULL
 * Returns as splat_weights_read. */
SPLAT_API splat_result splat_weights_data(splat_weights weights, uint32_t index,
                                          const float** values, uint64_t* count);

/* Report on the file. JSON: {"format", "metadata": {key: text}, "warnings": [sentences],
 * "published": as splat_predictor_desc tells}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_weights_report(splat_weights weights, char* buffer, size_t capacity,
                                            size_t* needed);

/* How adapters are folded. */
enum { SPLAT_FOLD_OUT = 1u << 0 }; /* undo: take folded adapters out of weights */

/* Fold low-rank adapters into the weights they belong to: W + alpha / rank * (B A), or minus with
 * SPLAT_FOLD_OUT, in float64, rounded once. The result has no adapters, and no lora_alpha or
 * lora_rank in its metadata; other tensors are unchanged. A network of the result predicts the same
 * as one with separate adapters, up to float32 rounding (1e-6 of "raw"), in less time. Folding out
 * again restores a weight up to two roundings.
 * adapters  "<layer>.lora_A" [rank,in * k * k] and ".lora_B" [out,rank], or PEFT's names and
 *           shapes, see splat_model_export; other tensors are ignored; NULL: those among `weights`
 * alpha     finite; opt.lora_alpha of the training
 * flags     SPLAT_FOLD_OUT
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH (which layer),
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, or SPLAT_ERROR_INVALID_ARGUMENT (no adapters, half a pair, a
 *   missing layer, a weight that would not be finite) */
SPLAT_API splat_result splat_weights_fold(splat_weights weights, splat_weights adapters,
                                          double alpha, uint32_t flags, splat_weights* folded);

/* Destroy weights. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_weights_destroy(splat_weights weights);

/* ---- Operators ------------------------------------------------------------------------------- */

/* A single differentiable operator, as the network uses it; for tests, benchmarks and autograd
 * bindings. Thread-safe. */

/* JSON array of all operators: {"name", "inputs": [...], "outputs": [...], "saved": [...],
 * "attributes": [{"name", "type", "default", "about"}], "equation"}.
 * Returns SPLAT_OK or SPLAT_INCOMPLETE. */
SPLAT_API splat_result splat_op_list(char* buffer, size_t capacity, size_t* needed);

/* What an operator does with gradients. */
enum { SPLAT_OP_ACCUMULATE = 1u << 0 }; /* add gradients of parameters to what the tensors hold */

typedef struct splat_op_desc {
    uint32_t struct_size;
    uint32_t flags;         /* SPLAT_OP_ bits */
    const void* next;       /* NULL */
    const char* type;       /* a name of splat_op_list */
    const char* attributes; /* JSON object; NULL = defaults */
    uint32_t input_count;
    uint32_t output_count;
    const splat_tensor* inputs;  /* in the operator's order; an optional one may be NULL */
    const splat_tensor* outputs; /* in the operator's order; an optional one may be NULL */
    /* NULL for an operator without backward; else output_count tensors */
    const splat_tensor* grad_outputs;
    /* input_count tensors; gradients of NULL entries are not computed */
    const splat_tensor* grad_inputs;
} splat_op_desc;

/* Record an operator on tensors of SPLAT_DTYPE_F32, whose contents may change between runs.
 * Returns SPLAT_OK, or
 *   SPLAT_ERROR_INVALID_HANDLE        device or a tensor
 *   SPLAT_ERROR_INVALID_ARGUMENT      type, an attribute, a count, a dtype, or a tensor of another
 *                                     device
 *   SPLAT_ERROR_SHAPE_MISMATCH        the message names the tensor, its shape and the one expected
 *   SPLAT_ERROR_UNSUPPORTED           beyond a limit of the device
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_op_create(splat_device device, const splat_op_desc* desc,
                                       splat_op* op);

/* Compute the outputs from the inputs.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_STATE (a tensor is mapped),
 *   SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST; after the last two the outputs are undefined. */
SPLAT_API splat_result splat_op_forward(splat_op op);

/* Compute the gradients of sum(grad_outputs * outputs) with respect to the requested inputs, at the
 * activations of the last forward and the current parameters.
 * Returns as splat_op_forward; also SPLAT_ERROR_INVALID_STATE before the first forward or without grad_outputs. */
SPLAT_API splat_result splat_op_backward(splat_op op);

/* Destroy an operator; its tensors stay. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_op_destroy(splat_op op);

/* ---- Precision ------------------------------------------------------------------------------- */

/* Kernels of 3x3 convolutions, which `vkrun bench model --errors` compares: STRICT has the smallest
 * errors, FAST the shortest times. The attribute "precision" of conv2d has the same numbers. */
typedef int32_t splat_precision;
enum {
    SPLAT_PRECISION_STRICT = 1,   /* the smallest errors */
    SPLAT_PRECISION_BALANCED = 2, /* what 0 means, except in attributes of operators */
    SPLAT_PRECISION_FAST = 3      /* the shortest times */
};

/* ---- Ports ----------------------------------------------------------------------------------- */

/* Which of the named tensors of a model or a module. */
typedef int32_t splat_port_kind;
enum {
    SPLAT_PORT_KIND_INPUT = 1,    /* what a pass reads */
    SPLAT_PORT_KIND_OUTPUT = 2,   /* what a pass computes */
    SPLAT_PORT_KIND_PARAMETER = 3 /* what is trained or loaded */
};

/* What a port is. */
enum {
    SPLAT_PORT_OPTIONAL = 1u << 0,  /* an input with a default */
    SPLAT_PORT_TRAINABLE = 1u << 1, /* a parameter that is trained */
    SPLAT_PORT_GRADIENT = 1u << 2   /* "grad:" and the name is its gradient */
};

/* A named tensor of a model or a module. Frozen. */
typedef struct splat_port {
    const char* name; /* name of the tensor; the library's lives as long as the model or module */
    uint32_t rank;    /* number of dimensions */
    uint32_t flags;   /* SPLAT_PORT_ bits; 0 for a new module */
    int64_t dims[SPLAT_MAX_RANK]; /* elements, outermost first */
} splat_port;

/* ---- Models ---------------------------------------------------------------------------------- */

/* A network from images to Gaussians (Splatter Image, with channels of depth, normal, mask and planes, embeddings
 * and low-rank adapters; LGM), with its parameters on a device. N = objects * views images of R x R pixels; M = views
 * * S * S * model.head.per_pixel Gaussians per object, where S is R, or half of it for each level that model.up has
 * fewer than model.down. The caller synchronises calls on one model. Keys: splat_config_keys; opt.freeze and
 * opt.train_with_adapters, lists of parts of parameter names, choose what gets gradients. */

/* What a model can do. */
enum {
    SPLAT_MODEL_GRADIENTS = 1u << 0, /* enable splat_model_backward: takes memory for gradients */
    SPLAT_MODEL_TRAINING = 1u << 1,  /* apply dropout */
    /* prepare weights anew in every pass, which is slower; else, without gradients, the second pass
     * keeps them prepared (0.7 GiB for the cars model) if the device has the memory */
    SPLAT_MODEL_LOW_MEMORY = 1u << 2,
    /* with GRADIENTS: recompute each block's activations in the backward pass instead of keeping
     * them: the same numbers in less memory and more time */
    SPLAT_MODEL_RECOMPUTE = 1u << 3,
    SPLAT_MODEL_INPUT_GRADIENTS = 1u << 4 /* with GRADIENTS: also of images, embedding and tokens */
};

typedef struct splat_model_desc {
    uint32_t struct_size;
    uint32_t flags; /* SPLAT_MODEL_* */
    const void* next;
    /* text, JSON or YAML with the keys of Splatter Image; NULL: the cars model */
    const char* config;
    /* objects per batch; 0: 1. If an activation of the batch exceeds one binding of the device, the
     * batch runs in equal slices. A backward pass then repeats the forward pass of all slices but
     * the last, and dropout differs from that of an undivided batch */
    uint32_t objects;
    splat_precision precision; /* 0: SPLAT_PRECISION_BALANCED */
} splat_model_desc;

/* Create a model; its parameters are zero.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (desc; an unknown key
 *   of the configuration or a value outside its range; a model.base_dim whose multiples do not
 *   divide into a layer's groups; GRADIENTS with nothing to train), SPLAT_ERROR_UNSUPPORTED,
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY */
SPLAT_API splat_result splat_model_create(splat_device device, const splat_model_desc* desc,
                                          splat_model* model);

/* Initialise the parameters at random, as the published code does.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, and errors of the device. */
SPLAT_API splat_result splat_model_init(splat_model model, uint64_t seed);

/* How weights are loaded into a model. */
enum {
    SPLAT_LOAD_GRAFT = 1u << 0, /* widen the first convolution; ignore tensors the model lacks */
    SPLAT_LOAD_TAKE_RAYS = 1u << 1,   /* use the file's field of view */
    SPLAT_LOAD_FROM_DEPTH = 1u << 2,  /* the file's network had a depth channel; for GRAFT */
    SPLAT_LOAD_FROM_NORMAL = 1u << 3, /* the file's network had channels of normals; for GRAFT */
    SPLAT_LOAD_FROM_MASK = 1u << 4,   /* the file's network had a mask channel; for GRAFT */
    SPLAT_LOAD_ADAPTERS = 1u << 5,    /* the file has only adapters; other parameters stay */
    SPLAT_LOAD_FROM_PLANE = 1u << 6   /* the file's network had channels of planes; for GRAFT */
};

/* Load the parameters of a state dict, all or none. Adapters, embeddings and attention to tokens
 * that the file lacks keep their values. With GRAFT each channel goes to the one of the same
 * meaning, and the outputs stay those of the file's network until the new channels are trained.
 * Tensors that the model lacks are ignored, such as the attention to tokens in encoders of earlier versions.
 * flags     SPLAT_LOAD_*
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH (which tensor),
 *   SPLAT_ERROR_INVALID_ARGUMENT (weights of another network: the message says which they look like; a
 *   tensor that is missing or not finite; without GRAFT, one that the model lacks; another field of
 *   view or alpha), SPLAT_ERROR_INVALID_STATE (ADAPTERS for a model without adapters) */
SPLAT_API splat_result splat_model_load(splat_model model, splat_weights weights, uint32_t flags);

/* Store the model as a state dict, with the buffers of published files.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL), and errors of the device. */
SPLAT_API splat_result splat_model_store(splat_model model, splat_weights* weights);

/* What is exported of a model. */
typedef int32_t splat_export;
enum {
    SPLAT_EXPORT_ADAPTERS = 1, /* only adapters, with PEFT's names and shapes: for each layer
                                * base_model.model.<layer>.lora_A.weight and .lora_B.weight */
    SPLAT_EXPORT_MERGED = 2    /* the state dict with adapters folded into the weights */
};

/* Export a model's parameters in another form.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT,
 *   SPLAT_ERROR_INVALID_STATE (a model without adapters) */
SPLAT_API splat_result splat_model_export(splat_model model, splat_export what,
                                          splat_weights* weights);

/* JSON: {"parameters", "trainable" (numbers), "slices" (of a batch), "bytes": {"activations" (of a
 * slice), "prepared" (weights; 0 while they are not kept, see SPLAT_MODEL_LOW_MEMORY)}, "ledger":
 * {"gaussians", "non_finite", "faint"} (see splat_model_info), "inputs": [{"name", "shape",
 * "optional"}], "outputs": [{"name", "shape"}], "tensors" (parameters): [{"name", "shape",
 * "trainable"}], "load": {"copied", "widened", "fresh", "left_out", "rays_differ", "rays_taken"},
 * "config"}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT */
SPLAT_API splat_result splat_model_report(splat_model model, char* buffer, size_t capacity,
                                          size_t* needed);

/* What a model was made for, and what its latest pass gave. */
typedef struct splat_model_info {
    uint32_t struct_size;
    uint32_t flags;            /* what it was created with, SPLAT_MODEL_ bits */
    uint32_t objects;          /* objects per batch */
    uint32_t views;            /* input images of an object */
    uint32_t resolution;       /* R: images have R x R pixels */
    uint32_t channels;         /* channels of the images that a pass takes */
    uint32_t image_channels;   /* channels of "images": no plane of distances or depths */
    uint32_t output_channels;  /* channels of "raw" */
    uint32_t gaussians;        /* M: Gaussians of an object */
    uint32_t sh_degree;        /* degree of the spherical harmonics; K = (sh_degree + 1)^2 */
    uint32_t embedding_length; /* length of a custom embedding; 0: none */
    uint32_t token_dim;        /* numbers of a token; 0: none */
    uint32_t tokens;           /* tokens of an image; 0: none */
    uint32_t slices;           /* passes of a batch */
    float fov;                 /* field of view, degrees; 0: each image has its focal lengths */
    uint32_t reserved;
    uint64_t parameters; /* numbers of all parameters */
    uint64_t trainable;  /* numbers of parameters that a training changes */
    uint64_t predicted;  /* Gaussians of the latest pass, over all objects; 0 before the first */
    uint64_t non_finite; /* numbers of "raw" and of their attributes that are NaN or infinite */
    uint64_t faint;      /* Gaussians of an opacity below 1/255, which no pixel shows */
} splat_model_info;

/* Describe a model. Does not wait for a pass of another thread.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT. */
SPLAT_API splat_result splat_model_get_info(splat_model model, splat_model_info* info);

/* List the inputs, outputs or parameters of a model.
 * ports     out, `capacity` of them; may be NULL when capacity is 0
 * count     out, how many there are; may be NULL
 * Returns SPLAT_OK, SPLAT_INCOMPLETE (what fits was written), SPLAT_ERROR_INVALID_HANDLE,
 *   SPLAT_ERROR_INVALID_ARGUMENT (kind, NULL). */
SPLAT_API splat_result splat_model_ports(splat_model model, splat_port_kind kind, splat_port* ports,
                                         uint32_t capacity, uint32_t* count);

/* Get a tensor that shares the model's memory, float32 and row-major, by name:
 *   inputs      "images" [N,image_channels,R,R], "view_to_world" [N,4,4], "quaternions" [N,4],
 *               "focals" [N,2], "origin_distance" [N], "depths" [N,R,R], "embedding", "tokens", as far as the
 *               configuration has them; at first zeros, identity poses and focal lengths of R
 *   outputs     as in splat_model_read; undefined before the first pass
 *   parameters  the names of the state dict
 *   gradients   "grad:" and the name of an output (in, for splat_model_backward; at first zeros),
 *               of a parameter (out, sums), or of "images", "embedding", "tokens" (out)
 * "means[1]" is the part of object 1 of an output or its gradient, in the shape that a rasterizer
 * takes: [M,3], [M], [M,3], [M,4], [M,K,3], or [views,output channels,S,S] of "raw".
 *
 * A pass reads what the tensors hold when it runs. After a parameter is written through its tensor,
 * the next pass prepares weights anew, as after splat_model_write. If a pointer to a parameter was
 * given away (splat_tensor_host_pointer), every pass does. Writing inputs or outputs, like writing
 * parameters, ends what splat_model_backward needs. No call uses the model's memory while one
 * of these tensors is mapped. The tensor, which the caller destroys, keeps that memory alive.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL, no such
 *   object), SPLAT_ERROR_NOT_FOUND (no such name), SPLAT_ERROR_INVALID_STATE (no such gradient is
 *   computed), SPLAT_ERROR_UNSUPPORTED (the device cannot bind the part of one object), and errors
 *   of the device */
SPLAT_API splat_result splat_model_tensor(splat_model model, const char* name,
                                          splat_tensor* tensor);

/* Where a pass finds its numbers. */
enum { SPLAT_PASS_TENSORS = 1u << 0 }; /* in the tensors of splat_model_tensor, unchecked; no arrays */

/* Counts are of numbers in the array beside them; 0: trusted. */
typedef struct splat_model_input {
    uint32_t struct_size;
    uint32_t flags;    /* SPLAT_PASS_ bits */
    uint64_t seed;     /* seed of dropout, used with step */
    uint32_t step;     /* the optimiser's step */
    uint32_t channels; /* channels per image, checked against the configuration; 0: not checked */
    uint32_t objects;  /* in the arrays, checked against the model's; 0: not checked */
    uint32_t picture_count;
    /* images in the caller's layout, instead of `images`; the planes of an image may come from
     * several pictures in turn, such as RGB, then depth: N pictures or a multiple */
    const splat_image* pictures;
    const float* images; /* [N,channels,R,R]: RGB 0 to 1, depth, normal, mask, planes, origin distance or
                          * head's depth; LGM's: RGB as ImageNet normalises it, o x d and d of rays, y up, z back */
    uint64_t images_count;
    const float* view_to_world; /* [N,4,4] row vectors: p_world = p_view M; NULL: the identity */
    uint64_t view_to_world_count;
    const float* quaternions; /* [N,4] w x y z of that rotation; NULL with view_to_world */
    uint64_t quaternions_count;
    const float* focals; /* [N,2] pixels; NULL unless the configuration's fov is 0 */
    uint64_t focals_count;
    const float* embedding; /* [N,length] of a custom embedding, else NULL */
    uint64_t embedding_count;
    const float* tokens; /* [N,token_dim,tokens], else NULL */
    uint64_t tokens_count;
} splat_model_input;

/* Run the network. Arrays are read before the call returns; the tensors of inputs then hold them.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH (channels, objects, a
 *   count, a picture), SPLAT_ERROR_INVALID_ARGUMENT (NULL for an array that the configuration
 *   needs, an array that it does not need, values that are not finite), SPLAT_ERROR_INVALID_STATE
 *   (a tensor of the model is mapped), in each case with the last pass unchanged;
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_model_forward(splat_model model, const splat_model_input* input);

/* Read a tensor of splat_model_tensor; outputs, of the latest splat_model_forward: "means"
 * [objects,M,3] scene units, "opacities" [objects,M,1], "scales" [objects,M,3], "rotations"
 * [objects,M,4] w x y z, "sh" [objects,M,K,3] with the constant term first, "raw" [N,output
 * channels,S,S]. With SPLAT_MODEL_INPUT_GRADIENTS also gradients of the latest backward pass:
 * "grad:images" [N,channels that the network sees,R,R], "grad:embedding" (custom ones),
 * "grad:tokens", shaped as in splat_model_input.
 * values    out, `bytes` bytes, at least those of the values
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL, too few bytes),
 *   SPLAT_ERROR_NOT_FOUND (no such name), SPLAT_ERROR_INVALID_STATE (before the first pass, no
 *   gradient, a tensor of the model is mapped), and errors of the device */
SPLAT_API splat_result splat_model_read(splat_model model, const char* name, float* values,
                                        size_t bytes);

/* Set a parameter, by the name of the state dict.
 * values    in, row-major, exactly `bytes` bytes of the parameter
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL, a value that is
 *   not finite), SPLAT_ERROR_NOT_FOUND (no such parameter), SPLAT_ERROR_SHAPE_MISMATCH (bytes),
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_model_write(splat_model model, const char* name, const float* values,
                                         size_t bytes);

/* Copy the Gaussians of one object into a new scene.
 * Returns as splat_model_read. */
SPLAT_API splat_result splat_model_scene(splat_model model, uint32_t object, splat_scene* scene);

/* Gradients of a loss with respect to outputs, in their shapes; NULL: zeros. Counts are of numbers; 0: trusted. */
typedef struct splat_model_gradients {
    uint32_t struct_size;
    uint32_t flags; /* SPLAT_PASS_ bits */
    const float* means;
    uint64_t means_count;
    const float* opacities;
    uint64_t opacities_count;
    const float* scales;
    uint64_t scales_count;
    const float* rotations;
    uint64_t rotations_count;
    const float* sh;
    uint64_t sh_count;
} splat_model_gradients;

/* Add the gradients of a loss to the gradients of parameters. Call it once after each
 * splat_model_forward, whose results stay readable. Arrays become what the tensors "grad:means" and so on hold.
 * Returns as splat_model_forward; SPLAT_ERROR_INVALID_STATE without SPLAT_MODEL_GRADIENTS or a
 *   pass, or after inputs or parameters have changed, with gradients unchanged. After other errors
 *   the gradients may hold part of the batch: call splat_model_zero_gradients */
SPLAT_API splat_result splat_model_backward(splat_model model,
                                            const splat_model_gradients* gradients);

/* Set the gradients of all parameters to zero.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, and errors of the device. */
SPLAT_API splat_result splat_model_zero_gradients(splat_model model);

/* Destroy a model. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_model_destroy(splat_model model);

/* ---- Modules --------------------------------------------------------------------------------- */

/* One operator or one block of the network with its parameters: the parts of models, for building
 * other networks. The caller synchronises calls on one module.
 *
 * Ports and parameters are named. For an operator of splat_op_list, row-major inputs with gradients
 * (weight, bias, gamma, beta) are parameters, the other inputs are inputs. `ports` gives the shapes
 * of all of them; optional ones may be omitted. "residual_block" is the block of Song et al.'s
 * U-Net as Splatter Image uses it:
 *   inputs      x [N,C,H,W]; embedding [N,E] adds FiLM; tokens [N,D,T,1] add attention to them;
 *               random_counter [4] if dropout acts (the bits of seed, seed >> 32, step and 0)
 *   output      y
 *   parameters  as in the state dict, after "block."; if there are adapters, only they are trained
 *   attributes  out_channels (0: C), up, down, attention (self-attention), views (images that
 *               attend to each other), affine_film, dropout, lora_rank, lora_alpha, lora_dropout */

/* What a module can do. */
enum {
    SPLAT_MODULE_GRADIENTS = 1u << 0,       /* enable splat_module_backward */
    SPLAT_MODULE_INPUT_GRADIENTS = 1u << 1, /* with GRADIENTS: also of inputs */
    SPLAT_MODULE_TRAINING = 1u << 2 /* dropout in a residual_block; an operator always applies it */
};

typedef struct splat_module_desc {
    uint32_t struct_size;
    uint32_t flags;          /* SPLAT_MODULE_* */
    const void* next;        /* NULL */
    const char* type;        /* a name of splat_op_list, or "residual_block" */
    const char* attributes;  /* JSON object; NULL: defaults */
    const splat_port* ports; /* with name, rank, dims */
    uint32_t port_count;
    splat_precision precision; /* only for residual_block; conv2d has an attribute */
} splat_module_desc;

/* Create a module; its parameters, inputs and gradients of outputs are zero.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (desc, a port or
 *   attribute that the type does not have, GRADIENTS for a type without any),
 *   SPLAT_ERROR_SHAPE_MISMATCH (a port that is missing or does not fit), SPLAT_ERROR_UNSUPPORTED,
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY */
SPLAT_API splat_result splat_module_create(splat_device device, const splat_module_desc* desc,
                                           splat_module* module);

/* Initialise the parameters. A block starts as in the published code. In an operator gamma is 1,
 * other vectors are 0, and the rest has Glorot's uniform distribution.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, and errors of the device. */
SPLAT_API splat_result splat_module_init(splat_module module, uint64_t seed);

/* JSON: {"type", "inputs": [{"name", "shape", "optional"}], "outputs": [{"name", "shape"}],
 * "parameters": [{"name", "shape", "trainable"}], "bytes" (activations and workspaces)}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE */
SPLAT_API splat_result splat_module_report(splat_module module, char* buffer, size_t capacity,
                                           size_t* needed);

/* List the inputs, outputs or parameters of a module. Parameters and returns as splat_model_ports. */
SPLAT_API splat_result splat_module_ports(splat_module module, splat_port_kind kind,
                                          splat_port* ports, uint32_t capacity, uint32_t* count);

/* Write an input, a parameter, or the gradient of the loss with respect to an output ("grad:y").
 * values    in, row-major, exactly `bytes` bytes of the tensor
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH (bytes), or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a value that is not finite, except in an input without
 *                                     gradient
 *   SPLAT_ERROR_NOT_FOUND             no such name
 *   SPLAT_ERROR_INVALID_STATE         the module computes no such gradient
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_module_write(splat_module module, const char* name,
                                          const float* values, size_t bytes);

/* Read what splat_module_write writes, an output ("y"), or the gradient of a parameter
 * ("grad:weight", the sum since splat_module_zero_gradients) or of an input ("grad:x").
 * values    out, row-major, exactly `bytes` bytes of the tensor
 * Returns as splat_module_write; SPLAT_ERROR_INVALID_STATE also before the pass that computes it. */
SPLAT_API splat_result splat_module_read(splat_module module, const char* name, float* values,
                                         size_t bytes);

/* Compute the outputs.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY,
 *   SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST. */
SPLAT_API splat_result splat_module_forward(splat_module module);

/* Add to the gradients of parameters and overwrite those of inputs. Call it once after each forward.
 * Returns as splat_module_forward, or
 *   SPLAT_ERROR_INVALID_STATE         without SPLAT_MODULE_GRADIENTS, without a new forward pass,
 *                                     or after inputs or parameters were written; gradients stay */
SPLAT_API splat_result splat_module_backward(splat_module module);

/* Set the gradients of parameters to zero.
 * Returns as splat_module_forward. */
SPLAT_API splat_result splat_module_zero_gradients(splat_module module);

/* Destroy a module. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_module_destroy(splat_module module);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_MODEL_H */
