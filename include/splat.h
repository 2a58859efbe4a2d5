/* libsplat: Splatter Image with geometry priors on any Vulkan device.
 *
 * This header includes all of the API. Each of the others can be included alone.
 *   splat/core.h    conventions; version, results, log, images in memory, devices, tensors
 *   splat/scene.h   scenes and cameras
 *   splat/render.h  rasterizer, image files, scores of images
 *   splat/mesh.h    meshes of triangles, drawn with exact maps
 *   splat/model.h   weights, operators, networks
 *   splat/predict.h pictures of an object to a scene
 *   splat/priors.h  depth maps, normals and masks: made of pictures, judged
 *   splat/data.h    data sets and their files
 *   splat/run.h     a task with its folder, one piece of work per call
 *   splat/group.h   processes or threads that train together
 *   splat/train.h   configurations, training
 *   splat/fit.h     Gaussians fitted to posed photographs
 *   splat/co3d.h    the raw release of CO3D to a data set
 *   splat/evaluate.h scores of networks on data sets, and their comparison
 *   splat/external.h tensors in memory that other APIs and processes open
 *   splat/vulkan.h  the Vulkan device of an application, scenes drawn into its images
 */
#ifndef SPLAT_H
#define SPLAT_H

#include "splat/co3d.h"
#include "splat/core.h"
#include "splat/data.h"
#include "splat/evaluate.h"
#include "splat/external.h"
#include "splat/fit.h"
#include "splat/group.h"
#include "splat/mesh.h"
#include "splat/model.h"
#include "splat/predict.h"
#include "splat/priors.h"
#include "splat/render.h"
#include "splat/run.h"
#include "splat/scene.h"
#include "splat/train.h"
#include "splat/vulkan.h"

#endif /* SPLAT_H */
