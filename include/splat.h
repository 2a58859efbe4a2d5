/* libsplat: Splatter Image with geometry priors on any Vulkan device.
 *
 * This header includes all of the API. Each of the others can be included alone.
 *   splat/core.h    conventions; version, results, log, images in memory, devices, tensors
 *   splat/scene.h   scenes and cameras
 *   splat/render.h  rasterizer, image files, scores of images
 *   splat/model.h   weights, operators, networks
 *   splat/train.h   configurations, data sets, pictures, training
 */
#ifndef SPLAT_H
#define SPLAT_H

#include "splat/core.h"
#include "splat/model.h"
#include "splat/render.h"
#include "splat/scene.h"
#include "splat/train.h"

#endif /* SPLAT_H */
