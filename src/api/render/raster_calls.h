#pragma once

#include <array>
#include <functional>

#include "api/core/image_view.h"
#include "api/handles.h"
#include "api/objects.h"

namespace splat::api {

/// Errors: kInvalidArgument for a field outside its range, and flags that exclude each other.
Result<raster::RasterDesc> raster_desc_of(const splat_rasterizer_desc& from);

/// The same with fewer Gaussians, where a scene of more than the device takes at a time is drawn in bands: one view of
/// it, without gradients and ids.
raster::RasterDesc band_desc(const vk::DeviceInfo& device, raster::RasterDesc desc);

/// Errors: those of splat_rasterizer_create.
Result<std::shared_ptr<RasterizerObject>> make_rasterizer(DeviceObject& device,
                                                          const splat_rasterizer_desc& from);

/// A call's background, NULL being black. `linear`: it is sRGB and made linear. Errors: kInvalidArgument.
Result<std::array<float, 3>> background_of(const float* background, bool linear);

/// Pack cameras[first] to cameras[first + count - 1] and the background. Errors: kInvalidArgument, naming the camera by
/// its number.
Result<raster::PackedViews> pack_cameras(const raster::RasterDesc& desc,
                                         const splat_camera* cameras, std::uint32_t first,
                                         std::uint32_t count,
                                         const std::array<float, 3>& background);

/// The cameras of a call, which may be more than the state has memory for.
Result<raster::PackedViews> views_of_call(const RasterStateObject& object,
                                          const splat_camera* cameras, std::uint32_t count,
                                          const float* background,
                                          std::span<const raster::Range> ranges = {});

/// Warn, once for a scene, if the rasterizer does not draw it as its file says.
void warn_of_drawn_as(const RasterStateObject& object, SceneObject& scene);

/// Draws a scene that is on the device, instead of Rasterizer::forward.
using Draw = std::function<Status(const gaussians::SetViews&, const raster::PackedViews&)>;

/// Draw a scene, with more memory where the state takes any number of views. `ranges`: of each view, empty: all.
/// Locks the context's mutex. With `draw`, kUnsupported for a scene that is drawn in bands.
Status draw_scene(RasterStateObject& object, SceneObject& scene, raster::PackedViews views,
                  std::span<const raster::Range> ranges = {}, const Draw& draw = {});

/// Check an image, called `name`, that receives a view: as many channels as the output; RGB may have alpha.
Result<ImageView> image_of_output(splat_output output, const raster::RasterDesc& desc,
                                  const splat_image& image, const char* name);

/// Fill such images with views of the last call from view `first` on. The context's mutex is held.
Status fill_images(const RasterStateObject& object, splat_output output, std::uint32_t first,
                   std::span<const ImageView> images);

}  // namespace splat::api
