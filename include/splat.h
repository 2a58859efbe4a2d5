/* libsplat: Splatter Image with geometry priors on any Vulkan device.
 *
 * Conventions
 *   Results     every function that can fail returns splat_result: 0 is success, negative is an
 *               error, positive is success with a remark. On an error the outputs are untouched and
 *               splat_last_error_message() says what failed and where, what was expected, what was
 *               got, and what to do.
 *   Handles     opaque and typed. A destroyed handle, or one of another kind, is refused with
 *               SPLAT_ERROR_INVALID_HANDLE and never followed. Destroying NULL is a no-op. Children
 *               keep their parents alive, so any order of destruction is legal.
 *   Structs     *_desc and *_info start with struct_size, which the caller sets to sizeof; zero in
 *               any other field means its default, so a zeroed struct with its size is valid. They
 *               only ever grow at the end.
 *   Text        NUL-terminated UTF-8. Functions that write text take (buffer, capacity, needed):
 *               needed receives the size in bytes of the whole text with its NUL; with a smaller
 *               capacity the text is cut and the result is SPLAT_INCOMPLETE.
 *   Threads     every function is thread-safe; calls on one device are serialised by the library.
 *               It compiles shaders on up to four threads of its own, which never call the caller's code.
 *   Silence     the library never prints; see splat_log_set_callback.
 *
 * Only <stddef.h> and <stdint.h> are needed; the header compiles as C99 and later and as C++11 and
 * later.
 */
#ifndef SPLAT_H
#define SPLAT_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32) && defined(SPLAT_BUILD)
#define SPLAT_API __declspec(dllexport)
#elif defined(_WIN32)
#define SPLAT_API __declspec(dllimport)
#else
#define SPLAT_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Version --------------------------------------------------------------------------------- */

#define SPLAT_VERSION_MAJOR 0
#define SPLAT_VERSION_MINOR 1
#define SPLAT_VERSION_PATCH 0
#define SPLAT_MAKE_VERSION(major, minor, patch) \
    (((uint32_t)(major) << 22) | ((uint32_t)(minor) << 12) | (uint32_t)(patch))
#define SPLAT_VERSION \
    SPLAT_MAKE_VERSION(SPLAT_VERSION_MAJOR, SPLAT_VERSION_MINOR, SPLAT_VERSION_PATCH)

/* Version of the loaded library, packed as by SPLAT_MAKE_VERSION. */
SPLAT_API uint32_t splat_version(void);

/* The version as text, "major.minor.patch". Lives as long as the library. */
SPLAT_API const char* splat_version_string(void);

/* JSON object: version, compiler, assertions (bool), fault_points (bool), shaders (array of {name,
 * hash, bytes}; the hash is the SHA-256 of the SPIR-V). Lives as long as the library. */
SPLAT_API const char* splat_build_info(void);

/* ---- Results --------------------------------------------------------------------------------- */

typedef int32_t splat_result;
enum {
    SPLAT_OK = 0,
    SPLAT_INCOMPLETE = 1,              /* the buffer was too small; what fits was written */
    SPLAT_ERROR_INVALID_ARGUMENT = -1, /* an argument is outside its documented range */
    SPLAT_ERROR_INVALID_HANDLE = -2,   /* NULL, destroyed, or a handle of another kind */
    /* the call does not fit the object's state, e.g. unmap without map */
    SPLAT_ERROR_INVALID_STATE = -3,
    SPLAT_ERROR_SHAPE_MISMATCH = -4, /* tensors whose shapes do not fit together */
    SPLAT_ERROR_UNSUPPORTED = -5,    /* beyond a limit or a feature of this device or build */
    /* no Vulkan loader, no driver, or no device that fits the request */
    SPLAT_ERROR_NO_DEVICE = -6,
    SPLAT_ERROR_OUT_OF_HOST_MEMORY = -7, /* host allocation failed */
    /* device allocation failed, or the device's memory budget is used up */
    SPLAT_ERROR_OUT_OF_DEVICE_MEMORY = -8,
    SPLAT_ERROR_TIMEOUT = -9, /* the device did not finish in time; it may still be working */
    /* sticky: every later call on the device returns it; destroy it and create it again */
    SPLAT_ERROR_DEVICE_LOST = -10,
    /* a defect in the library or the driver; please report the message */
    SPLAT_ERROR_INTERNAL = -11
};

/* Name of a result code, e.g. "SPLAT_ERROR_TIMEOUT"; "SPLAT_UNKNOWN_RESULT" for any other number.
 * Never NULL. */
SPLAT_API const char* splat_result_name(splat_result code);

/* One sentence: what a result code means and what to do. Never NULL. */
SPLAT_API const char* splat_result_sentence(splat_result code);

/* Text of the last error on the calling thread. Empty before the first error. A success does not
 * clear it, so check the result first. Valid until the next call of this library on
 * this thread. Never NULL. */
SPLAT_API const char* splat_last_error_message(void);

/* Copy the text of the last error.
 * buffer    out, capacity bytes, may be NULL when capacity is 0
 * needed    out, bytes with the NUL, may be NULL
 * Returns SPLAT_OK or SPLAT_INCOMPLETE. Never changes the text. */
SPLAT_API splat_result splat_last_error_copy(char* buffer, size_t capacity, size_t* needed);

/* ---- Log ------------------------------------------------------------------------------------- */

typedef int32_t splat_log_level;
enum { SPLAT_LOG_DEBUG = 1, SPLAT_LOG_INFO = 2, SPLAT_LOG_WARNING = 3, SPLAT_LOG_ERROR = 4 };

/* Called on the thread that caused the message; must not call the library and must not throw. */
typedef void (*splat_log_callback)(void* user, splat_log_level level, const char* message);

/* Send messages of `min_level` and above to `callback`, for the whole process. Without a callback
 * the library is silent.
 * callback  may be NULL: silence
 * user      passed back; must live until the callback is replaced
 * min_level 0 = SPLAT_LOG_WARNING
 * Returns SPLAT_OK, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      not a valid level; nothing is changed */
SPLAT_API splat_result splat_log_set_callback(splat_log_callback callback, void* user,
                                              splat_log_level min_level);

/* ---- Device ---------------------------------------------------------------------------------- */

typedef struct splat_device_s* splat_device;

typedef int32_t splat_device_kind;
enum {
    SPLAT_DEVICE_KIND_OTHER = 1,
    SPLAT_DEVICE_KIND_CPU = 2,
    SPLAT_DEVICE_KIND_VIRTUAL = 3,
    SPLAT_DEVICE_KIND_INTEGRATED = 4,
    SPLAT_DEVICE_KIND_DISCRETE = 5
};

/* Which shaders a device runs. The plain ones are the specification; the others compute the same
 * within the operator's stated error and are faster on their kind of device. The environment
 * variable SPLAT_KERNELS=plain|cpu|gpu overrides the choice. */
typedef int32_t splat_kernels;
enum {
    SPLAT_KERNELS_AUTO = 0,
    SPLAT_KERNELS_PLAIN = 1,
    SPLAT_KERNELS_CPU = 2,
    SPLAT_KERNELS_GPU = 3
};

enum {
    SPLAT_FEATURE_TIMESTAMPS = 1u << 0,
    SPLAT_FEATURE_SUBGROUP_SHUFFLE = 1u << 1,
    SPLAT_FEATURE_SUBGROUP_ARITHMETIC = 1u << 2,
    SPLAT_FEATURE_INT64 = 1u << 3,
    /* device memory is host-visible: tensors map without a copy */
    SPLAT_FEATURE_UNIFIED_MEMORY = 1u << 4
};

typedef struct splat_device_info {
    uint32_t struct_size;
    uint32_t index; /* position in the enumeration of this process */
    splat_device_kind kind;
    uint32_t usable; /* 1, or 0 with the reason in `reason` */
    uint32_t vendor_id;
    uint32_t device_id;
    uint32_t vulkan_version; /* packed as Vulkan does */
    uint32_t driver_version; /* vendor's packing */
    uint8_t uuid[16];
    uint64_t heap_bytes;               /* device-local memory */
    uint64_t max_allocation_bytes;     /* one allocation */
    uint64_t max_storage_buffer_bytes; /* one shader binding, so one tensor */
    uint32_t max_workgroup_invocations;
    uint32_t shared_memory_bytes;
    uint32_t subgroup_size;
    uint32_t features;     /* SPLAT_FEATURE_ bits */
    splat_kernels kernels; /* what SPLAT_KERNELS_AUTO means on this device */
    uint32_t reserved;
    char name[256];
    char driver[256]; /* name and version, in the driver's words */
    char reason[256]; /* why the device is not usable; empty if it is */
} splat_device_info;

/* Count the Vulkan devices of this machine, usable or not.
 * count     out
 * Returns SPLAT_OK (count may be 0), or
 *   SPLAT_ERROR_NO_DEVICE      the Vulkan loader is missing or has no driver at all; the message
 *                              says what to install */
SPLAT_API splat_result splat_device_count(uint32_t* count);

/* Describe device `index` without creating it.
 * info      in/out, struct_size set
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_ARGUMENT (index >= count), SPLAT_ERROR_NO_DEVICE. */
SPLAT_API splat_result splat_device_describe(uint32_t index, splat_device_info* info);

typedef int32_t splat_device_select;
enum {
    SPLAT_SELECT_BEST = 0, /* discrete, then integrated, virtual, CPU; lowest index within a kind */
    SPLAT_SELECT_BY_INDEX = 1, /* field `index` */
    SPLAT_SELECT_BY_UUID = 2,  /* field `uuid` */
    SPLAT_SELECT_BY_KIND = 3   /* field `kind`; lowest index */
};

enum {
    /* Khronos validation: core, synchronisation and GPU-assisted; messages go to the log */
    SPLAT_DEVICE_VALIDATION = 1u << 0,
    /* time every dispatch, see splat_device_profile_json */
    SPLAT_DEVICE_PROFILE = 1u << 1
};

typedef struct splat_device_desc {
    uint32_t struct_size;
    uint32_t flags;   /* SPLAT_DEVICE_ bits */
    const void* next; /* NULL; reserved for extensions */
    splat_device_select select;
    uint32_t index;
    splat_device_kind kind;
    splat_kernels kernels;
    uint8_t uuid[16];
    /* budget, enforced by the library. 0 = the device's heap; on CPU devices 3/4 of physical
     * memory */
    uint64_t max_device_bytes;
    /* longest wait for the device in one call; 0 = 60 s, times SPLAT_TIMEOUT_SCALE */
    uint64_t timeout_ns;
    /* pipeline cache; NULL = libsplat/ in the user's cache folder, "" = none */
    const char* cache_folder;
} splat_device_desc;

/* Open a device.
 * desc      may be NULL for defaults
 * device    out, owned by the caller
 * Returns SPLAT_OK, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      struct_size, flags, next, an enum, or SPLAT_KERNELS in the
 *                                     environment
 *   SPLAT_ERROR_NO_DEVICE             no loader, no driver, or no device that fits `select`; the
 *                                     message lists the devices
 *   SPLAT_ERROR_UNSUPPORTED           the device lacks a feature, which the message names, or the
 *                                     validation layer is missing
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_device_create(const splat_device_desc* desc, splat_device* device);

/* Release a device. Its tensors and operators stay usable; the device closes with the last of them.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_device_destroy(splat_device device);

/* Describe an open device. `kernels` is what it runs, not what AUTO would choose.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT. */
SPLAT_API splat_result splat_device_get_info(splat_device device, splat_device_info* info);

typedef struct splat_memory_info {
    uint32_t struct_size;
    uint32_t allocations; /* live allocations of the driver */
    uint64_t used_bytes;  /* allocated from the driver now */
    uint64_t live_bytes;  /* part of used_bytes that tensors and operators use */
    uint64_t peak_bytes;  /* highest used_bytes since creation */
    uint64_t budget_bytes;
} splat_memory_info;

/* Report device memory.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT. */
SPLAT_API splat_result splat_device_get_memory(splat_device device, splat_memory_info* info);

/* Report the time of every kind of dispatch since creation or the last reset, on a device with
 * SPLAT_DEVICE_PROFILE. JSON: {"device": name, "ops": [{"op", "kernel", "count", "total_ms",
 * "min_ms", "median_ms", "bytes", "flops"}]}; bytes and flops are means over the dispatches, as the
 * operator counts them. The table shows the same in columns, longest first, with rates over the
 * total time.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_STATE  the device was created without SPLAT_DEVICE_PROFILE */
SPLAT_API splat_result splat_device_profile_json(splat_device device, char* buffer, size_t capacity,
                                                 size_t* needed);
SPLAT_API splat_result splat_device_profile_table(splat_device device, char* buffer,
                                                  size_t capacity, size_t* needed);
SPLAT_API splat_result splat_device_profile_reset(splat_device device);

/* ---- Tensor ---------------------------------------------------------------------------------- */

typedef struct splat_tensor_s* splat_tensor;

#define SPLAT_MAX_RANK 8

typedef int32_t splat_dtype;
enum { SPLAT_DTYPE_F32 = 1, SPLAT_DTYPE_I32 = 2, SPLAT_DTYPE_U32 = 3 };

typedef struct splat_tensor_desc {
    uint32_t struct_size;
    uint32_t flags;               /* 0 */
    const void* next;             /* NULL */
    const char* name;             /* used in messages; may be NULL */
    splat_dtype dtype;            /* 0 = SPLAT_DTYPE_F32 */
    uint32_t rank;                /* 0 (a scalar) to SPLAT_MAX_RANK */
    int64_t dims[SPLAT_MAX_RANK]; /* elements, outermost first; each >= 1 */
} splat_tensor_desc;

/* Create a tensor on the device, row-major and contiguous, filled with zeros.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      rank, dtype, a dimension < 1, or 2^31 elements or more
 *   SPLAT_ERROR_UNSUPPORTED           more bytes than max_storage_buffer_bytes of the device
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_tensor_create(splat_device device, const splat_tensor_desc* desc,
                                           splat_tensor* tensor);

/* Create a tensor and fill it as splat_tensor_write does.
 * Returns what splat_tensor_create and splat_tensor_write return. */
SPLAT_API splat_result splat_tensor_from_host(splat_device device, const splat_tensor_desc* desc,
                                              const void* data, size_t bytes,
                                              const int64_t* strides, splat_tensor* tensor);

/* Copy host memory into the tensor.
 * data      in, `bytes` bytes of the tensor's dtype
 * strides   elements between neighbours, one per dimension, >= 0 (0 repeats); NULL = row-major
 *           contiguous
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL data, a negative stride, or strides that reach beyond
 *                                     `bytes`
 *   SPLAT_ERROR_INVALID_STATE         the tensor is mapped
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST; after the last two the tensor's contents are undefined */
SPLAT_API splat_result splat_tensor_write(splat_tensor tensor, const void* data, size_t bytes,
                                          const int64_t* strides);

/* Copy the tensor into host memory; `data` is untouched on error. Strides are as above, but > 0, and
 * no two elements may share a place.
 * Returns what splat_tensor_write returns. */
SPLAT_API splat_result splat_tensor_read(splat_tensor tensor, void* data, size_t bytes,
                                         const int64_t* strides);

typedef int32_t splat_access;
enum { SPLAT_ACCESS_READ = 1, SPLAT_ACCESS_WRITE = 2, SPLAT_ACCESS_READ_WRITE = 3 };

/* Give the host a pointer to the tensor's elements, row-major contiguous, until splat_tensor_unmap.
 * Makes no copy if the device has SPLAT_FEATURE_UNIFIED_MEMORY. With SPLAT_ACCESS_WRITE the contents
 * are undefined until written. While a tensor is mapped no other call may use it.
 * pointer   out, owned by the library
 * bytes     out, may be NULL
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (access),
 *   SPLAT_ERROR_INVALID_STATE (mapped already), SPLAT_ERROR_OUT_OF_HOST_MEMORY,
 *   SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_tensor_map(splat_tensor tensor, splat_access access, void** pointer,
                                        size_t* bytes);

/* End a mapping. With write access the written values become the tensor's contents.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_STATE (not mapped), and the
 * device's errors. */
SPLAT_API splat_result splat_tensor_unmap(splat_tensor tensor);

typedef struct splat_tensor_info {
    uint32_t struct_size;
    splat_dtype dtype;
    uint32_t rank;
    uint32_t mapped; /* 1 while mapped */
    int64_t dims[SPLAT_MAX_RANK];
    uint64_t elements;
    uint64_t bytes;
    char name[64]; /* cut if longer */
} splat_tensor_info;

/* Describe a tensor.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT. */
SPLAT_API splat_result splat_tensor_get_info(splat_tensor tensor, splat_tensor_info* info);

typedef struct splat_tensor_stats {
    uint32_t struct_size;
    uint32_t reserved;
    uint64_t nan_count;
    uint64_t inf_count;
    double min;  /* of the finite elements; +inf if there are none */
    double max;  /* of the finite elements; -inf if there are none */
    double mean; /* of the finite elements; 0 if there are none */
} splat_tensor_stats;

/* Measure an SPLAT_DTYPE_F32 tensor on the device.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (struct or dtype),
 * SPLAT_ERROR_INVALID_STATE (mapped), and the device's errors. */
SPLAT_API splat_result splat_tensor_check(splat_tensor tensor, splat_tensor_stats* stats);

/* Destroy a tensor, mapped or not.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_tensor_destroy(splat_tensor tensor);

/* ---- Operators ------------------------------------------------------------------------------- */

/* A single differentiable operator, as the network uses it; for tests, benchmarks and autograd
 * bindings. */
typedef struct splat_op_s* splat_op;

/* JSON array of all operators: {"name", "inputs": [...], "outputs": [...], "saved": [...],
 * "attributes": [{"name", "type", "default", "about"}], "equation"}.
 * Returns SPLAT_OK or SPLAT_INCOMPLETE. */
SPLAT_API splat_result splat_op_list(char* buffer, size_t capacity, size_t* needed);

enum {
    /* add gradients of parameters to the tensor's contents instead of overwriting them */
    SPLAT_OP_ACCUMULATE = 1u << 0
};

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

/* Record an operator on the given tensors, whose contents may change between runs. All tensors are
 * SPLAT_DTYPE_F32.
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
 * Returns as splat_op_forward; also SPLAT_ERROR_INVALID_STATE before the first forward or without
 * grad_outputs. */
SPLAT_API splat_result splat_op_backward(splat_op op);

/* Destroy an operator; its tensors stay.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_op_destroy(splat_op op);

/* ---- Scene ----------------------------------------------------------------------------------- */

/* A set of 3D Gaussians in host memory, in the parameters that 3DGS files store. Needs no device.
 * A rasterizer that draws it leaves a packed copy on its device, which keeps that device open until
 * the scene changes or is destroyed. Axes are those of 3DGS .ply files: x right, y down, z forward
 * (SPLAT_FRAME_RDF).
 *
 * Attributes, float32, row-major, n Gaussians, K = (sh_degree + 1)^2:
 *   "means" [n,3] scene units             "log_scales" [n,3] or activated "scales" [n,3], > 0
 *   "rotations" [n,4] w, x, y, z          "opacity_logits" [n] or activated "opacities" [n], 0 to 1
 *   "sh" [n,K,3] constant term first; colour = max(0, 0.5 + sum sh_k Y_k(direction)) */
typedef struct splat_scene_s* splat_scene;

typedef struct splat_scene_desc {
    uint32_t struct_size;
    uint32_t flags;     /* 0 */
    const void* next;   /* NULL */
    uint64_t count;     /* Gaussians; 0 makes an empty scene */
    uint32_t sh_degree; /* 0 to 3 */
    uint32_t reserved;
    /* arrays as above, copied; NULL: zeros (rotations: 1, 0, 0, 0) */
    const float* means;
    const float* log_scales;
    const float* rotations;
    const float* opacity_logits;
    const float* sh;
} splat_scene_desc;

/* Create a scene.
 * Returns SPLAT_OK, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      desc, sh_degree > 3
 *   SPLAT_ERROR_UNSUPPORTED           more than 2^27 Gaussians
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY */
SPLAT_API splat_result splat_scene_create(const splat_scene_desc* desc, splat_scene* scene);

typedef int32_t splat_scene_format;
enum {
    SPLAT_SCENE_PLY = 1,            /* 3DGS, ascii or binary, properties in any order */
    SPLAT_SCENE_COMPRESSED_PLY = 2, /* read only */
    SPLAT_SCENE_SPLAT = 3,          /* 8-bit colours, no higher SH bands */
    SPLAT_SCENE_SPZ = 4             /* quantised; versions 1 to 4 are read, 3 and 4 written */
};

/* JSON array of all formats of scene files: {"name" (of reports), "id" (SPLAT_SCENE_), "extension",
 * "holds", "frame" (the usual one), "max_sh_degree", "written" (bool: else read only)}.
 * Returns SPLAT_OK or SPLAT_INCOMPLETE. */
SPLAT_API splat_result splat_scene_formats(char* buffer, size_t capacity, size_t* needed);

/* Axes x, y, z of a file: right or left, up or down, front or back. */
typedef int32_t splat_frame;
enum {
    SPLAT_FRAME_RDF = 1, /* .ply, .splat, COLMAP, OpenCV; and scenes in memory */
    SPLAT_FRAME_RUB = 2, /* .spz, OpenGL, three.js */
    SPLAT_FRAME_LUF = 3,
    SPLAT_FRAME_RUF = 4, /* Unity */
    SPLAT_FRAME_LDB = 5,
    SPLAT_FRAME_RDB = 6,
    SPLAT_FRAME_LUB = 7,
    SPLAT_FRAME_LDF = 8
};

/* For splat_scene_file_desc.sh_degree: only the constant colour. */
#define SPLAT_SH_CONSTANT (-1)

typedef struct splat_scene_file_desc {
    uint32_t struct_size;
    uint32_t flags;            /* 0 */
    const void* next;          /* NULL */
    splat_scene_format format; /* 0 = by the first bytes, else by the extension of the path */
    splat_frame frame;         /* of the file; 0 = the format's usual one */
    /* drop bands, or pad them with zeros, to degree 1 to 3 or (SPLAT_SH_CONSTANT) 0; 0 = keep all */
    int32_t sh_degree;
    uint32_t spz_version; /* to write: 3 or 4; 0 = 3 */
    uint64_t max_count;   /* refuse files with more Gaussians; 0 = 2^27 */
} splat_scene_file_desc;

/* Read a scene.
 * desc      may be NULL for defaults
 * data      in, `bytes` bytes of a file; .splat has no magic bytes, so desc.format must name it
 * Returns SPLAT_OK, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      the file cannot be read, is damaged, truncated, not a scene or
 *                                     not of desc.format; a field of desc
 *   SPLAT_ERROR_UNSUPPORTED           a known format that cannot be read, or more than max_count
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY */
SPLAT_API splat_result splat_scene_load(const char* path, const splat_scene_file_desc* desc,
                                        splat_scene* scene);
SPLAT_API splat_result splat_scene_load_memory(const void* data, size_t bytes,
                                               const splat_scene_file_desc* desc,
                                               splat_scene* scene);

/* Report what was found in the scene's file. JSON: {"format", "version", "count", "sh_degree",
 * "frame", "ignored": [names], "non_finite_values", "bad_rotations"}; {} for a scene without file.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_scene_load_report(splat_scene scene, char* buffer, size_t capacity,
                                               size_t* needed);

/* Write a scene. A file appears whole or not at all. Writing to memory needs desc.format.
 * needed    out, bytes of the file; with a smaller capacity the result is SPLAT_INCOMPLETE and
 *           nothing is written to `buffer`
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      desc, or the file cannot be written; an old file stays
 *   SPLAT_ERROR_UNSUPPORTED           a format or extension that cannot be written
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY */
SPLAT_API splat_result splat_scene_save(splat_scene scene, const char* path,
                                        const splat_scene_file_desc* desc);
SPLAT_API splat_result splat_scene_save_memory(splat_scene scene, const splat_scene_file_desc* desc,
                                               void* buffer, size_t capacity, size_t* needed);

/* Copy an attribute out of a scene or into it.
 * name      as listed above
 * values    `bytes` bytes, at least those of the attribute
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      name; too few bytes; a value written to "scales" or
 *                                     "opacities" outside their range. Nothing is changed */
SPLAT_API splat_result splat_scene_read(splat_scene scene, const char* name, float* values,
                                        size_t bytes);
SPLAT_API splat_result splat_scene_write(splat_scene scene, const char* name, const float* values,
                                         size_t bytes);

/* Copy an attribute to a new tensor of its shape.
 * Returns what splat_scene_read and splat_tensor_from_host return; SPLAT_ERROR_INVALID_STATE for a
 * scene without Gaussians. */
SPLAT_API splat_result splat_scene_to_tensor(splat_scene scene, const char* name,
                                             splat_device device, splat_tensor* tensor);

/* x -> scale * rotation x + translation. Frozen. */
typedef struct splat_similarity {
    double rotation[4];    /* w, x, y, z, of any length > 0 */
    double translation[3]; /* scene units */
    double scale;          /* > 0 */
} splat_similarity;

/* Move, turn and scale a scene, including its spherical harmonics.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (the similarity),
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY; on error the scene is unchanged. */
SPLAT_API splat_result splat_scene_transform(splat_scene scene, const splat_similarity* similarity);

/* Keep the Gaussians whose mean lies in a box.
 * low, high  3 doubles each, scene units; the faces belong to the box
 * Returns as splat_scene_transform. */
SPLAT_API splat_result splat_scene_crop(splat_scene scene, const double* low, const double* high);

enum {
    SPLAT_FILTER_FINITE = 1u << 0, /* drop NaN, infinities and rotations of length 0 */
    SPLAT_FILTER_SORT = 1u << 1    /* order the remaining ones along a Morton curve */
};

/* Keep the Gaussians of opacity >= min_opacity, in their order.
 * flags        SPLAT_FILTER_ bits
 * min_opacity  0 to 1
 * Returns as splat_scene_transform. */
SPLAT_API splat_result splat_scene_filter(splat_scene scene, uint32_t flags, double min_opacity);

/* Concatenate the Gaussians of `count` scenes into a new one, with the highest of their degrees.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (count 0, NULL),
 *   SPLAT_ERROR_UNSUPPORTED (more than 2^27 Gaussians), SPLAT_ERROR_OUT_OF_HOST_MEMORY. */
SPLAT_API splat_result splat_scene_merge(const splat_scene* scenes, uint32_t count,
                                         splat_scene* scene);

typedef struct splat_scene_info {
    uint32_t struct_size;
    uint32_t sh_degree;
    uint64_t count;
    double low[3];    /* lower bounds of the finite means */
    double high[3];   /* upper bounds of the finite means */
    double center[3]; /* median of the finite means, axis by axis */
    double radius;    /* distance from the centre that holds 95 % of the finite means */
    double scale_min; /* of the finite standard deviations, scene units */
    double scale_max;
    double scale_mean;
    double opacity_min; /* 0 to 1 */
    double opacity_max;
    double opacity_mean;
    uint64_t non_finite;    /* values of all attributes */
    uint64_t bad_rotations; /* of length 0, or not finite */
    uint64_t degenerate;    /* Gaussians with a scale below 1e-12 */
    uint64_t invisible;     /* Gaussians of opacity below 1/255 */
} splat_scene_info;

/* Measure a scene.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT,
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY. */
SPLAT_API splat_result splat_scene_get_info(splat_scene scene, splat_scene_info* info);

/* Destroy a scene.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_scene_destroy(splat_scene scene);

/* ---- Camera ---------------------------------------------------------------------------------- */

/* A pinhole camera. Frozen. The centre of the pixel in column i and row j is (i + 0.5, j + 0.5). */
typedef struct splat_camera {
    uint32_t width; /* pixels */
    uint32_t height;
    double fx; /* pixels */
    double fy;
    double cx;
    double cy;
    /* row-major 4x4, last row 0 0 0 1; OpenCV axes of the camera: x right, y down, z forward */
    double world_to_camera[16];
} splat_camera;

/* Intrinsics of an image whose horizontal field of view is `fov_x` radians, square pixels, principal
 * point in the middle; the pose is the identity.
 * camera    out
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_ARGUMENT: a side outside 1 to 16384, or an angle outside
 * 0 to pi. */
SPLAT_API splat_result splat_camera_from_fov(uint32_t width, uint32_t height, double fov_x,
                                             splat_camera* camera);

/* Set the pose: at `eye`, looking at `target`, with `up` (a direction of the world) upwards in the
 * image.
 * camera    in/out, the intrinsics stay
 * eye, target, up  3 doubles each, scene units
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_ARGUMENT: eye and target coincide, `up` is parallel to
 * the view, or a value is not finite. */
SPLAT_API splat_result splat_camera_look_at(splat_camera* camera, const double* eye,
                                            const double* target, const double* up);

/* Set the pose from an OpenGL camera-to-world matrix (x right, y up, z backwards; NeRF's
 * transform_matrix), or return it as one.
 * camera_to_world  16 doubles, row-major
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_ARGUMENT: the matrix is not a rotation with a
 * translation. */
SPLAT_API splat_result splat_camera_from_opengl(splat_camera* camera,
                                                const double* camera_to_world);
SPLAT_API splat_result splat_camera_to_opengl(const splat_camera* camera, double* camera_to_world);

typedef struct splat_orbit_desc {
    uint32_t struct_size;
    uint32_t flags;   /* 0 */
    const void* next; /* NULL */
    uint32_t width;   /* pixels; 0 = 512 */
    uint32_t height;  /* pixels; 0 = 512 */
    double fov_x;     /* radians; 0 = 0.7 */
    double elevation; /* radians above the horizon */
    double start;     /* angle of the first camera, radians; 0: in front, looking along +z */
    double distance;  /* scene units from the centre; 0 = the scene's radius fills the image */
    double up[3];     /* a direction of the world; 0, 0, 0 = 0, -1, 0 */
} splat_orbit_desc;

/* `count` cameras at equal angles on a circle around the centre of a scene.
 * desc      may be NULL for defaults
 * cameras   out, `count` of them
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      count 0, options that do not give a valid camera, or a scene
 *                                     without extent if distance is 0 */
SPLAT_API splat_result splat_camera_orbit(splat_scene scene, const splat_orbit_desc* desc,
                                          uint32_t count, splat_camera* cameras);

enum {
    /* read cameras with lens distortion as if they had none, instead of refusing them */
    SPLAT_CAMERA_IGNORE_DISTORTION = 1u << 0
};

typedef struct splat_camera_file_desc {
    uint32_t struct_size;
    uint32_t flags;   /* SPLAT_CAMERA_ bits */
    const void* next; /* NULL */
    uint32_t width;   /* pixels, for a transforms.json without size; else 0 */
    uint32_t height;
} splat_camera_file_desc;

/* Read the cameras of a NeRF transforms.json, or of a COLMAP model's folder (text or binary).
 * desc      may be NULL for defaults
 * cameras   out, `capacity` of them; may be NULL when capacity is 0
 * count     out, number of cameras in the file; may be NULL
 * Returns SPLAT_OK, SPLAT_INCOMPLETE (the first `capacity` are written), or
 *   SPLAT_ERROR_INVALID_ARGUMENT      the file cannot be read or is damaged, an invalid camera
 *   SPLAT_ERROR_UNSUPPORTED           distortion, another lens model
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY */
SPLAT_API splat_result splat_camera_load(const char* path, const splat_camera_file_desc* desc,
                                         splat_camera* cameras, uint32_t capacity, uint32_t* count);

/* Report on the same file. JSON: {"names": [paths of the images, in the order of the cameras],
 * "warnings": [sentences]}.
 * Returns as splat_camera_load. */
SPLAT_API splat_result splat_camera_load_report(const char* path,
                                                const splat_camera_file_desc* desc, char* buffer,
                                                size_t capacity, size_t* needed);

/* ---- Rasterizer ------------------------------------------------------------------------------ */

/* Draws a fixed number of Gaussians into a fixed number of views, and computes gradients. */
typedef struct splat_rasterizer_s* splat_rasterizer;

typedef int32_t splat_convention;
enum {
    SPLAT_CONVENTION_3DGS = 1,  /* Kerbl et al. 2023: extents of 3 sigma, quaternions as given */
    SPLAT_CONVENTION_GSPLAT = 2 /* gsplat 1.6: exactly alpha >= 1/255, quaternions normalised */
};

/* What a rasterizer can do. */
enum {
    SPLAT_RASTERIZER_DIRECT_COLORS = 1u << 0, /* colours are RGB, not spherical harmonics */
    SPLAT_RASTERIZER_ANTIALIASED = 1u << 1,   /* opacity compensates for the dilation */
    SPLAT_RASTERIZER_DEPTH = 1u << 2,         /* outputs DEPTH, EXPECTED_DEPTH, CONTRIBUTORS */
    SPLAT_RASTERIZER_BACKWARD = 1u << 3,      /* gradients */
    /* gradients from the depth; of the pose (SPLAT_CONVENTION_GSPLAT); of means2d; imply BACKWARD */
    SPLAT_RASTERIZER_GRAD_DEPTH = 1u << 4,
    SPLAT_RASTERIZER_GRAD_POSE = 1u << 5,
    SPLAT_RASTERIZER_GRAD_MEANS2D = 1u << 6,
    /* SPLAT_CONVENTION_3DGS: the gradient of the original code with its three quirks */
    SPLAT_RASTERIZER_ORIGINAL_GRADIENT = 1u << 7,
    SPLAT_RASTERIZER_NORMALS = 1u << 8 /* output NORMALS */
};

/* Work that is skipped because it does not change the image. Gaussians that a convention culls (see
 * SPLAT_OUTPUT_MEANS2D) are always culled. */
enum {
    SPLAT_SKIP_OPACITY_EXTENT = 1u << 0, /* the region where alpha < 1/255 */
    SPLAT_SKIP_EXACT_TILES = 1u << 1,    /* tiles that the ellipse does not touch */
    SPLAT_SKIP_CULL = 1u << 2, /* sorting Gaussians that reach no tile: too faint, too small */
    /* blending where every pixel has stopped; not in plain kernels */
    SPLAT_SKIP_EARLY_OUT = 1u << 3,
    /* drawing if scene, cameras and background are unchanged; never for tensors, which may have
     * been written */
    SPLAT_SKIP_UNCHANGED = 1u << 4,
    /* Gaussians that a block of 8 x 8 pixels cannot see; only in kernels for CPUs */
    SPLAT_SKIP_BLOCKS = 1u << 5
};

typedef struct splat_rasterizer_desc {
    uint32_t struct_size;
    uint32_t flags;              /* SPLAT_RASTERIZER_ bits */
    const void* next;            /* NULL */
    uint32_t gaussians;          /* N, >= 0 */
    uint32_t views;              /* V; 0 = 1 */
    uint32_t width;              /* W, pixels */
    uint32_t height;             /* H, pixels */
    uint32_t sh_degree;          /* 0 to 3; 0 with direct colours */
    uint32_t disabled_skips;     /* SPLAT_SKIP_ bits of skips to turn off, for measuring */
    splat_convention convention; /* 0 = SPLAT_CONVENTION_3DGS */
    float near_plane;            /* scene units; 0 = 0.2, in SPLAT_CONVENTION_GSPLAT 0.01 */
    float far_plane;             /* scene units; 0 = 1e10 */
    uint32_t reserved;
} splat_rasterizer_desc;

/* Create a rasterizer with its memory; the memory for intersections grows on demand.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      a field of desc outside its range, or flags that exclude each
 *                                     other
 *   SPLAT_ERROR_UNSUPPORTED           more Gaussians, views or pixels than the device takes at
 *                                     once
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_rasterizer_create(splat_device device,
                                               const splat_rasterizer_desc* desc,
                                               splat_rasterizer* rasterizer);

typedef struct splat_gaussians_desc {
    uint32_t struct_size;
    uint32_t flags;         /* 0 */
    const void* next;       /* NULL */
    splat_tensor means;     /* [N,3] scene units */
    splat_tensor scales;    /* [N,3] standard deviations, scene units */
    splat_tensor rotations; /* [N,4] w, x, y, z */
    splat_tensor opacities; /* [N] 0 to 1 */
    splat_tensor sh;        /* [N,(sh_degree+1)^2,3]; NULL with direct colours */
    splat_tensor colors;    /* [N,3]; NULL without direct colours */
} splat_gaussians_desc;

/* Draw Gaussians; the images stay in the rasterizer, see splat_rasterizer_output. Gaussians that are
 * not finite or have no extent are left out. A scene keeps its packed copy on the device for later
 * calls. The copy keeps the device open until the scene is changed or destroyed, even if rasterizer
 * and device are destroyed earlier.
 * scene           N Gaussians; bands beyond the rasterizer's degree are ignored
 * gaussians       tensors of the rasterizer's device; all NULL for N = 0
 * cameras         `count` = V cameras of W x H pixels
 * background      3 floats RGB; NULL = black
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      a camera that is singular, not finite or of another size; a
 *                                     wrong count; a background that is not finite; a scene with
 *                                     another number of Gaussians; a tensor of another device or
 *                                     dtype
 *   SPLAT_ERROR_INVALID_STATE         a tensor is mapped; a scene and direct colours
 *   SPLAT_ERROR_SHAPE_MISMATCH        the message names the tensor and the shape expected
 *   SPLAT_ERROR_UNSUPPORTED           more Gaussians in one tile than this device's loops take
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST
 * After an error before the device starts, the last images stay; after a later one there are none. */
SPLAT_API splat_result splat_rasterizer_forward_scene(splat_rasterizer rasterizer,
                                                      splat_scene scene,
                                                      const splat_camera* cameras, uint32_t count,
                                                      const float* background);
SPLAT_API splat_result splat_rasterizer_forward(splat_rasterizer rasterizer,
                                                const splat_gaussians_desc* gaussians,
                                                const splat_camera* cameras, uint32_t count,
                                                const float* background);

typedef int32_t splat_output;
enum {
    SPLAT_OUTPUT_RGB = 1,            /* [V,H,W,3] over the background */
    SPLAT_OUTPUT_ALPHA = 2,          /* [V,H,W] */
    SPLAT_OUTPUT_DEPTH = 3,          /* [V,H,W] sum of weight * depth, scene units along z */
    SPLAT_OUTPUT_EXPECTED_DEPTH = 4, /* [V,H,W] depth / alpha */
    SPLAT_OUTPUT_CONTRIBUTORS = 5,   /* [V,H,W] Gaussians of weight > 0 */
    /* Outputs of Gaussians are 0 for culled ones: before the near or behind the far plane, outside
     * the image, not finite, without extent, or (gsplat) fainter than 1/255. No skip changes them. */
    SPLAT_OUTPUT_MEANS2D = 6,     /* [V,N,2] pixels */
    SPLAT_OUTPUT_RADII = 7,       /* [V,N,2] pixels */
    SPLAT_OUTPUT_CONICS = 8,      /* [V,N,3] a, b, c of exp(-(a x^2 + c y^2) / 2 - b x y) */
    SPLAT_OUTPUT_DEPTHS = 9,      /* [V,N] scene units along z */
    SPLAT_OUTPUT_VISIBILITY = 10, /* [V,N] 1, or 0 if culled */
    /* [V,H,W,3] sum of weight * normal: axis of the smallest scale, OpenCV axes of the camera */
    SPLAT_OUTPUT_NORMALS = 11
};

/* Copy an output of the last forward call, float32, to a tensor or to host memory.
 * tensor    on the rasterizer's device, with the output's shape
 * values    `bytes` bytes, at least those of the output; untouched on error
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      not a valid output, too few bytes, device or dtype
 *   SPLAT_ERROR_INVALID_STATE         no successful forward call, a mapped tensor, or a rasterizer
 *                                     created without SPLAT_RASTERIZER_DEPTH or _NORMALS
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST; after the last two the tensor's contents are undefined */
SPLAT_API splat_result splat_rasterizer_output(splat_rasterizer rasterizer, splat_output output,
                                               splat_tensor tensor);
SPLAT_API splat_result splat_rasterizer_read(splat_rasterizer rasterizer, splat_output output,
                                             float* values, size_t bytes);

enum {
    /* add gradients to the tensors' contents instead of overwriting them */
    SPLAT_GRADIENTS_ACCUMULATE = 1u << 0
};

typedef struct splat_gradients_desc {
    uint32_t struct_size;
    uint32_t flags;   /* SPLAT_GRADIENTS_ bits */
    const void* next; /* NULL */
    /* in: gradients of the loss with respect to outputs; NULL: zeros */
    splat_tensor grad_rgb;   /* [V,H,W,3] */
    splat_tensor grad_alpha; /* [V,H,W] */
    splat_tensor grad_depth; /* [V,H,W] */
    /* out: gradients of the loss with respect to inputs; NULL: not computed */
    splat_tensor grad_means;           /* [N,3] */
    splat_tensor grad_scales;          /* [N,3] */
    splat_tensor grad_rotations;       /* [N,4] */
    splat_tensor grad_opacities;       /* [N] */
    splat_tensor grad_sh;              /* [N,(sh_degree+1)^2,3] */
    splat_tensor grad_colors;          /* [N,3] direct colours */
    splat_tensor grad_means2d;         /* [V,N,2] per pixel */
    splat_tensor grad_means2d_abs;     /* [V,N,2] sums over the pixels of absolute values */
    splat_tensor grad_world_to_camera; /* [V,3,4] rows of the rotation and the translation */
} splat_gradients_desc;

/* Compute gradients at the inputs of the last forward call. The rasterizer keeps a copy of them.
 * Gradients of a scene are with respect to its activated attributes.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      desc; a tensor of another device or dtype; an output that is
 *                                     also another tensor of the call
 *   SPLAT_ERROR_INVALID_STATE         no successful forward call, a mapped tensor, or a gradient
 *                                     that the rasterizer's flags do not include
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST; after the last two the gradients are undefined */
SPLAT_API splat_result splat_rasterizer_backward(splat_rasterizer rasterizer,
                                                 const splat_gradients_desc* gradients);

typedef struct splat_rasterizer_info {
    uint32_t struct_size;
    uint32_t passes;  /* groups of tile rows that the last forward call drew one by one */
    uint64_t visible; /* (Gaussian, view) pairs that reached a tile (with SPLAT_SKIP_CULL off: that
                           * the convention keeps); the maximum over passes */
    uint64_t pairs;   /* (tile, Gaussian, view) triples */
    uint64_t longest; /* Gaussians in the fullest tile */
    uint64_t tiles;   /* of all views */
    uint64_t empty_tiles; /* tiles without Gaussians */
    uint64_t bytes; /* device memory of the rasterizer, without the packed copies of scenes, which
                           * rasterizers share */
    uint32_t runs;  /* 0: nothing had changed; 2 or more: memory had to grow */
    uint32_t reserved;
} splat_rasterizer_info;

/* Describe the last forward call; zeros before the first.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT. */
SPLAT_API splat_result splat_rasterizer_get_info(splat_rasterizer rasterizer,
                                                 splat_rasterizer_info* info);

/* Destroy a rasterizer; scenes, with their packed copies on the device, and tensors stay.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_rasterizer_destroy(splat_rasterizer rasterizer);

/* ---- Weights --------------------------------------------------------------------------------- */

/* Named tensors of a file of network weights; needs no device. float32 values of a .safetensors file of 1 MiB or
 * more are not copied: the file stays open and mapped. The file may be removed or replaced by a new file of the
 * same name, but must not be written in place, as cp does. Functions that use values, including those of folded
 * weights, refuse a file whose size or time has changed (SPLAT_ERROR_INVALID_ARGUMENT). A write racing with the
 * call may be read. A file that is truncated during a call, or lost with its disk, ends the process (SIGBUS). */
typedef struct splat_weights_s* splat_weights;

enum { SPLAT_WEIGHTS_HALF = 1u << 0 }; /* write float16 */

typedef struct splat_weights_info {
    uint32_t struct_size;
    uint32_t rank;
    int64_t dims[SPLAT_MAX_RANK]; /* outermost first; a 0 means no elements */
    uint64_t elements;
    const char* name;  /* this and dtype live as long as the weights */
    const char* dtype; /* in the file: "float32", "bfloat16", "int64", ...; read as float32 */
} splat_weights_info;

/* Load a .safetensors, .pth (torch.save; no code of its pickle is run) or .npz file, recognised by its
 * contents. Values that are not finite are kept.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_ARGUMENT (NULL, or a file that cannot be read or is damaged),
 *   SPLAT_ERROR_UNSUPPORTED (a pickle that holds more than weights, another number type),
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY */
SPLAT_API splat_result splat_weights_load(const char* path, splat_weights* weights);

/* Write .safetensors (with the metadata) or .npz by the extension; the file appears whole or not at
 * all. flags: SPLAT_WEIGHTS_HALF
 * Returns as splat_weights_load, SPLAT_ERROR_INVALID_HANDLE; refuses other extensions, and finite
 *   values beyond float16 */
SPLAT_API splat_result splat_weights_save(splat_weights weights, const char* path, uint32_t flags);

/* Count, describe, find by name and copy tensors. `index` counts from 0 in the order of the file;
 * `bytes` is at least the size of the values. The report is JSON: {"format", "metadata": {key: text},
 * "warnings": [sentences]}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE (report), SPLAT_ERROR_INVALID_HANDLE,
 *   SPLAT_ERROR_INVALID_ARGUMENT (NULL, no such index or name, too few bytes) */
SPLAT_API splat_result splat_weights_count(splat_weights weights, uint32_t* count);
SPLAT_API splat_result splat_weights_get_info(splat_weights weights, uint32_t index,
                                              splat_weights_info* info);
SPLAT_API splat_result splat_weights_find(splat_weights weights, const char* name, uint32_t* index);
SPLAT_API splat_result splat_weights_read(splat_weights weights, uint32_t index, float* values,
                                          size_t bytes);
SPLAT_API splat_result splat_weights_report(splat_weights weights, char* buffer, size_t capacity,
                                            size_t* needed);

enum { SPLAT_FOLD_OUT = 1u << 0 }; /* undo: take folded adapters out of weights */

/* Fold low-rank adapters into the weights they belong to: W + alpha / rank * (B A), or minus with SPLAT_FOLD_OUT,
 * in float64, rounded once. The result has no adapters, and no lora_alpha or lora_rank in its metadata; other
 * tensors are unchanged. A network of the result predicts the same as one with separate adapters, up to float32
 * rounding (1e-6 of "raw"), in less time. Folding out again restores a weight up to two roundings.
 * adapters  "<layer>.lora_A" [rank,in * k * k] and ".lora_B" [out,rank], or PEFT's names and shapes,
 *           see splat_model_export; other tensors are ignored; NULL: those among `weights`
 * alpha     finite; opt.lora_alpha of the training
 * flags     SPLAT_FOLD_OUT
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH (which layer),
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, or SPLAT_ERROR_INVALID_ARGUMENT (no adapters, half a pair, a
 *   missing layer, a weight that would not be finite) */
SPLAT_API splat_result splat_weights_fold(splat_weights weights, splat_weights adapters,
                                          double alpha, uint32_t flags, splat_weights* folded);
SPLAT_API splat_result splat_weights_destroy(splat_weights weights);

/* ---- Models ---------------------------------------------------------------------------------- */

/* A network from images to Gaussians (Splatter Image, with depth, normal and mask channels, embeddings
 * and low-rank adapters), with its parameters on a device. M = views * R * R Gaussians per object; N =
 * objects * views images of R x R pixels. The caller synchronises calls on one model.
 * Keys of a configuration: splat_config_keys; opt.freeze and opt.train_with_adapters,
 * lists of parts of parameter names, choose what gets gradients. */
typedef struct splat_model_s* splat_model;

enum {
    SPLAT_MODEL_GRADIENTS = 1u << 0, /* enable splat_model_backward: takes memory for gradients */
    SPLAT_MODEL_TRAINING = 1u << 1,  /* apply dropout */
    /* Prepare weights anew in every pass, which is slower. Without this flag and without gradients, the second
     * pass of the same weights keeps them prepared (0.7 GiB for the cars model) if the device has the memory. */
    SPLAT_MODEL_LOW_MEMORY = 1u << 2,
    /* With GRADIENTS: recompute each block's activations in the backward pass instead of keeping them. The
     * same numbers in less memory and more time. */
    SPLAT_MODEL_RECOMPUTE = 1u << 3,
    SPLAT_MODEL_INPUT_GRADIENTS = 1u << 4 /* with GRADIENTS: also of images, embedding and tokens */
};

/* Kernels of 3x3 convolutions, which `vkrun bench model --errors` compares. STRICT has the smallest errors,
 * FAST the shortest times. */
enum { SPLAT_PRECISION_BALANCED = 0, SPLAT_PRECISION_STRICT = 1, SPLAT_PRECISION_FAST = 2 };

typedef struct splat_model_desc {
    uint32_t struct_size;
    uint32_t flags; /* SPLAT_MODEL_* */
    const void* next;
    const char*
        config; /* text, JSON or YAML with the keys of Splatter Image; NULL: the cars model */
    uint32_t
        objects; /* of a batch; 0: 1. If an activation of the batch exceeds one binding of the device, the
                         * batch runs in equal slices. A backward pass then repeats the forward pass of all
                         * slices except the last, and dropout differs from that of an undivided batch */
    int32_t precision; /* SPLAT_PRECISION_* */
} splat_model_desc;

/* Create a model; its parameters are zero.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (desc; an
 *   unknown key of the configuration or a value outside its range; a model.base_dim whose multiples do
 *   not divide into a layer's groups; GRADIENTS with nothing to train), SPLAT_ERROR_UNSUPPORTED,
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY */
SPLAT_API splat_result splat_model_create(splat_device device, const splat_model_desc* desc,
                                          splat_model* model);

/* Initialise the parameters at random, as the published code does. Returns SPLAT_OK and errors of the
 * device. */
SPLAT_API splat_result splat_model_init(splat_model model, uint64_t seed);

enum {
    SPLAT_LOAD_GRAFT = 1u << 0, /* widen the first convolution; ignore tensors the model lacks */
    SPLAT_LOAD_TAKE_RAYS = 1u << 1,  /* use the file's field of view */
    SPLAT_LOAD_FROM_DEPTH = 1u << 2, /* channels after RGB that the file's network had; for GRAFT */
    SPLAT_LOAD_FROM_NORMAL = 1u << 3,
    SPLAT_LOAD_FROM_MASK = 1u << 4,
    SPLAT_LOAD_ADAPTERS = 1u << 5 /* the file has only adapters; other parameters stay */
};

/* Load the parameters of a state dict, all or none. Adapters, embeddings and attention to tokens that
 * the file lacks keep their values. With GRAFT each channel goes to the one of the same meaning,
 * and the outputs stay those of the file's network until the new channels are trained. Tensors that
 * the model lacks are ignored, such as the attention to tokens in encoders of earlier versions.
 * flags: SPLAT_LOAD_*
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH (which tensor),
 *   SPLAT_ERROR_INVALID_ARGUMENT (a tensor that is missing or not finite; without GRAFT, one that the
 *   model lacks; another field of view or alpha), SPLAT_ERROR_INVALID_STATE (ADAPTERS for a model
 *   without adapters) */
SPLAT_API splat_result splat_model_load(splat_model model, splat_weights weights, uint32_t flags);

/* Store the model as a state dict, with the buffers of published files. */
SPLAT_API splat_result splat_model_store(splat_model model, splat_weights* weights);

enum {
    SPLAT_EXPORT_ADAPTERS = 1, /* only adapters, with PEFT's names and shapes: for each layer
                                * base_model.model.<layer>.lora_A.weight and .lora_B.weight */
    SPLAT_EXPORT_MERGED = 2    /* the state dict with adapters folded into the weights */
};

/* Export a model's parameters in another form. what: SPLAT_EXPORT_*
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT,
 *   SPLAT_ERROR_INVALID_STATE (a model without adapters) */
SPLAT_API splat_result splat_model_export(splat_model model, uint32_t what, splat_weights* weights);

/* JSON: {"config", "parameters", "trainable", "slices" (of a batch), "bytes": {"activations" (of a
 * slice), "prepared" (weights; 0 while they are not kept, see SPLAT_MODEL_LOW_MEMORY)}, "load":
 * {"copied", "widened", "fresh", "left_out", "rays_differ", "rays_taken"}}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT */
SPLAT_API splat_result splat_model_report(splat_model model, char* buffer, size_t capacity,
                                          size_t* needed);

typedef struct splat_model_input {
    uint32_t struct_size;
    uint32_t step; /* of the optimiser; with seed it determines dropout */
    uint64_t seed;
    const float* images; /* [N,channels,R,R]: RGB 0 to 1, depth, normal, mask, origin distance */
    const float* view_to_world; /* [N,4,4] row vectors: p_world = p_view M; NULL: the identity */
    const float* quaternions;   /* [N,4] w x y z of that rotation; NULL with view_to_world */
    const float* focals;        /* [N,2] pixels; NULL unless the configuration's fov is 0 */
    const float* embedding;     /* [N,length] of a custom embedding, else NULL */
    const float* tokens;        /* [N,token_dim,tokens], else NULL */
    uint32_t channels; /* of each image, checked against the configuration; 0: not checked */
    uint32_t objects;  /* in the arrays, checked against the model's; 0: not checked */
} splat_model_input;

/* Run the network. Arrays are read before the call returns.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH (channels, objects),
 *   SPLAT_ERROR_INVALID_ARGUMENT (NULL for an array that the configuration needs, an array that it
 *   does not need, values that are not finite), in each case with the last pass unchanged;
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_model_forward(splat_model model, const splat_model_input* input);

/* Read a result of the latest splat_model_forward, by name: "means" [objects,M,3] scene units, "opacities"
 * [objects,M,1], "scales" [objects,M,3], "rotations" [objects,M,4] w x y z, "sh" [objects,M,K,3] with
 * the constant term first, "raw" [N,output channels,R,R]; parameters by the names of the state dict,
 * and their gradients as "grad:" and the name. With SPLAT_MODEL_INPUT_GRADIENTS also gradients of the
 * latest backward pass: "grad:images" [N,channels that the network sees,R,R], "grad:embedding" (custom
 * ones), "grad:tokens", shaped as in splat_model_input. bytes: at least those of the values.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (no such name, too few
 *   bytes), SPLAT_ERROR_INVALID_STATE (before the first pass, or no gradient) */
SPLAT_API splat_result splat_model_read(splat_model model, const char* name, float* values,
                                        size_t bytes);

/* Set a parameter, by the name of the state dict; bytes: exactly those of its values.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL, no such parameter, a
 *   value that is not finite), SPLAT_ERROR_SHAPE_MISMATCH (bytes), SPLAT_ERROR_OUT_OF_HOST_MEMORY,
 *   SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_model_write(splat_model model, const char* name, const float* values,
                                         size_t bytes);

/* Copy the Gaussians of one object into a new scene. Returns as splat_model_read. */
SPLAT_API splat_result splat_model_scene(splat_model model, uint32_t object, splat_scene* scene);

/* Add the gradients of a loss to the gradients of parameters. The loss is given by its gradients with
 * respect to "means", "opacities", "scales", "rotations" and "sh", in this order; NULL entries are zero.
 * Call it once after each splat_model_forward, whose results stay readable.
 * Returns as splat_model_forward; SPLAT_ERROR_INVALID_STATE without SPLAT_MODEL_GRADIENTS or a pass, or
 *   after parameters have changed, with gradients unchanged. After other errors the gradients may hold
 *   part of the batch: call splat_model_zero_gradients */
SPLAT_API splat_result splat_model_backward(splat_model model, const float* const gradients[5]);
SPLAT_API splat_result splat_model_zero_gradients(splat_model model);

/* Destroy a model. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_model_destroy(splat_model model);

/* ---- Modules --------------------------------------------------------------------------------- */

/* One operator or one block of the network with its parameters: the parts of models, for building other
 * networks. The caller synchronises calls on one module.
 *
 * Ports and parameters are named. For an operator of splat_op_list, row-major inputs with gradients
 * (weight, bias, gamma, beta) are parameters, the other inputs are inputs. `ports` gives the shapes of all of
 * them; optional ones may be omitted. "residual_block" is the block of Song et al.'s U-Net as Splatter Image uses
 * it:
 *   inputs      x [N,C,H,W]; embedding [N,E] adds FiLM; tokens [N,D,T,1] add attention to them;
 *               random_counter [4] if dropout acts (the bits of seed, seed >> 32, step and 0)
 *   output      y
 *   parameters  as in the state dict, after "block."; if there are adapters, only they are trained
 *   attributes  out_channels (0: C), up, down, attention (self-attention), views (images that attend to
 *               each other), affine_film, dropout, lora_rank, lora_alpha, lora_dropout */
typedef struct splat_module_s* splat_module;

enum {
    SPLAT_MODULE_GRADIENTS = 1u << 0,       /* enable splat_module_backward */
    SPLAT_MODULE_INPUT_GRADIENTS = 1u << 1, /* with GRADIENTS: also of inputs */
    SPLAT_MODULE_TRAINING =
        1u << 2 /* apply dropout in a residual_block; an operator always applies it */
};

typedef struct splat_module_desc {
    uint32_t struct_size;
    uint32_t flags;                 /* SPLAT_MODULE_* */
    const void* next;               /* NULL */
    const char* type;               /* a name of splat_op_list, or "residual_block" */
    const char* attributes;         /* JSON object; NULL: defaults */
    const splat_tensor_desc* ports; /* with name, rank, dims */
    uint32_t port_count;
    int32_t precision; /* SPLAT_PRECISION_*, only for residual_block; conv2d has an attribute */
} splat_module_desc;

/* Create a module; its parameters, inputs and gradients of outputs are zero.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (desc, a port or attribute
 *   that the type does not have, GRADIENTS for a type without any), SPLAT_ERROR_SHAPE_MISMATCH (a port
 *   that is missing or does not fit),
 *   SPLAT_ERROR_UNSUPPORTED, SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY */
SPLAT_API splat_result splat_module_create(splat_device device, const splat_module_desc* desc,
                                           splat_module* module);

/* Initialise the parameters. A block starts as in the published code. In an operator gamma is 1, other vectors are
 * 0, and the rest has Glorot's uniform distribution. Returns SPLAT_OK and errors of the device. */
SPLAT_API splat_result splat_module_init(splat_module module, uint64_t seed);

/* JSON: {"type", "inputs": [{"name", "shape"}], "outputs": [...], "parameters": [{"name", "shape",
 * "trainable"}], "bytes" (activations and workspaces)}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE */
SPLAT_API splat_result splat_module_report(splat_module module, char* buffer, size_t capacity,
                                           size_t* needed);

/* Write an input, a parameter, or the gradient of the loss with respect to an output ("grad:y"). Read these,
 * an output ("y"), and gradients of parameters ("grad:weight"; sums since splat_module_zero_gradients) and
 * of inputs ("grad:x"). Row-major; bytes: exactly those of the tensor.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL, no such name, a value
 *   that is not finite, except in an input without gradient),
 *   SPLAT_ERROR_SHAPE_MISMATCH (bytes), SPLAT_ERROR_INVALID_STATE (before the pass that computes it, or if
 *   the module computes none), SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_module_write(splat_module module, const char* name,
                                          const float* values, size_t bytes);
SPLAT_API splat_result splat_module_read(splat_module module, const char* name, float* values,
                                         size_t bytes);

/* Forward computes the outputs. Backward, called once after each forward, adds to the gradients of parameters and
 * overwrites those of inputs.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_STATE (backward without
 *   SPLAT_MODULE_GRADIENTS, without a new forward pass, or after inputs or parameters were written; gradients are
 *   then unchanged), SPLAT_ERROR_OUT_OF_HOST_MEMORY,
 *   SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_module_forward(splat_module module);
SPLAT_API splat_result splat_module_backward(splat_module module);
SPLAT_API splat_result splat_module_zero_gradients(splat_module module);

/* Destroy a module. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_module_destroy(splat_module module);

/* ---- Training -------------------------------------------------------------------------------- */

/* JSON array of all keys of a configuration, in the order of their sections: {"key", "type" ("integer",
 * "number", "boolean", "text", "choice", "list of integers", "list of numbers", "list of texts", or "any" if the
 * value is not read), "range" (as text; the words of a choice; empty: any value of the type),
 * "default" (null: none), "origin" ("published": of Splatter Image or its fork with priors; "ours"),
 * "effect" (false: accepted, but without effect), "about" (one sentence)}.
 * Returns SPLAT_OK or SPLAT_INCOMPLETE. */
SPLAT_API splat_result splat_config_keys(char* buffer, size_t capacity, size_t* needed);

/* Make a configuration of network and training with every value, as JSON for splat_model_create and
 * splat_trainer_create, from the text of a YAML or JSON file and changes to it.
 * text    NULL: the defaults, those of the published cars model
 * values  `count` texts "key=value", such as "opt.base_lr=1e-4"; later ones win
 * Keys and their meanings: splat_config_keys.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_ARGUMENT (an unknown key, with the nearest
 *   known one; a value outside its range) */
SPLAT_API splat_result splat_config_merge(const char* text, const char* const* values, size_t count,
                                          char* buffer, size_t capacity, size_t* needed);

/* A network in training: parameters, Adam's moments, averaged weights, and the rasterizer that draws its
 * Gaussians. The caller synchronises calls on one trainer. */
typedef struct splat_trainer_s* splat_trainer;

typedef struct splat_trainer_desc {
    uint32_t struct_size;
    uint32_t flags; /* 0 */
    const void* next;
    const char* config; /* from splat_config_merge; NULL: the defaults */
} splat_trainer_desc;

/* Returns as splat_model_create. */
SPLAT_API splat_result splat_trainer_create(splat_device device, const splat_trainer_desc* desc,
                                            splat_trainer* trainer);

/* Return the network in training, to initialise, load, store and read it: a separate handle, which the
 * caller destroys and which keeps the trainer's memory alive. Its passes apply dropout as in training. */
SPLAT_API splat_result splat_trainer_model(splat_trainer trainer, splat_model* model);

/* B = opt.batch_size objects with V = data.input_images input and T = opt.imgs_per_obj target images;
 * poses are relative to the object's first input image. */
typedef struct splat_trainer_batch {
    uint32_t struct_size;
    uint32_t reserved;           /* 0 */
    const float* images;         /* [B*V,channels,R,R] */
    const float* view_to_world;  /* [B*V,4,4] row vectors */
    const float* quaternions;    /* [B*V,4] w x y z */
    const float* focals;         /* [B*V,2] pixels; NULL unless data.fov is 0 */
    const float* embedding;      /* [B*V,length] of a custom embedding, else NULL */
    const float* tokens;         /* [B*V,token_dim,tokens], else NULL */
    const float* targets;        /* [B*T,3,R,R] */
    const splat_camera* cameras; /* B*T, of R x R pixels */
    uint32_t channels; /* of each input image, checked against the configuration; 0: not checked */
    uint32_t objects;  /* B, checked against the configuration; 0: not checked */
} splat_trainer_batch;

typedef struct splat_trainer_info {
    uint32_t struct_size;
    uint32_t skipped; /* 1: loss or gradients were not finite, and nothing was updated */
    uint64_t step;    /* updates done */
    uint64_t pairs;   /* (tile, Gaussian) drawn */
    double loss;      /* mean over the batch, like the following */
    double squared_error;
    double pixel_loss;
    double ssim; /* 0 unless opt.lambda_ssim > 0 */
    double network_ms;
    double render_ms;
    double update_ms;
    double lpips; /* 0 unless opt.lambda_lpips > 0, and before opt.start_lpips_after */
} splat_trainer_info;

/* Do one update. Arrays are read before the call returns.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH and
 *   SPLAT_ERROR_INVALID_ARGUMENT as splat_model_forward, SPLAT_ERROR_OUT_OF_HOST_MEMORY,
 *   SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST; on error there is no update */
SPLAT_API splat_result splat_trainer_step(splat_trainer trainer, const splat_trainer_batch* batch,
                                          splat_trainer_info* info);

/* JSON: {"step", "attempts" (calls that ran, including skipped ones), "parameters", "trainable", "config"}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE */
SPLAT_API splat_result splat_trainer_report(splat_trainer trainer, char* buffer, size_t capacity,
                                            size_t* needed);

/* Store the averaged weights (opt.ema) as a state dict, or the current ones if there are none. */
SPLAT_API splat_result splat_trainer_store(splat_trainer trainer, splat_weights* weights);

/* Save everything that the next step depends on in a .safetensors file, whole or not at all; and resume
 * from it, bit-exactly. Returns SPLAT_OK, or for resume
 *   SPLAT_ERROR_INVALID_ARGUMENT      no such file, damaged (it has a checksum), of another network or
 *                                     optimiser; the trainer is unchanged */
SPLAT_API splat_result splat_trainer_save(splat_trainer trainer, const char* path);
SPLAT_API splat_result splat_trainer_resume(splat_trainer trainer, const char* path);

/* Destroy a trainer. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_trainer_destroy(splat_trainer trainer);

typedef struct splat_image_scores {
    uint32_t struct_size;
    uint32_t reserved;
    double squared_error; /* mean */
    double psnr;          /* dB, for values from 0 to 1; infinite for equal images */
    double ssim;
} splat_image_scores;

/* Compare two images [channels,height,width] in double precision: PSNR, and SSIM with a Gaussian window
 * of 11 x 11 pixels (standard deviation 1.5) on zero-padded images (Wang et al. 2004).
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_ARGUMENT (NULL, numbers that are not finite),
 *   SPLAT_ERROR_SHAPE_MISMATCH (a size of 0) */
SPLAT_API splat_result splat_image_compare(const float* a, const float* b, uint32_t channels,
                                           uint32_t height, uint32_t width,
                                           splat_image_scores* scores);

/* Learned perceptual image patch similarity, version 0.1 with VGG16 (Zhang et al. 2018): its network with
 * weights on a device, for images of one size. The caller synchronises calls on one object. */
typedef struct splat_lpips_s* splat_lpips;

typedef struct splat_lpips_desc {
    uint32_t struct_size;
    uint32_t flags; /* 0 */
    const void* next;
    const splat_weights*
        weights; /* of torchvision's vgg16 and of the lpips package, one file or two; read
                                     before the call returns */
    uint32_t weight_count;
    uint32_t side; /* pixels, both ways; >= 16 */
} splat_lpips_desc;

/* Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (desc; a tensor missing from
 *   all files), SPLAT_ERROR_SHAPE_MISMATCH (a tensor of another network), SPLAT_ERROR_UNSUPPORTED (a side above
 *   16384), SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_lpips_create(splat_device device, const splat_lpips_desc* desc,
                                          splat_lpips* lpips);

/* Measure the distance of two RGB images [3,side,side] with values nominally 0 to 1, not clamped; equal
 * images have 0. Within 1e-4 of PyTorch's.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL, numbers that are not
 *   finite), SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_lpips_compare(splat_lpips lpips, const float* a, const float* b,
                                           double* value);

/* Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_lpips_destroy(splat_lpips lpips);

/* ---- Data ------------------------------------------------------------------------------------ */

/* Objects seen by several cameras, stored in a folder and read into host memory; needs no device. */
typedef struct splat_dataset_s* splat_dataset;

enum {
    SPLAT_DATA_DEPTH = 1u << 0, /* maps that are required */
    SPLAT_DATA_NORMAL = 1u << 1,
    SPLAT_DATA_MASK = 1u << 2,
    SPLAT_DATA_LENIENT = 1u << 3 /* keep objects with missing files, for splat_dataset_check */
};

typedef struct splat_dataset_desc {
    uint32_t struct_size;
    uint32_t flags; /* SPLAT_DATA_* */
    const void* next;
    const char* path;
    const char*
        format;        /* "srn", "co3d", "nmr", "objaverse", "gso", "images"; NULL: by the folder */
    const char* split; /* "train", "val", "test"; NULL: train */
    uint32_t resolution;  /* of the returned images, which are square; 0: as stored */
    uint32_t limit;       /* use only this many objects, the first in order; 0: all */
    uint64_t cache_bytes; /* for decoded images (8 bits); 0: 1 GiB */
    float background[3];  /* behind transparent pixels, 0 to 1 */
    uint32_t reserved;
} splat_dataset_desc;

/* Open the data set in a folder. Views of an object and images in it are ordered by name.
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a folder of no known format, a missing split or missing
 *                                     maps, images without poses, an object with one view */
SPLAT_API splat_result splat_dataset_open(const splat_dataset_desc* desc, splat_dataset* dataset);

/* JSON: {"format", "split", "objects", "views" (of all objects), "resolution", "stored_resolution",
 * "maps": ["depth", ...], "names": [], "views_of": []}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE */
SPLAT_API splat_result splat_dataset_report(splat_dataset dataset, char* buffer, size_t capacity,
                                            size_t* needed);

/* Destinations of n views of R x R pixels; NULL: not read. */
typedef struct splat_dataset_views {
    uint32_t struct_size;
    uint32_t reserved;
    float* images;  /* [n,3,R,R] 0 to 1 */
    float* depths;  /* [n,1,R,R] 0 to 1, larger is nearer; scaled for each image */
    float* normals; /* [n,3,R,R] 0 to 1: (normal + 1) / 2, in the camera's axes */
    float* masks;   /* [n,1,R,R] 0 to 1 */
    float*
        view_to_world; /* [n,16] row vectors, OpenCV axes; the world is the frame of the first view */
    float* quaternions;      /* [n,4] w x y z of that rotation, w >= 0 */
    float* focals;           /* [n,2] pixels at R */
    float* origin_distances; /* [n] of the origin along the absolute camera's axis (CO3D); else 0 */
} splat_dataset_views;

/* Read views of one object, in the given order (a view may occur twice). The camera of the first is
 * exactly the identity. Several threads may read one data set at once.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, no such object or view, missing maps, a damaged file (the
 *                                     message has its path and the fault); arrays may be partly written */
SPLAT_API splat_result splat_dataset_read(splat_dataset dataset, uint32_t object,
                                          const uint32_t* views, uint32_t count,
                                          splat_dataset_views* out);

/* A picture of one object as input of a network: the object is cut out and put in the middle of a square
 * with a plain background, as Splatter Image's demonstration does. */
typedef struct splat_photo_desc {
    uint32_t struct_size;
    uint32_t flags; /* SPLAT_PHOTO_* */
    const void* next;
    const char* image; /* PNG, JPEG (turned as its Exif data says) or WebP */
    const char* depth; /* maps of the same size; NULL: none */
    const char* normal;
    const char*
        mask; /* of the object; NULL: the image's alpha, else pixels that differ from its border */
    uint32_t resolution; /* R, 8 to 2048 */
    float foreground;    /* the object's longer side, as a fraction of the square's; 0: 0.65 */
    float background[3]; /* 0 to 1 */
    uint32_t reserved;
} splat_photo_desc;

enum { SPLAT_PHOTO_WHOLE = 1u << 0 }; /* use the largest centred square instead of the object's */

/* Read a picture into images, depths, normals and masks of `out`, n = 1; depths and normals need their
 * maps. The report is JSON: {"width", "height", "mask" ("mask", "alpha", "border" or "nothing"),
 * "square": [left, top, side]}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE (the report), SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a file that cannot be read, maps of another size, an empty
 *                                     mask; `out` is unchanged */
SPLAT_API splat_result splat_photo_read(const splat_photo_desc* desc, splat_dataset_views* out,
                                        char* buffer, size_t capacity, size_t* needed);

/* Check all files of one object. JSON: {"name", "views", "width", "hash" (of cameras and decoded images),
 * "problems": [sentences on damaged or missing files, poses, sizes], "warnings": [sentences on views that
 * are duplicate or blank]}. Several threads may check one data set at once.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (no such
 *   object) */
SPLAT_API splat_result splat_dataset_check(splat_dataset dataset, uint32_t object, char* buffer,
                                           size_t capacity, size_t* needed);

/* Destroy a data set. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_dataset_destroy(splat_dataset dataset);

/* Procedural objects with exact maps, in the layout of SRN's data. Cameras at distance 1.3 look at the
 * origin; objects lie within 0.5 of it; the focal length is 131.25 pixels of 128. */
typedef struct splat_synthetic_desc {
    uint32_t struct_size;
    uint32_t flags; /* 0 */
    const void* next;
    const char* path;
    const char* category; /* "cars", "chairs", "mixed"; NULL: cars */
    uint64_t seed;
    uint32_t resolution;  /* 8 to 2048; 0: 128 */
    uint32_t train_views; /* from random places around the object; 0: 50 */
    uint32_t test_views;  /* of val and test, on a spiral; 0: 251 */
    uint32_t train_objects, val_objects, test_objects;
} splat_synthetic_desc;

/* Write one object, counted over all splits, train first. Its folder appears whole or not at all; an
 * existing one is left alone. The bytes depend only on the seed, the split and the number within it.
 * Several threads may write different objects at once.
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_UNSUPPORTED (resolution above 2048), or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, no such object or category, a file that cannot be written, a
 *                                     folder with data made from other values */
SPLAT_API splat_result splat_synthetic_write(const splat_synthetic_desc* desc, uint32_t index);

/* ---- Image files ----------------------------------------------------------------------------- */

/* Write an image by the extension of the path: .png (8 bits, 255 v rounded and clamped) or .npy
 * (float32 [height,width,channels], unchanged). The file appears whole or not at all.
 * values    height * width * channels floats, rows from the top
 * channels  1 to 4: gray, gray and alpha, RGB, RGB and alpha
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a side outside 1 to 16384, channels, or the file cannot
 *                                     be written
 *   SPLAT_ERROR_UNSUPPORTED           another extension */
SPLAT_API splat_result splat_image_save(const char* path, const float* values, uint32_t width,
                                        uint32_t height, uint32_t channels);

/* Write `frames` images, consecutive in `values`, as an animation that repeats for ever, by the
 * extension of the path: .png (animated PNG) or .gif (252 colours, dithered; no alpha).
 * milliseconds  for each frame; 1 to 65535; in a .gif rounded to 10 ms, >= 20
 * Returns as splat_image_save; SPLAT_ERROR_UNSUPPORTED also for 2 or 4 channels in a .gif. */
SPLAT_API splat_result splat_image_save_animation(const char* path, const float* values,
                                                  uint32_t frames, uint32_t width, uint32_t height,
                                                  uint32_t channels, uint32_t milliseconds);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_H */
