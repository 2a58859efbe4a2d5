/* libsplat: results, logging, devices and tensors.
 *
 * Conventions of all headers
 *   Results     every function that can fail returns splat_result: 0 is success, negative is an
 *               error, positive is success with a remark. On an error the outputs are untouched and
 *               splat_last_error_message() says what failed and where, what was expected, what was
 *               got, and what to do.
 *   Handles     opaque and typed. A destroyed handle, or one of another kind, is refused with
 *               SPLAT_ERROR_INVALID_HANDLE and never followed. Destroying NULL is a no-op. Children
 *               keep their parents alive, so any order of destruction is legal.
 *   Structs     *_desc, *_info, *_input and all others with a struct_size, which the caller sets to
 *               sizeof, only ever grow at the end. Zero in any other field means its default, so a
 *               zeroed struct with its size is valid. Of a struct that the library reads, it takes
 *               the members that both versions know; a member that only the caller's version knows
 *               must be zero, else the call is SPLAT_ERROR_UNSUPPORTED, and `reserved` must be zero,
 *               else it is SPLAT_ERROR_INVALID_ARGUMENT. Of a struct that it fills,
 *               it fills those members and leaves the rest as it was, so zero it before. A struct
 *               without struct_size is frozen; arrays hold only such structs.
 *   Arrays      the length stands beside the pointer and is checked. Sets may be empty; the pointer of
 *               0 elements may be NULL. Where a comment says "0: trusted", the call knows the length
 *               from elsewhere, and 0 leaves it unchecked. An input that is NULL has the length 0.
 *   Text        NUL-terminated UTF-8. Functions that write text take (buffer, capacity, needed):
 *               needed receives the size in bytes of the whole text with its NUL; with a smaller
 *               capacity the text is cut and the result is SPLAT_INCOMPLETE.
 *   Threads     each kind of object says whether its calls may run at once. Calls on one device are
 *               serialised by the library. But any thread may call *_destroy, *_get_info, *_report,
 *               splat_evaluator_summary, splat_training_last_step and splat_device_get_memory beside
 *               any other call, and they never wait for one (splat_scene_get_info waits for changes of
 *               its scene): they tell what the last one left; memory of what is destroyed beside a call
 *               is freed at its end.
 *               The library compiles shaders on up to four threads of its own, which never call the
 *               caller's code. Another tells on standard error of a driver that has not returned for a
 *               minute.
 *   Fork        in a forked child, objects of a device that the parent opened are refused with
 *               SPLAT_ERROR_INVALID_STATE, and destroying them frees nothing of the device. Scenes,
 *               weights and data sets work. The child may open a device of its own if no process
 *               that it comes from had opened, counted or described one; else that is refused in the
 *               same way, because drivers have threads, which a child lacks: start children with
 *               spawn, or fork first.
 *   Exit        what is alive when the process ends needs no destroying. But exit() unloads the
 *               driver, so a call that still runs on a device then, on another thread, is undefined:
 *               cancel it (splat_device_cancel) and let it return first. _exit() may come at any time:
 *               files appear whole or not at all. dlclose() leaves the library loaded while a thread
 *               lives that called it.
 *   Numbers     a call computes in the floating-point mode of a C program's start: nearest, with
 *               subnormal numbers, without traps. The caller's (-ffast-math, fesetround) changes no
 *               result, comes back at the end, and is that of callbacks.
 *   Silence     the library never prints; see splat_log_set_callback.
 *
 * A program that opens the best device:
 *
 *   splat_device device;
 *   if (splat_device_create(NULL, &device) != SPLAT_OK)
 *       fprintf(stderr, "%s\n", splat_last_error_message());
 *
 * Only <stddef.h> and <stdint.h> are needed; the headers compile as C99 and later and as C++11 and
 * later. */
#ifndef SPLAT_CORE_H
#define SPLAT_CORE_H

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
    (((0U + (major)) << 22) | ((0U + (minor)) << 12) | (0U + (patch)))
#define SPLAT_VERSION \
    SPLAT_MAKE_VERSION(SPLAT_VERSION_MAJOR, SPLAT_VERSION_MINOR, SPLAT_VERSION_PATCH)

/* Version of the loaded library, packed as by SPLAT_MAKE_VERSION. */
SPLAT_API uint32_t splat_version(void);

/* The version as text, "major.minor.patch". Lives as long as the library. */
SPLAT_API const char* splat_version_string(void);

/* JSON object: version, compiler, assertions (bool), fault_points (bool), shaders (array of {name,
 * hash, bytes}; the hash is the SHA-256 of the SPIR-V), structs (bytes of each struct of the
 * headers, by its name). Lives as long as the library. */
SPLAT_API const char* splat_build_info(void);

/* ---- Results --------------------------------------------------------------------------------- */

/* The success of a call, or why it failed. */
typedef int32_t splat_result;
enum {
    SPLAT_OK = 0,                      /* success */
    SPLAT_INCOMPLETE = 1,              /* the buffer was too small; what fits was written */
    SPLAT_ERROR_INVALID_ARGUMENT = -1, /* an argument is outside its documented range */
    SPLAT_ERROR_INVALID_HANDLE = -2,   /* NULL, destroyed, or a handle of another kind */
    /* the call does not fit the object's state, e.g. unmap without map */
    SPLAT_ERROR_INVALID_STATE = -3,
    SPLAT_ERROR_SHAPE_MISMATCH = -4, /* tensors whose shapes do not fit together */
    SPLAT_ERROR_UNSUPPORTED = -5,    /* beyond a limit or a feature of this device or build */
    /* no Vulkan loader, no driver, or no device that fits the request */
    SPLAT_ERROR_NO_DEVICE = -6,
    SPLAT_ERROR_OUT_OF_HOST_MEMORY = -7, /* host allocation failed, or no thread is left */
    /* device allocation failed, or the device's memory budget is used up */
    SPLAT_ERROR_OUT_OF_DEVICE_MEMORY = -8,
    SPLAT_ERROR_TIMEOUT = -9, /* the device did not finish in time; it may still be working */
    /* sticky: every later call on the device returns it; destroy it and create it again */
    SPLAT_ERROR_DEVICE_LOST = -10,
    /* a defect in the library or the driver; please report the message */
    SPLAT_ERROR_INTERNAL = -11,
    SPLAT_ERROR_NOT_FOUND = -12, /* no such file or folder, or no entry of that name */
    SPLAT_ERROR_IO = -13,        /* the system refused to read or write: permission, disk full */
    SPLAT_ERROR_FORMAT = -14,    /* damaged or truncated bytes, or bytes of another format */
    SPLAT_CANCELLED = -15        /* the call was cancelled; its results are undefined */
};

/* Name of a result code, e.g. "SPLAT_ERROR_TIMEOUT"; "SPLAT_UNKNOWN_RESULT" for any other number.
 * Never NULL. */
SPLAT_API const char* splat_result_name(splat_result code);

/* One sentence: what a result code means and what to do. Never NULL. */
SPLAT_API const char* splat_result_sentence(splat_result code);

/* Text of the last error on the calling thread. Empty before the first error. A success does not
 * clear it, so check the result first. Valid until the next call of this library on this thread.
 * Never NULL. */
SPLAT_API const char* splat_last_error_message(void);

/* Copy the text of the last error.
 * buffer    out, capacity bytes, may be NULL when capacity is 0
 * needed    out, bytes with the NUL, may be NULL
 * Returns SPLAT_OK or SPLAT_INCOMPLETE. Never changes the text. */
SPLAT_API splat_result splat_last_error_copy(char* buffer, size_t capacity, size_t* needed);

/* ---- Log ------------------------------------------------------------------------------------- */

/* How grave a message of the log is. */
typedef int32_t splat_log_level;
enum {
    SPLAT_LOG_DEBUG = 1,   /* every step, for those who look for a defect */
    SPLAT_LOG_INFO = 2,    /* what was done */
    SPLAT_LOG_WARNING = 3, /* what works, but not as asked or expected */
    SPLAT_LOG_ERROR = 4    /* why a call failed */
};

/* Called on the thread that caused the message, at the end of the call that caused it, with no lock
 * of the library held. It may call the library; messages that it causes itself are dropped, and the
 * last error of the interrupted call stays. It must not throw. */
typedef void (*splat_log_callback)(void* user, splat_log_level level, const char* message);

/* Send messages of `min_level` and above to `callback`, for the whole process. Without a callback
 * the library is silent.
 * callback  may be NULL: silence
 * user      passed back. When this function returns, no other thread runs the callback before, so
 *           its `user` may be freed. It waits for those that run; from inside a callback it does
 *           not. Call it without holding a lock that the callback before takes
 * min_level 0 = SPLAT_LOG_WARNING
 * Returns SPLAT_OK, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      not a valid level; nothing is changed */
SPLAT_API splat_result splat_log_set_callback(splat_log_callback callback, void* user,
                                              splat_log_level min_level);

/* ---- Limits of decoding ---------------------------------------------------------------------- */

/* What a file may cost when it is read, by this process and whatever reads it: a small file can ask
 * for all memory or for hours. Sizes are compared with these limits before memory is allocated. The
 * limits leave out what libwebp takes besides: up to 5 bytes a pixel, and up to 1.4 GB for the tables
 * of prefix codes. */
typedef struct splat_decode_limits {
    uint32_t struct_size;
    uint32_t flags;            /* 0 */
    const void* next;          /* NULL */
    uint64_t bytes_times_file; /* bytes of memory for each byte of the file; 0 = 64 */
    uint64_t bytes_besides;    /* bytes on top of that; 0 = 64 MiB */
    uint64_t items;            /* tensors or files of an archive; 0 = 10^6 */
    uint32_t jpeg_scans;       /* scans of one JPEG image; 0 = 100 */
    uint32_t reserved;
} splat_decode_limits;

/* Replace the limits of this process. Calls that read a file then take the new ones; a file beyond
 * them is SPLAT_ERROR_FORMAT. Thread-safe.
 * limits    NULL: the defaults
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_ARGUMENT: a field of limits; nothing is changed. */
SPLAT_API splat_result splat_decode_set_limits(const splat_decode_limits* limits);

/* ---- Handles --------------------------------------------------------------------------------- */

/* The kinds of objects; the section of each says what it is and which calls may run at once. */
typedef struct splat_device_s* splat_device;
typedef struct splat_tensor_s* splat_tensor;
typedef struct splat_op_s* splat_op;
typedef struct splat_scene_s* splat_scene;
typedef struct splat_rasterizer_s* splat_rasterizer;
typedef struct splat_raster_state_s* splat_raster_state;
typedef struct splat_weights_s* splat_weights;
typedef struct splat_model_s* splat_model;
typedef struct splat_module_s* splat_module;
typedef struct splat_predictor_s* splat_predictor;
typedef struct splat_dataset_s* splat_dataset;
typedef struct splat_trainer_s* splat_trainer;
typedef struct splat_optimizer_s* splat_optimizer;
typedef struct splat_batches_s* splat_batches;
typedef struct splat_run_s* splat_run;
typedef struct splat_lpips_s* splat_lpips;
typedef struct splat_evaluator_s* splat_evaluator;
typedef struct splat_comparison_s* splat_comparison;
typedef struct splat_prior_model_s* splat_prior_model;
typedef struct splat_mesh_s* splat_mesh;

/* ---- Images in memory ------------------------------------------------------------------------ */

/* The type of a pixel's numbers. */
typedef int32_t splat_pixel;
enum {
    SPLAT_PIXEL_U8 = 1,  /* 0 to 255 stand for 0 to 1 */
    SPLAT_PIXEL_F16 = 2, /* IEEE 754 binary16 */
    SPLAT_PIXEL_F32 = 3  /* IEEE 754 binary32 */
};

/* The caller's pixels, in any layout that strides describe. Frozen. Functions that take a picture
 * read `pixels`, those that give one write there, and no others touch it. */
typedef struct splat_image {
    void* pixels;
    size_t bytes; /* size of `pixels`, checked against the layout; 0: trusted */
    splat_pixel type;
    uint32_t width; /* pixels */
    uint32_t height;
    uint32_t channels; /* 1 to 4: gray, gray and alpha, RGB, RGB and alpha */
    /* Bytes from one row, pixel and channel to the next. All 0: packed rows of interleaved
     * channels; only row_stride: such rows that far apart. Planes [channels,height,width] of
     * float32 are {4 width, 4, 4 width height}. Pictures that are read may repeat samples (a stride
     * of 0). Negative strides need bytes = 0 */
    int64_t row_stride;
    int64_t pixel_stride;
    int64_t channel_stride;
} splat_image;

/* ---- Device ---------------------------------------------------------------------------------- */

/* An open Vulkan device. Thread-safe: calls that use it run one after the other. */

/* What a device is. */
typedef int32_t splat_device_kind;
enum {
    SPLAT_DEVICE_KIND_OTHER = 1,      /* none of the following */
    SPLAT_DEVICE_KIND_CPU = 2,        /* software on the processor, such as lavapipe */
    SPLAT_DEVICE_KIND_VIRTUAL = 3,    /* a GPU of a virtual machine */
    SPLAT_DEVICE_KIND_INTEGRATED = 4, /* a GPU that shares the processor's memory */
    SPLAT_DEVICE_KIND_DISCRETE = 5    /* a GPU with memory of its own */
};

/* Which shaders a device runs. The plain ones are the specification; the others compute the same
 * within the operator's stated error and are faster on their kind of device. The environment
 * variable SPLAT_KERNELS=plain|cpu|gpu overrides the choice. */
typedef int32_t splat_kernels;
enum {
    SPLAT_KERNELS_AUTO = 0,  /* what suits the device */
    SPLAT_KERNELS_PLAIN = 1, /* the specification */
    SPLAT_KERNELS_CPU = 2,   /* for software devices on a CPU */
    SPLAT_KERNELS_GPU = 3    /* for GPUs */
};

/* What a device can do. */
enum {
    SPLAT_FEATURE_TIMESTAMPS = 1u << 0,       /* the device can time its work */
    SPLAT_FEATURE_SUBGROUP_SHUFFLE = 1u << 1, /* threads of a subgroup read each other's values */
    SPLAT_FEATURE_SUBGROUP_ARITHMETIC = 1u << 2, /* subgroups have sums and other reductions */
    SPLAT_FEATURE_INT64 = 1u << 3,               /* shaders have integers of 64 bits */
    /* the host reads device memory in place, through its caches: tensors map without a copy */
    SPLAT_FEATURE_UNIFIED_MEMORY = 1u << 4,
    SPLAT_FEATURE_EXTERNAL_MEMORY = 1u << 5 /* tensors can be exported and imported */
};

/* What a device is and can do. */
typedef struct splat_device_info {
    uint32_t struct_size;
    uint32_t index;                     /* position in the enumeration of this process */
    splat_device_kind kind;             /* what the device is */
    uint32_t usable;                    /* 1, or 0 with the reason in `reason` */
    uint32_t vendor_id;                 /* Vulkan's number of the vendor */
    uint32_t device_id;                 /* the vendor's number of the device */
    uint32_t vulkan_version;            /* version of Vulkan, packed as Vulkan does */
    uint32_t driver_version;            /* version of the driver, in the vendor's packing */
    uint8_t uuid[16];                   /* what SPLAT_SELECT_BY_UUID compares */
    uint64_t heap_bytes;                /* device-local memory */
    uint64_t max_allocation_bytes;      /* most bytes of one allocation */
    uint64_t max_storage_buffer_bytes;  /* most bytes of one shader binding, so of one tensor */
    uint32_t max_workgroup_invocations; /* most threads of a workgroup */
    uint32_t shared_memory_bytes;       /* most shared memory of a workgroup */
    uint32_t subgroup_size;             /* threads of a subgroup */
    uint32_t features;                  /* what the device can do, SPLAT_FEATURE_ bits */
    splat_kernels kernels;              /* what SPLAT_KERNELS_AUTO means, for networks */
    uint32_t reserved;
    char name[256];   /* name of the device, in the driver's words */
    char driver[256]; /* name and version, in the driver's words */
    char reason[256]; /* why it is not usable, or another one is the best; else empty */
    /* what sorts and blends where that is not `kernels`, or why kernels failed here; else empty */
    char kernels_note[256];
} splat_device_info;

/* Count the Vulkan devices of this machine, usable or not.
 * count     out
 * Returns SPLAT_OK (count may be 0), or
 *   SPLAT_ERROR_NO_DEVICE      the Vulkan loader is missing or has no driver at all; the message
 *                              says what to install
 *   SPLAT_ERROR_INVALID_STATE  forked, see above */
SPLAT_API splat_result splat_device_count(uint32_t* count);

/* Describe device `index` without creating it.
 * info      in/out, struct_size set
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_ARGUMENT (index >= count), SPLAT_ERROR_NO_DEVICE,
 *   SPLAT_ERROR_INVALID_STATE (forked). */
SPLAT_API splat_result splat_device_describe(uint32_t index, splat_device_info* info);

/* How a device is chosen. */
typedef int32_t splat_device_select;
enum {
    /* discrete, then integrated, virtual, CPU; lowest index within a kind. Of GPUs, drivers that passed
     * no conformance test come after all others, a second driver of a GPU last; the next device is
     * tried where one cannot be opened */
    SPLAT_SELECT_BEST = 0,
    SPLAT_SELECT_BY_INDEX = 1, /* field `index` */
    SPLAT_SELECT_BY_UUID = 2,  /* field `uuid` */
    SPLAT_SELECT_BY_KIND = 3   /* field `kind`; lowest index */
};

/* Options of a device. */
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
    /* longest wait for one piece of work, see max_submit_ns; 0 = 60 s, times SPLAT_TIMEOUT_SCALE */
    uint64_t timeout_ns;
    /* pipeline cache; NULL = libsplat/ in the user's cache folder, "" = none */
    const char* cache_folder;
    /* The device gets work in pieces that take no longer, by the times of those before, so that a
     * desktop stays usable and no watchdog ends them. 0 = 0.1 s, on CPU devices 0.25 s; at least
     * 1 ms. SPLAT_MAX_SUBMIT_MS in the environment overrides it */
    uint64_t max_submit_ns;
} splat_device_desc;

/* Open a device.
 * desc      may be NULL for defaults
 * device    out, owned by the caller
 * Returns SPLAT_OK, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      struct_size, flags, next, an enum, or SPLAT_KERNELS or
 *                                     SPLAT_MAX_SUBMIT_MS in the environment
 *   SPLAT_ERROR_NO_DEVICE             no loader, no driver, or no device that fits `select`; the
 *                                     message lists the devices
 *   SPLAT_ERROR_UNSUPPORTED           the device lacks a feature, which the message names, or the
 *                                     validation layer is missing
 *   SPLAT_ERROR_INVALID_STATE         forked, see above
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_DEVICE_LOST
 *
 * The first operator, network or rasterizer on a device tests the kernels that it needs. Where they
 * compute wrongly, do not compile, lose the device or do not end, plain ones take their place, with a
 * warning; where those compute wrongly too, or objects with these kernels are there already, the
 * creation is SPLAT_ERROR_NO_DEVICE (SPLAT_ERROR_DEVICE_LOST or SPLAT_ERROR_TIMEOUT of a device that
 * has other objects). What failed is remembered in the cache folder.
 * SPLAT_SELF_TEST=0 in the environment leaves the tests out. */
SPLAT_API splat_result splat_device_create(const splat_device_desc* desc, splat_device* device);

/* Release a device. Its tensors and operators stay usable; the device closes with the last of them.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_device_destroy(splat_device device);

/* Cancel the calls that run on a device or wait for it now, on any threads. What they were to write
 * is undefined, as after an error of the device. The objects stay usable, and later calls are not
 * affected. A training step that already updates the weights ends as usual; one that is cancelled
 * leaves them as they were.
 * The device gets work in pieces, the next while one runs (splat_device_desc.max_submit_ns); a call
 * returns SPLAT_CANCELLED when those that it has end. It goes on
 * while it reads a file, compiles a shader or computes on the host.
 * May be called from any thread and from a signal handler, except for handles that are not live.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_STATE (forked). */
SPLAT_API splat_result splat_device_cancel(splat_device device);

/* Describe an open device. `kernels` is what it runs, not what AUTO would choose.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT. */
SPLAT_API splat_result splat_device_get_info(splat_device device, splat_device_info* info);

/* Memory of a device, bytes. */
typedef struct splat_memory_info {
    uint32_t struct_size;
    uint32_t allocations;  /* live allocations of the driver */
    uint64_t used_bytes;   /* allocated from the driver now */
    uint64_t live_bytes;   /* part of used_bytes that tensors and operators use */
    uint64_t peak_bytes;   /* highest used_bytes since creation */
    uint64_t budget_bytes; /* most that the device object may use */
} splat_memory_info;

/* Report device memory.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT. */
SPLAT_API splat_result splat_device_get_memory(splat_device device, splat_memory_info* info);

/* Report the time of every kind of dispatch since creation or the last reset, on a device with
 * SPLAT_DEVICE_PROFILE. JSON: {"device": name, "ops": [{"op", "kernel", "count", "total_ms",
 * "min_ms", "median_ms", "bytes", "flops"}], "idle": {"count", "total_ms"}, "lists": {"count",
 * "submits", "dispatches", "copies", "barriers", "compute_barriers", "transfer_barriers",
 * "host_barriers", "levels", "bytes", "device_ms", "longest_submit_ms"},
 * "transfers": {"reads", "read_bytes", "writes", "written_bytes"}}. "bytes" and "flops" of an
 * operator are means over its dispatches, as it counts them. "idle" is the time between what is
 * timed in one list. "lists" is what all lists together held and took, and their longest piece, on
 * the host's clock; a level is what lies between two barriers. "transfers" is what was copied
 * between host memory and the device. On GPUs, dispatches of one level may overlap: they are timed
 * together, and each gets a share by its estimated time.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_STATE  the device was created without SPLAT_DEVICE_PROFILE */
SPLAT_API splat_result splat_device_profile_json(splat_device device, char* buffer, size_t capacity,
                                                 size_t* needed);

/* Write the same as a table for people: longest total time first, with rates over that time.
 * Returns as splat_device_profile_json. */
SPLAT_API splat_result splat_device_profile_table(splat_device device, char* buffer,
                                                  size_t capacity, size_t* needed);

/* Forget the times measured so far.
 * Returns as splat_device_profile_json. */
SPLAT_API splat_result splat_device_profile_reset(splat_device device);

/* ---- Tensor ---------------------------------------------------------------------------------- */

/* An array of numbers on a device. Thread-safe. */

#define SPLAT_MAX_RANK 8

/* The type of a tensor's elements. */
typedef int32_t splat_dtype;
enum {
    SPLAT_DTYPE_F32 = 1, /* float32 */
    SPLAT_DTYPE_I32 = 2, /* signed integers of 32 bits */
    SPLAT_DTYPE_U32 = 3  /* unsigned integers of 32 bits */
};

/* Options of a tensor. */
enum {
    SPLAT_TENSOR_EXPORTABLE = 1u << 0 /* in an allocation of its own, for splat_tensor_export */
};

typedef struct splat_tensor_desc {
    uint32_t struct_size;
    uint32_t flags;               /* SPLAT_TENSOR_ bits */
    const void* next;             /* NULL */
    const char* name;             /* used in messages; may be NULL */
    splat_dtype dtype;            /* 0 = SPLAT_DTYPE_F32 */
    uint32_t rank;                /* 0 (a scalar) to SPLAT_MAX_RANK */
    int64_t dims[SPLAT_MAX_RANK]; /* elements, outermost first; each >= 1 */
} splat_tensor_desc;

/* Create a tensor on the device, row-major and contiguous, filled with zeros.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      rank, dtype, a dimension < 1, or 2^31 elements or more
 *   SPLAT_ERROR_UNSUPPORTED           more bytes than max_storage_buffer_bytes of the device, or
 *                                     flags without SPLAT_FEATURE_EXTERNAL_MEMORY
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

/* Copy the tensor into host memory; `data` is untouched on error. Strides are as above, but > 0,
 * and no two elements may share a place.
 * Returns what splat_tensor_write returns. */
SPLAT_API splat_result splat_tensor_read(splat_tensor tensor, void* data, size_t bytes,
                                         const int64_t* strides);

/* What is done with the elements of a tensor while it is mapped. */
typedef int32_t splat_access;
enum {
    SPLAT_ACCESS_READ = 1,      /* only read */
    SPLAT_ACCESS_WRITE = 2,     /* only written: the old elements are lost */
    SPLAT_ACCESS_READ_WRITE = 3 /* read and written */
};

/* Give the host a pointer to the tensor's elements, row-major contiguous, until splat_tensor_unmap.
 * Makes no copy if the device has SPLAT_FEATURE_UNIFIED_MEMORY, unless such memory was full. With
 * SPLAT_ACCESS_WRITE the contents are undefined until written. While a tensor is mapped no other call may use it,
 * nor a tensor of the same memory (splat_model_tensor).
 * pointer   out, owned by the library
 * bytes     out, may be NULL
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (access),
 *   SPLAT_ERROR_INVALID_STATE (mapped already, or a tensor of the same memory is),
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_tensor_map(splat_tensor tensor, splat_access access, void** pointer,
                                        size_t* bytes);

/* End a mapping. With write access the written values become the tensor's contents.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_STATE (not mapped), and the
 * device's errors. */
SPLAT_API splat_result splat_tensor_unmap(splat_tensor tensor);

/* Give the host a pointer to the tensor's elements, row-major contiguous, that is good until the
 * tensor is destroyed: no copy, no map and unmap. No call that uses the tensor may run on another
 * thread while the host reads or writes there; nothing has to be flushed, because every call has
 * ended on the device when it returns (not after SPLAT_ERROR_TIMEOUT).
 * pointer   out, owned by the library
 * bytes     out, may be NULL
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT, or
 *   SPLAT_ERROR_INVALID_STATE         the tensor is mapped
 *   SPLAT_ERROR_UNSUPPORTED           the device's memory is not unified, or not coherent: see
 *                                     SPLAT_FEATURE_UNIFIED_MEMORY; use splat_tensor_map */
SPLAT_API splat_result splat_tensor_host_pointer(splat_tensor tensor, void** pointer,
                                                 size_t* bytes);

/* A DLPack tensor, version 1.x of its ABI; the header of DLPack defines the struct. */
struct DLManagedTensorVersioned;

/* Share the tensor's memory with other libraries, as a DLPack tensor on kDLCPU without a copy. It
 * has its own reference: the memory lives until its deleter is called, even if the tensor is
 * destroyed. The deleter may be called from any thread, never waits for a call on the device, and
 * must be called once. When the host may read and write: see splat_tensor_host_pointer.
 * managed   out, owned by the caller, who calls managed->deleter(managed)
 * Returns as splat_tensor_host_pointer, or SPLAT_ERROR_OUT_OF_HOST_MEMORY. */
SPLAT_API splat_result splat_tensor_to_dlpack(splat_tensor tensor,
                                              struct DLManagedTensorVersioned** managed);

/* What a tensor is. */
typedef struct splat_tensor_info {
    uint32_t struct_size;
    splat_dtype dtype;            /* type of the elements */
    uint32_t rank;                /* number of dimensions, 0 to SPLAT_MAX_RANK */
    uint32_t mapped;              /* 1 while mapped */
    int64_t dims[SPLAT_MAX_RANK]; /* elements, outermost first */
    uint64_t elements;            /* number of all elements */
    uint64_t bytes;               /* size of all elements */
    char name[64];                /* name in messages, cut if longer */
} splat_tensor_info;

/* Describe a tensor.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT. */
SPLAT_API splat_result splat_tensor_get_info(splat_tensor tensor, splat_tensor_info* info);

/* What the elements of a tensor are. */
typedef struct splat_tensor_stats {
    uint32_t struct_size;
    uint32_t reserved;
    uint64_t nan_count; /* elements that are NaN */
    uint64_t inf_count; /* elements that are infinite */
    double min;         /* smallest finite element; +inf if there are none */
    double max;         /* largest finite element; -inf if there are none */
    double mean;        /* mean of the finite elements; 0 if there are none */
} splat_tensor_stats;

/* Measure an SPLAT_DTYPE_F32 tensor on the device.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (struct or dtype),
 * SPLAT_ERROR_INVALID_STATE (mapped), and the device's errors. */
SPLAT_API splat_result splat_tensor_check(splat_tensor tensor, splat_tensor_stats* stats);

/* Destroy a tensor, mapped or not.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_tensor_destroy(splat_tensor tensor);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_CORE_H */
