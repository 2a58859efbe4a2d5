/* libsplat: the rasterizer, image files, and scores of images.
 *
 * A scene from one camera as a picture with 8 bits, in one call:
 *
 *   splat_image image = {.pixels = bytes, .bytes = sizeof bytes, .type = SPLAT_PIXEL_U8,
 *                        .width = 512, .height = 512, .channels = 3};
 *   splat_scene_render(scene, NULL, &camera, 1, NULL, &image);
 *
 * Its colours as numbers, with a rasterizer for many calls; `count` Gaussians:
 *
 *   splat_rasterizer rasterizer;
 *   splat_rasterizer_desc desc = {sizeof desc, .gaussians = count, .width = 512, .height = 512};
 *   splat_rasterizer_create(device, &desc, &rasterizer);
 *   splat_rasterizer_forward_scene(rasterizer, NULL, scene, &camera, 1, NULL);
 *   splat_rasterizer_read(rasterizer, NULL, SPLAT_OUTPUT_RGB, pixels, sizeof pixels); */
#ifndef SPLAT_RENDER_H
#define SPLAT_RENDER_H

#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Rasterizer ------------------------------------------------------------------------------ */

/* Draws up to N Gaussians into up to V views of up to W x H pixels, and computes gradients. A call's
 * n <= N and v <= V may differ from the last one's; the results are those of a rasterizer made for
 * exactly n and v, to the bit. Calls that keep n and v are faster than calls that change them.
 * Each camera may be smaller than W x H: within its size the results are those of a rasterizer of
 * its size, to the bit; images keep the shape of W x H and are 0 beyond, where gradients of the loss
 * are not read.
 * The caller synchronises calls on one rasterizer and its states; splat_rasterizer_get_info may be
 * called at any time. */

/* Whose rules a rasterizer follows where renderers differ. */
typedef int32_t splat_convention;
enum {
    SPLAT_CONVENTION_3DGS = 1,  /* Kerbl et al. 2023: extents of 3 sigma, quaternions as given */
    SPLAT_CONVENTION_GSPLAT = 2, /* gsplat 1.6: exactly alpha >= 1/255, quaternions normalised */
    /* Yu et al. 2024, Gaussian Opacity Fields, for the weights of F3D-Gaus: opacity at the maximum along a pixel's
     * ray, without a dilation, blended in order of the means' depths; quaternions normalised. Outputs of depth are
     * those of the maxima, which lie beyond the near plane. It has no gradients, no ANTIALIASED and no CONICS */
    SPLAT_CONVENTION_RAY_MAXIMUM = 3
};

/* What a rasterizer can do. */
enum {
    SPLAT_RASTERIZER_DIRECT_COLORS = 1u << 0, /* colours are RGB, not spherical harmonics */
    SPLAT_RASTERIZER_ANTIALIASED = 1u << 1,   /* opacity compensates for the dilation */
    SPLAT_RASTERIZER_DEPTH = 1u << 2,         /* outputs DEPTH, EXPECTED_DEPTH, CONTRIBUTORS */
    SPLAT_RASTERIZER_BACKWARD = 1u << 3,      /* it computes gradients */
    SPLAT_RASTERIZER_GRAD_DEPTH = 1u << 4,    /* gradients from the depth; implies BACKWARD */
    SPLAT_RASTERIZER_GRAD_POSE = 1u
                                 << 5, /* the pose, for SPLAT_CONVENTION_GSPLAT; implies BACKWARD */
    SPLAT_RASTERIZER_GRAD_MEANS2D = 1u << 6, /* gradients of means2d; implies BACKWARD */
    /* SPLAT_CONVENTION_3DGS: the gradient of the original code with its three quirks */
    SPLAT_RASTERIZER_ORIGINAL_GRADIENT = 1u << 7,
    SPLAT_RASTERIZER_NORMALS = 1u << 8,         /* output NORMALS */
    SPLAT_RASTERIZER_GRAD_INTRINSICS = 1u << 9, /* fx, fy, cx, cy; implies GRAD_POSE */
    SPLAT_RASTERIZER_CONTRIBUTIONS = 1u << 10,  /* contributions of a backward call; implies it */
    SPLAT_RASTERIZER_IDS = 1u << 11,            /* output IDS; implies DEPTH */
    /* blend by the distance of a mean to the camera, not by its depth; outputs of depth stay z */
    SPLAT_RASTERIZER_SORT_BY_DISTANCE = 1u << 12,
    SPLAT_RASTERIZER_CUT_3_SIGMA = 1u << 13, /* alpha is 0 beyond 3 sigma of the dilated ellipse */
    /* colours are linear: `background` is sRGB and made linear, splat_rasterizer_read_images converts RGB to
     * sRGB (IEC 61966-2-1); tensors, splat_rasterizer_read and gradients stay linear */
    SPLAT_RASTERIZER_LINEAR_COLORS = 1u << 14,
    SPLAT_RASTERIZER_MEDIAN_DEPTH = 1u << 15 /* output MEDIAN_DEPTH, which has no gradient */
};

/* Work that is skipped because it does not change the image. Gaussians that a convention culls (see
 * splat_output) are always culled. */
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

/* What a rasterizer draws, and how. */
typedef struct splat_rasterizer_desc {
    uint32_t struct_size;
    uint32_t flags;     /* SPLAT_RASTERIZER_ bits */
    const void* next;   /* NULL */
    /* N, most Gaussians of a call; >= 0. A scene of more than the device takes at a time is drawn in bands of
     * the image, with the same pixels: one view a call, without gradients, ids and outputs [V,N,...] */
    uint32_t gaussians;
    /* V, most cameras of a call; 0: any number. The memory is then for one, and a call with more
     * cameras than any before makes it anew, for which both must fit for a moment */
    uint32_t views;
    uint32_t width;              /* W, pixels of the widest view */
    uint32_t height;             /* H, pixels of the highest view */
    uint32_t sh_degree;          /* 0 to 3; 0 with direct colours */
    uint32_t disabled_skips;     /* SPLAT_SKIP_ bits of skips to turn off, for measuring */
    splat_convention convention; /* 0 = SPLAT_CONVENTION_3DGS */
    float near_plane;            /* scene units; 0 = 0.2, in SPLAT_CONVENTION_GSPLAT 0.01 */
    float far_plane;             /* scene units; 0 = 1e10 */
    /* most (Gaussian, view) pairs of a call, as the sum of its view_ranges; 0 = N V. It decides the
     * memory. With views = 0 it is the number at first, and grows */
    uint32_t items;
} splat_rasterizer_desc;

/* Create a rasterizer with its memory; the memory for intersections grows on demand.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      a field of desc outside its range, or flags that exclude each
 *                                     other
 *   SPLAT_ERROR_UNSUPPORTED           more Gaussians, views or pixels than the device takes
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_rasterizer_create(splat_device device,
                                               const splat_rasterizer_desc* desc,
                                               splat_rasterizer* rasterizer);

/* Gaussians as tensors. The caller activates them; numbers outside the ranges are drawn, too:
 *   opacities   <= 0: absent, without a gradient; > 1: its product with the falloff ends at 0.99
 *   scales      the sign has no effect; 0: flat, and wider by what every Gaussian has in the picture,
 *               0.3 pixels^2 of variance (SPLAT_CONVENTION_RAY_MAXIMUM: in the scene, 1e-7 units^2)
 *   rotations   shorter than 1e-6: absent; of another length than 1 SPLAT_CONVENTION_3DGS draws another
 *               size and shape, the others normalise them
 * A loop that fits Gaussians keeps logarithms of scales [n,3] and logits of opacities [n]: it runs
 * the operators "exp" and "sigmoid" of model.h before a forward call, and their backward after it. */
typedef struct splat_gaussians_desc {
    uint32_t struct_size;
    uint32_t flags;         /* 0 */
    const void* next;       /* NULL */
    splat_tensor means;     /* [n,3] scene units; its n counts */
    splat_tensor scales;    /* [n,3] standard deviations, scene units */
    splat_tensor rotations; /* [n,4] w, x, y, z */
    splat_tensor opacities; /* [n] 0 to 1 */
    splat_tensor sh;        /* [n,(sh_degree+1)^2,3]; NULL with direct colours */
    splat_tensor colors;    /* [n,3]; NULL without direct colours */
    /* [v,ceil(H/16),ceil(W/16)] tiles of 16 x 16 pixels of the call's views; NULL: all. Pixels of a
     * tile with 0 are the background with alpha 0 and pass no gradient; they cost nearly nothing */
    const uint8_t* active_tiles;
    size_t active_tile_count; /* bytes; 0 with NULL */
    /* [v,2] for each view of the call, the first Gaussian that it sees and how many, e.g. of sets that
     * lie one after the other; NULL: each sees all. They may overlap, repeat and be empty. A view is
     * drawn as by a call for it alone with these Gaussians, to the bit, and so are gradients of its
     * pose, intrinsics and means2d; time and memory are those of such calls. Gradients and contributions
     * of Gaussians are those of a call for each range with all its views, in the order of their first
     * ones, added. Gaussians that no view sees get 0 */
    const uint32_t* view_ranges;
    size_t view_range_count; /* numbers: 2 v; 0 with NULL */
    splat_scene scene;       /* drawn instead of tensors, which are NULL then; else NULL */
} splat_gaussians_desc;

/* Create one more state: the memory of one forward call with its images and with what its backward
 * call needs. A rasterizer has one, for calls with state = NULL. With more, several forward calls
 * stay alive, and their backward calls come in any order. States of one rasterizer share the memory
 * of gradients.
 * Returns as splat_rasterizer_create. */
SPLAT_API splat_result splat_raster_state_create(splat_rasterizer rasterizer,
                                                 splat_raster_state* state);

/* Destroy a state. Its rasterizer may have been destroyed before.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_raster_state_destroy(splat_raster_state state);

/* Draw a scene; the images stay in the state, see splat_rasterizer_output. Gaussians that are not
 * finite or have no extent are left out. It is drawn as the rasterizer's flags say; a warning is logged, once
 * for a scene, if splat_scene_info.drawn_as has bits that they lack. A scene keeps its packed copy on the device
 * for later calls. The copy keeps the device open until the scene is changed or destroyed, even if rasterizer and
 * device are destroyed earlier.
 * state           of this rasterizer; NULL: its own
 * scene           n <= N Gaussians; bands beyond the rasterizer's degree are ignored
 * cameras         `count` = v <= V cameras of 1 x 1 to W x H pixels; may be NULL for 0
 * background      exactly 3 floats RGB; NULL = black
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      a camera that is singular, not finite or too large; a
 *                                     background that is not finite; more cameras or Gaussians than
 *                                     the rasterizer was made for; a state of another rasterizer; a
 *                                     tensor of another device or dtype; another number of tiles
 *   SPLAT_ERROR_INVALID_STATE         a tensor is mapped; a scene and direct colours
 *   SPLAT_ERROR_SHAPE_MISMATCH        tensors, also of too many Gaussians: the message names one
 *   SPLAT_ERROR_UNSUPPORTED           more Gaussians in one tile than this device's loops take
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST
 * After an error before the device starts, the last images stay; later ones leave none, and so does
 * an error of a call that made the memory anew. */
SPLAT_API splat_result splat_rasterizer_forward_scene(splat_rasterizer rasterizer,
                                                      splat_raster_state state, splat_scene scene,
                                                      const splat_camera* cameras, uint32_t count,
                                                      const float* background);

/* Draw Gaussians that are tensors, or a scene whose views see ranges of it or have tiles that are off.
 * gaussians       tensors of the rasterizer's device; all NULL for n = 0
 * Other parameters and results as splat_rasterizer_forward_scene;
 *   SPLAT_ERROR_INVALID_ARGUMENT      also for a scene and tensors, a range beyond the n Gaussians,
 *                                     another number of ranges than cameras, and ranges of more
 *                                     Gaussians in all than the rasterizer was made for */
SPLAT_API splat_result splat_rasterizer_forward(splat_rasterizer rasterizer,
                                                splat_raster_state state,
                                                const splat_gaussians_desc* gaussians,
                                                const splat_camera* cameras, uint32_t count,
                                                const float* background);

/* What a forward call draws. Shapes are those of the last call: V views, N Gaussians. If a view saw a
 * range of fewer than N, [I,..] takes the place of [V,N,..]: the views' ranges one after the other,
 * I Gaussians in all. Outputs of Gaussians are 0 for culled ones: before the near or behind the far
 * plane, outside the image, not finite, without extent, or (not 3dgs) fainter than 1/255. No skip
 * changes them. */
typedef int32_t splat_output;
enum {
    SPLAT_OUTPUT_RGB = 1,            /* [V,H,W,3] colours over the background */
    SPLAT_OUTPUT_ALPHA = 2,          /* [V,H,W] sum of the weights */
    SPLAT_OUTPUT_DEPTH = 3,          /* [V,H,W] sum of weight * depth, scene units along z */
    SPLAT_OUTPUT_EXPECTED_DEPTH = 4, /* [V,H,W] depth / alpha */
    SPLAT_OUTPUT_CONTRIBUTORS = 5,   /* [V,H,W] Gaussians of weight > 0 */
    SPLAT_OUTPUT_MEANS2D = 6,        /* [V,N,2] places of their means, pixels */
    SPLAT_OUTPUT_RADII = 7,          /* [V,N,2] half extents, pixels */
    SPLAT_OUTPUT_CONICS = 8,         /* [V,N,3] a, b, c of exp(-(a x^2 + c y^2) / 2 - b x y) */
    SPLAT_OUTPUT_DEPTHS = 9,         /* [V,N] depths of their means, scene units along z */
    SPLAT_OUTPUT_VISIBILITY = 10,    /* [V,N] 1, or 0 if culled */
    /* [V,H,W,3] sum of weight * normal: axis of the smallest scale, OpenCV axes of the camera */
    SPLAT_OUTPUT_NORMALS = 11,
    /* [V,H,W] Gaussian of the largest weight, from 0 for the first of the whole set; -1: none */
    SPLAT_OUTPUT_IDS = 12,
    /* [V,H,W] depth of the last Gaussian in front of which more than half of the light is left, scene units
     * along z; 0: none */
    SPLAT_OUTPUT_MEDIAN_DEPTH = 13
};

/* Copy an output of the last forward call, float32, to a tensor.
 * tensor    on the rasterizer's device, with the output's shape
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      not a valid output, device or dtype
 *   SPLAT_ERROR_INVALID_STATE         no successful forward call, a mapped tensor, or a rasterizer
 *                                     created without SPLAT_RASTERIZER_DEPTH, _NORMALS, _IDS or
 *                                     _MEDIAN_DEPTH
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST; after the last two the tensor's contents are undefined */
SPLAT_API splat_result splat_rasterizer_output(splat_rasterizer rasterizer,
                                               splat_raster_state state, splat_output output,
                                               splat_tensor tensor);

/* Copy an output of the last forward call, float32, to host memory.
 * values    out, `bytes` bytes, at least those of the output; untouched on error
 * Returns as splat_rasterizer_output; SPLAT_ERROR_INVALID_ARGUMENT also for too few bytes. */
SPLAT_API splat_result splat_rasterizer_read(splat_rasterizer rasterizer, splat_raster_state state,
                                             splat_output output, float* values, size_t bytes);

/* Copy views of an output [V,H,W] or [V,H,W,3] into images, converted once. 8 bits are 255 v
 * rounded and clamped, as in the files of splat_image_save. Linear colours become sRGB, of any type of pixels
 * (SPLAT_RASTERIZER_LINEAR_COLORS).
 * first     the first view
 * images    out, `count` images of W x H pixels: as many channels as the output, or for RGB four,
 *           of which the last is alpha (the colours stay over the background); untouched on error
 * Returns as splat_rasterizer_output, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      an output of Gaussians; views that were not drawn; an image
 *                                     that is too short, or has two samples in one place
 *   SPLAT_ERROR_SHAPE_MISMATCH        an image of another size or number of channels */
SPLAT_API splat_result splat_rasterizer_read_images(splat_rasterizer rasterizer,
                                                    splat_raster_state state, splat_output output,
                                                    uint32_t first, const splat_image* images,
                                                    uint32_t count);

/* What becomes of gradients. */
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
    splat_tensor grad_means2d;         /* [V,N,2] per pixel; [I,2] as outputs of Gaussians */
    splat_tensor grad_means2d_abs;     /* the same: sums over the pixels of absolute values */
    splat_tensor grad_world_to_camera; /* [V,3,4] rows of the rotation and the translation */
    splat_tensor grad_intrinsics;      /* [V,4] fx, fy, cx, cy */
    splat_tensor contributions; /* [N,2] sum of its weights, number of pixels, over all views */
} splat_gradients_desc;

/* Compute gradients at the inputs of the state's last forward call; in the shapes above, N and V
 * are that call's. The rasterizer keeps a copy of them. The tensors of the forward call may have
 * changed since: the state has its own copy.
 * Gradients of a scene are with respect to its activated attributes.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      desc; a tensor of another device or dtype; an output that is
 *                                     also another tensor of the call
 *   SPLAT_ERROR_INVALID_STATE         no successful forward call, a mapped tensor, or a gradient
 *                                     that the rasterizer's flags do not include
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST; after the last two the gradients are undefined */
SPLAT_API splat_result splat_rasterizer_backward(splat_rasterizer rasterizer,
                                                 splat_raster_state state,
                                                 const splat_gradients_desc* gradients);

/* What the last forward call of a state did. */
typedef struct splat_rasterizer_info {
    uint32_t struct_size;
    uint32_t passes; /* groups of tile rows that the last forward call drew one by one */
    /* (Gaussian, view) pairs that reached a tile (with SPLAT_SKIP_CULL off: that the convention
     * keeps); the maximum over passes */
    uint64_t visible;
    uint64_t pairs;       /* (tile, Gaussian, view) triples */
    uint64_t longest;     /* Gaussians in the fullest tile */
    uint64_t tiles;       /* tiles of all views, each of W x H */
    uint64_t empty_tiles; /* tiles without Gaussians */
    /* device memory of the state, with the gradients that states share, without the packed copies
     * of scenes, which rasterizers share */
    uint64_t bytes;
    uint32_t runs;      /* times it was drawn; 0: unchanged; 2 or more: other memory or passes */
    uint32_t gaussians; /* Gaussians of the call: n of the outputs' shapes */
    uint32_t views;     /* views of the call: v of the outputs' shapes */
    uint32_t items;     /* (Gaussian, view) pairs of the call: n v, or the sum of its ranges */
    uint64_t culled; /* (Gaussian, view) pairs that are neither visible nor non_finite */
    /* (Gaussian, view) pairs that are not drawn because a number of the Gaussian, of its projection
     * or of its colour is NaN or infinite */
    uint64_t non_finite;
} splat_rasterizer_info;

/* Describe the last forward call of a state; zeros before the first. Does not wait for a call that
 * draws on another thread.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT. */
SPLAT_API splat_result splat_rasterizer_get_info(splat_rasterizer rasterizer,
                                                 splat_raster_state state,
                                                 splat_rasterizer_info* info);

/* Destroy a rasterizer; scenes, with their packed copies on the device, tensors and states stay.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_rasterizer_destroy(splat_rasterizer rasterizer);

/* ---- A scene in one call --------------------------------------------------------------------- */

/* How a scene is drawn; 0 is the default. */
typedef struct splat_scene_render_desc {
    uint32_t struct_size;
    /* SPLAT_RASTERIZER_ANTIALIASED, SPLAT_RASTERIZER_SORT_BY_DISTANCE, SPLAT_RASTERIZER_CUT_3_SIGMA,
     * SPLAT_RASTERIZER_LINEAR_COLORS, besides those that splat_scene_info.drawn_as has */
    uint32_t flags;
    const void* next;            /* NULL */
    splat_output output;         /* one of pixels; 0 = SPLAT_OUTPUT_RGB */
    splat_convention convention; /* 0 = SPLAT_CONVENTION_3DGS */
    float background[3];         /* RGB, as in the images: sRGB where colours are linear */
    uint32_t as_given;           /* 1: flags alone decide, not drawn_as; 0: both */
} splat_scene_render_desc;

/* Draw views of a scene, with all its bands and as its file says (splat_scene_info.drawn_as), into images,
 * one after the other; linear colours become sRGB. It makes a rasterizer
 * for the call: a program that draws again and again keeps one. Thread-safe.
 * device    NULL: the best one, opened for the call, which takes longer than to draw
 * cameras   `count`, each of its own size; may be NULL for 0
 * desc      NULL: RGB over black, else
 * images    out, `count`, each of its camera's size and with as many channels as the output, or for
 *           RGB four, of which the last is alpha; untouched after an error of an argument, after
 *           others some may be filled
 * Returns as splat_device_create, splat_rasterizer_create, splat_rasterizer_forward_scene and
 *   splat_rasterizer_read_images */
SPLAT_API splat_result splat_scene_render(splat_scene scene, splat_device device,
                                          const splat_camera* cameras, uint32_t count,
                                          const splat_scene_render_desc* desc,
                                          const splat_image* images);

/* ---- Image files ----------------------------------------------------------------------------- */

/* What an image file says of its image. */
typedef struct splat_image_info {
    uint32_t struct_size;
    uint32_t bits; /* bits per sample in the file: 8, 16, or 32 (.npy) */
    /* focal length in pixels, from the Exif data of a JPEG file: that for 35 mm film, whose diagonal
     * sees the same angle, or else focal length and resolution of the sensor; 0: not known */
    double focal;
} splat_image_info;

/* Read an image file: PNG, JPEG (turned as its Exif data says), WebP, binary PGM and PPM, or numbers:
 * PFM, and .npy [height,width], [height,width,channels] or [channels,height,width] of any plain type.
 * Values are as stored: no gamma, no colour profile.
 * image     in/out. With pixels NULL, width, height and channels are set from the file's header, a
 *           type of 0 becomes U8, or F32 for more than 8 bits, and bytes becomes the size of packed
 *           rows; nothing is decoded. With pixels, they are filled: width and height are the
 *           file's; gray fills RGB, and a missing alpha is opaque (not of .npy). Decode limits hold too
 * info      out, struct_size set; may be NULL
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a field of the image
 *   SPLAT_ERROR_SHAPE_MISMATCH        another size, or channels of the file have no place
 *   SPLAT_ERROR_NOT_FOUND, SPLAT_ERROR_IO  the file is not there, cannot be read
 *   SPLAT_ERROR_FORMAT                damaged, truncated or no image; pixels may be partly written
 *   SPLAT_ERROR_UNSUPPORTED           CMYK, an animated WebP, a side above 16384, another type of
 *                                     .npy */
SPLAT_API splat_result splat_image_load(const char* path, splat_image* image,
                                        splat_image_info* info);

/* Read an image from the bytes of such a file.
 * data      in, `bytes` bytes
 * Returns as splat_image_load. */
SPLAT_API splat_result splat_image_load_memory(const void* data, size_t bytes, splat_image* image,
                                               splat_image_info* info);

/* A format of image files. */
typedef int32_t splat_image_format;
enum {
    SPLAT_IMAGE_PNG = 1,   /* 8 bits: U8 as it is, else 255 v rounded and clamped; NaN is 0 */
    SPLAT_IMAGE_NPY = 2,   /* float32 [height,width,channels]; U8 is divided by 255 */
    SPLAT_IMAGE_GIF = 3,   /* animations: 252 colours, dithered; no alpha */
    SPLAT_IMAGE_PNG16 = 4, /* 16 bits, to memory only: 65535 v rounded and clamped; NaN is 0 */
    SPLAT_IMAGE_WEBP = 5   /* animations: 8 bits without loss; sides up to 16383 */
};

/* Write an image by the extension of the path: .png or .npy. The file appears whole or not at all.
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a field of the image
 *   SPLAT_ERROR_NOT_FOUND             there is no such folder
 *   SPLAT_ERROR_IO                    the file cannot be written, e.g. the disk is full
 *   SPLAT_ERROR_UNSUPPORTED           another extension */
SPLAT_API splat_result splat_image_save(const char* path, const splat_image* image);

/* Write the same bytes to memory.
 * format    SPLAT_IMAGE_PNG, SPLAT_IMAGE_PNG16 or SPLAT_IMAGE_NPY
 * needed    out, bytes of the file, may be NULL; with a smaller capacity the result is
 *           SPLAT_INCOMPLETE and nothing is written to `buffer`
 * Returns as splat_image_save, SPLAT_INCOMPLETE. */
SPLAT_API splat_result splat_image_save_memory(const splat_image* image, splat_image_format format,
                                               void* buffer, size_t capacity, size_t* needed);

/* Write images of one size as an animation that repeats for ever, by the extension of the path:
 * .png (animated PNG), .gif or .webp.
 * frames        `count` images, at least one
 * milliseconds  for each frame; 1 to 65535; in a .gif rounded to 10 ms, >= 20
 * Returns as splat_image_save; SPLAT_ERROR_UNSUPPORTED also for 2 or 4 channels in a .gif, and for a
 *   longer side than the format has. */
SPLAT_API splat_result splat_image_save_animation(const char* path, const splat_image* frames,
                                                  uint32_t count, uint32_t milliseconds);

/* Write the same bytes to memory.
 * format    SPLAT_IMAGE_PNG, SPLAT_IMAGE_GIF or SPLAT_IMAGE_WEBP
 * Returns as splat_image_save_animation, SPLAT_INCOMPLETE as splat_image_save_memory. */
SPLAT_API splat_result splat_image_save_animation_memory(const splat_image* frames, uint32_t count,
                                                         uint32_t milliseconds,
                                                         splat_image_format format, void* buffer,
                                                         size_t capacity, size_t* needed);

/* ---- Scores of images ------------------------------------------------------------------------ */

/* How alike two images are. */
typedef struct splat_image_scores {
    uint32_t struct_size;
    uint32_t reserved;
    double squared_error; /* mean of the squared differences, over pixels and channels */
    double psnr;          /* dB, for values from 0 to 1; infinite for equal images */
    double ssim;          /* structural similarity; 1 for equal images */
} splat_image_scores;

/* Compare two images in double precision: PSNR, and SSIM with a Gaussian window of 11 x 11 pixels
 * (standard deviation 1.5) on zero-padded images (Wang et al. 2004).
 * a, b      in, of one size; alpha counts as any other channel
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_ARGUMENT (an image, numbers that are not finite),
 *   SPLAT_ERROR_SHAPE_MISMATCH (two sizes) */
SPLAT_API splat_result splat_image_compare(const splat_image* a, const splat_image* b,
                                           splat_image_scores* scores);

/* Learned perceptual image patch similarity, version 0.1 with VGG16 (Zhang et al. 2018): its
 * network with weights on a device, for images of one size. The caller synchronises calls on one
 * object. */

typedef struct splat_lpips_desc {
    uint32_t struct_size;
    uint32_t flags; /* 0 */
    const void* next;
    /* weights of torchvision's vgg16 and of the lpips package, in one file or two; read before the
     * call returns */
    const splat_weights* weights;
    uint32_t weight_count;
    uint32_t side; /* pixels, both ways; >= 16 */
} splat_lpips_desc;

/* Create the network of LPIPS.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (desc; a tensor
 *   missing from all files), SPLAT_ERROR_SHAPE_MISMATCH (a tensor of another network),
 *   SPLAT_ERROR_UNSUPPORTED (a side above 16384), SPLAT_ERROR_OUT_OF_HOST_MEMORY,
 *   SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_lpips_create(splat_device device, const splat_lpips_desc* desc,
                                          splat_lpips* lpips);

/* Measure the distance of two images with values nominally 0 to 1, not clamped; equal images have
 * 0. Within 1e-4 of PyTorch's.
 * a, b      in, RGB, of side x side pixels
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (an image, numbers
 *   that are not finite), SPLAT_ERROR_SHAPE_MISMATCH (another size), SPLAT_ERROR_TIMEOUT,
 *   SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_lpips_compare(splat_lpips lpips, const splat_image* a,
                                           const splat_image* b, double* value);

/* Destroy it.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_lpips_destroy(splat_lpips lpips);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_RENDER_H */
