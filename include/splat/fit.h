/* libsplat: fitting a scene to photographs.
 *
 * A minute on posed photographs, such as a COLMAP project, and the scene:
 *
 *   splat_fit_desc desc = {sizeof desc, .folder = "run", .data = "photos"};
 *   splat_fit_open(device, &desc, &run);
 *   splat_run_event event = {.struct_size = sizeof event};
 *   while (event.kind < SPLAT_EVENT_DONE && splat_run_next(run, &event) == SPLAT_OK)
 *       if (event.text) puts(event.text);
 *   splat_fit_scene(run, &scene);
 *   splat_scene_save(scene, "scene.ply", NULL); */
#ifndef SPLAT_FIT_H
#define SPLAT_FIT_H

#include "run.h"
#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Fit ------------------------------------------------------------------------------------- */

/* Gaussians that are fitted to posed photographs, as a run, see run.h. Kerbl et al. 2023, doi:10.1145/3592433.
 *
 * Numbers of its events: of a step "loss" (at the size of the drawn views, so that it rises where they become
 * larger), "fraction" (share of the fit's time until it), "psnr" (dB, of the step's
 * photographs), "gaussians", "pairs", "raster_ms", "loss_ms", "update_ms", "grow_ms", "l1" and "ssim". Of a held-out
 * photograph, and as means over them: "val_psnr" (dB) and "val_ssim", over the pixels that the lens and the mask
 * leave, the drawn image cut to 0 to 1; of a validation also "val_views" and "gaussians". A run has its scene as
 * gaussians_last.safetensors and gaussians_best.safetensors: means, log_scales, rotations, opacity_logits and sh.
 *
 * With SPLAT_FIT_REFINE_POSES a run also has transforms.json, written with each state: the cameras of all photographs,
 * those of fitted ones corrected, in the frame of the photographs and for pictures of the fit's size. What all
 * corrections have in common (a turn, a move, a scale) is taken away, so that photographs that are held out still fit
 * the scene; they are drawn from the cameras they have, without an exposure. With SPLAT_FIT_REFINE_EXPOSURE the mean
 * of the exposures, nine gains and three offsets each, is that of an unchanged picture. */

/* What a fit is to do. */
enum {
    /* go on from the latest state that can be read; begin again if none was saved yet */
    SPLAT_FIT_RESUME = 1u << 0,
    SPLAT_FIT_OVERWRITE = 1u << 1, /* replace the run in the folder; other files in it stay */
    SPLAT_FIT_ALL_PHOTOS =
        1u << 2, /* fit all photographs: none is held out, so there are no scores */
    SPLAT_FIT_WHITE_BACKGROUND =
        1u << 3, /* transparent pictures lie on white; else only opaque pixels count */
    SPLAT_FIT_REFINE_POSES = 1u << 4,   /* correct the cameras of the fitted photographs, too */
    SPLAT_FIT_REFINE_EXPOSURE = 1u << 5 /* gains and offsets of their colours */
};

/* Which file of cameras a fit reads. */
typedef int32_t splat_fit_cameras;
enum {
    SPLAT_FIT_CAMERAS_AUTO = 0,      /* a COLMAP model where there is one, else transforms.json */
    SPLAT_FIT_CAMERAS_COLMAP = 1,    /* a COLMAP model */
    SPLAT_FIT_CAMERAS_TRANSFORMS = 2 /* transforms.json, else transforms_train.json and its like */
};

/* What to fit, and how long. */
typedef struct splat_fit_desc {
    uint32_t struct_size;
    uint32_t flags; /* SPLAT_FIT_ bits */
    const void* next;
    const char* folder;        /* folder of the run */
    const char* data;          /* folder of photographs and cameras; NULL with SPLAT_FIT_RESUME: the run's */
    const char* masks;         /* folder of masks, named like the photographs, 0 leaves out; NULL: none */
    uint64_t steps;            /* 1 to 10,000,000; 0: as many as `seconds` take */
    double seconds;            /* about how long to optimise on this device; 0: 60. Either this or `steps` */
    uint64_t seed;             /* 0 to 2^53 */
    uint32_t max_gaussians;    /* 2 or more; 0: by the length of the fit */
    uint32_t sh_bands;         /* bands of spherical harmonics, degree + 1: 1 to 4; 0: 4 */
    uint32_t downscale;        /* sides of the photographs are divided by it, 1 to 64; 0: 1 */
    uint32_t test_every;       /* each so many photographs by name, with the first, are held out; 0: 8 */
    splat_fit_cameras cameras; /* which file of cameras to read */
    uint32_t reserved;         /* 0 */
    const char* depth;         /* folder of depth maps, named like the photographs; NULL: none */
    const char* normals;       /* folder of maps of normals, named like the photographs; NULL: none */
    const char* init;          /* "points" of the data, "depth", "random", or a scene's file; NULL: "points" */
    uint64_t memory_bytes;     /* most device memory; 0: what the device has */
    const char* const* values; /* "NAME=VALUE", more options by the names of a run's config.json */
    uint64_t value_count;
} splat_fit_desc;

/* Open a fit, which splat_run_destroy closes: read the photographs, undo the distortion of their lenses, and without
 * `steps` measure how many take `seconds`; then make the folder, or lock that of the run. Fits of equal photographs,
 * steps, seeds, memory_gaussians and memory_downscale (in config.json; `values` repeat them) have equal bits. Resumed,
 * what is given (not 0 or NULL) must equal the run's, but memory_bytes. The data's own split goes before `test_every`.
 *
 * What it takes of the device is estimated, and told as a message. A new fit that takes more than `memory_bytes`, or
 * than there is, has fewer Gaussians (at least a quarter, 5,000, and those of a scene), then photographs of half the
 * sides, a quarter and so on, and warns. Where memory runs out in a step, the fit warns and goes on without growth,
 * then with one view a step instead of two.
 *
 * splat_run_next of it returns errors of the rasterizer and of the device, and SPLAT_ERROR_INVALID_STATE after the
 * device failed within an update: close the run and resume it.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or, with the folder untouched,
 *   SPLAT_ERROR_INVALID_ARGUMENT      desc; fewer than two photographs to fit; other photographs than the run's
 *   SPLAT_ERROR_INVALID_STATE         a session has the folder open (the message names its process); it holds a run,
 *                                     no run, or something else
 *   SPLAT_ERROR_NOT_FOUND             no cameras, photographs, masks, maps or scene of init; no state to read
 *   SPLAT_ERROR_FORMAT, SPLAT_ERROR_SHAPE_MISMATCH   damaged cameras, photographs, maps, scene; or they do not fit
 *   SPLAT_ERROR_UNSUPPORTED           a lens; a format of photographs; more Gaussians or larger photographs than the
 *                                     device takes
 *   SPLAT_ERROR_IO                    the folder cannot be written; parts may remain
 *   SPLAT_ERROR_OUT_OF_DEVICE_MEMORY  `memory_bytes`, or the memory that there is, are too little for any of this
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY    and errors of the device */
SPLAT_API splat_result splat_fit_open(splat_device device, const splat_fit_desc* desc,
                                      splat_run* run);

/* Copy the Gaussians as they are to a new scene, in the frame and units of the cameras.
 * run       of splat_fit_open
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL; a run of another
 *   task), SPLAT_CANCELLED, SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_fit_scene(splat_run run, splat_scene* scene);

/* Score any scene on the photographs that a fit of `desc` holds out, as that fit scores itself, drawn as the scene's
 * file says (splat_scene_info.drawn_as): a run without a folder. Its events are one SPLAT_EVENT_VALIDATED_PIECE for
 * each photograph, with name, both images and the numbers "val_psnr" (dB) and "val_ssim"; SPLAT_EVENT_VALIDATION with
 * their means, "val_views" and "gaussians"; and SPLAT_EVENT_DONE. The drawn image is cut to 0 to 1, and only the
 * pixels count that the lens and the mask leave; `truths` is 0 elsewhere.
 * desc      data, masks, downscale, test_every, cameras, SPLAT_FIT_WHITE_BACKGROUND and SPLAT_FIT_ALL_PHOTOS, which
 *           scores all photographs; the rest is not read
 * scene     in the frame and units of the cameras
 * border    0 to below 0.5; above 0 there are also "inner_psnr" and "inner_ssim", over the pixels that are at least
 *           this share of width and height away from the edges: 0.1 leaves the central 80 % of both; NaN if none counts
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (desc, border, a scene without Gaussians,
 *   no photograph that is held out), and errors of splat_fit_open about cameras, photographs, masks and the device.
 *   splat_run_next returns SPLAT_ERROR_INVALID_ARGUMENT for a drawn image that is not finite, and errors of the
 *   device */
SPLAT_API splat_result splat_fit_score(splat_device device, const splat_fit_desc* desc,
                                       splat_scene scene, double border, splat_run* run);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_FIT_H */
