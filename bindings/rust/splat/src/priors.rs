//! Depth, normals and masks of pictures.

use crate::device::Device;
use crate::error::{call, Result};
use crate::image::{ImageView, ImageViewMut};
use crate::object::object;
use crate::text::{c_optional, c_optional_path, pointer, text};
use crate::values::{Found, NormalFlags, PriorModelFlags, PriorModelInfo};
use splat_sys as sys;
use std::path::Path;

/// The JSON of a preset: input, outputs, and where its model is had. `name`: None for an array of
/// all names.
/// # Errors
/// `NotFound`, listing the names.
pub fn prior_preset(name: Option<&str>) -> Result<String> {
    let name = c_optional("name", name)?;
    // SAFETY: name and buffer live through the call.
    text(|buffer, capacity, needed| unsafe {
        sys::splat_prior_preset(pointer(&name), buffer, capacity, needed)
    })
}

/// Find the object of a picture without a network: by an alpha that is not opaque everywhere, else
/// by the colour of its border. `mask`: 1 channel of the picture's size.
///
/// ```
/// use splat::prelude::*;
/// let mut pixels = vec![255_u8; 32 * 32 * 3];
/// pixels[3 * 500..][..90].fill(0);
/// let mut mask = Image::<u8>::new([32, 32], 1)?;
/// let picture = ImageView::new(&pixels, [32, 32], 3)?;
/// assert_eq!(splat::picture_mask(picture, mask.view_mut()?)?, Found::BY_BORDER);
/// # Ok::<(), splat::Error>(())
/// ```
/// # Errors
/// `ShapeMismatch`, `InvalidArgument`.
pub fn picture_mask(picture: ImageView<'_>, mask: ImageViewMut<'_>) -> Result<Found> {
    let mut found = 0;
    let mask = mask.to_raw();
    call!(splat_picture_mask(&picture.to_raw(), &mask, &mut found))?;
    Ok(Found(found))
}

/// The camera of a depth map, and what its numbers mean.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NormalsDesc {
    /// Focal lengths, pixels.
    pub focal: [f64; 2],
    /// Principal point, pixels from the left and upper edge; both 0: the middle.
    pub center: [f64; 2],
    /// Nearest and farthest distance of relative depth; both 0: the map holds distances.
    pub distances: [f64; 2],
}

/// Make normals of the surface that a depth map shows: (n + 1) / 2 in the camera's axes, 0.5 without
/// a surface. `normal`: 3 channels of the map's size.
///
/// ```
/// use splat::prelude::*;
/// let depth = ImageView::new(&[2.0_f32; 64], [8, 8], 1)?;
/// let mut normals = Image::<f32>::new([8, 8], 3)?;
/// let desc = NormalsDesc { focal: [8.0; 2], ..Default::default() };
/// splat::normals_from_depth(depth, &desc, normals.view_mut()?)?;
/// assert_eq!(normals.pixels[3 * 36 + 2], 0.0); // towards the camera
/// # Ok::<(), splat::Error>(())
/// ```
/// # Errors
/// `ShapeMismatch`, `InvalidArgument`.
pub fn normals_from_depth(
    depth: ImageView<'_>,
    desc: &NormalsDesc,
    normal: ImageViewMut<'_>,
) -> Result<()> {
    let normal = normal.to_raw();
    call!(splat_normals_from_depth(&depth.to_raw(), &desc.to_raw(), &normal))
}

impl NormalsDesc {
    fn to_raw(self) -> sys::splat_normals_desc {
        sys::splat_normals_desc {
            focal_x: self.focal[0],
            focal_y: self.focal[1],
            center_x: self.center[0],
            center_y: self.center[1],
            nearest: self.distances[0],
            farthest: self.distances[1],
            ..Default::default()
        }
    }
}

/// What is a plane; 0: the default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlanesDesc {
    /// [`NormalFlags::VECTORS`]: normals and planes are numbers themselves.
    pub flags: NormalFlags,
    /// Most angle between a pixel's normal and its plane's, degrees; 15.
    pub max_degrees: f64,
    /// Most distance of a pixel from its plane, as a share of its depth; 0.02.
    pub max_offset: f64,
    /// Share of the pixels of the smallest plane; 0.005.
    pub least_share: f64,
}

/// Find the planes of the surface that a depth map shows: of each pixel the normal of its plane in the
/// camera's axes and the distance, 0 without a plane; returns their number. `normal`: 3 channels; None:
/// by differences of the depth. `plane`: 4 channels of the map's size.
///
/// ```
/// use splat::prelude::*;
/// let depth = ImageView::new(&[2.0_f32; 64], [8, 8], 1)?;
/// let mut planes = Image::<f32>::new([8, 8], 4)?;
/// let camera = NormalsDesc { focal: [8.0; 2], ..Default::default() };
/// let desc = PlanesDesc { flags: NormalFlags::VECTORS, ..Default::default() };
/// assert_eq!(splat::planes_from_depth(depth, None, &camera, &desc, planes.view_mut()?)?, 1);
/// assert!((planes.pixels[3] - 2.0).abs() < 1e-6);
/// # Ok::<(), splat::Error>(())
/// ```
/// # Errors
/// `ShapeMismatch`, `InvalidArgument`.
pub fn planes_from_depth(
    depth: ImageView<'_>,
    normal: Option<ImageView<'_>>,
    camera: &NormalsDesc,
    desc: &PlanesDesc,
    plane: ImageViewMut<'_>,
) -> Result<u32> {
    let raw = sys::splat_planes_desc {
        flags: desc.flags.0,
        max_degrees: desc.max_degrees,
        max_offset: desc.max_offset,
        least_share: desc.least_share,
        ..Default::default()
    };
    let normal = normal.map(ImageView::to_raw);
    let plane = plane.to_raw();
    let mut count = 0;
    call!(splat_planes_from_depth(
        &depth.to_raw(),
        normal.as_ref().map_or(std::ptr::null(), |normal| normal as *const _),
        &camera.to_raw(),
        &raw,
        &plane,
        &mut count
    ))?;
    Ok(count)
}

/// A network and its preset.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PriorModelDesc<'a> {
    /// [`PriorModelFlags::NUMBERS`]: float maps have the model's own numbers.
    pub flags: PriorModelFlags,
    /// A name, or JSON of one's own; None: by the name of the file.
    pub preset: Option<&'a str>,
    /// ONNX file, or weights of MoGe-2; None: the preset's, in the folder of models.
    pub model: Option<&'a Path>,
    /// The library of ONNX Runtime; None: where the library looks for it.
    pub runtime: Option<&'a Path>,
    /// Threads of one run; 0: one per core.
    pub threads: u32,
    /// Patches of a picture, for presets that have them; 0: the preset's.
    pub tokens: u32,
    /// The device that runs weights; None for an ONNX file.
    pub device: Option<&'a Device>,
}

/// Where the maps of a picture go; None: not wanted.
#[derive(Debug, Default, PartialEq)]
pub struct PriorMaps<'a> {
    /// 1 channel; larger is nearer.
    pub depth: Option<ImageViewMut<'a>>,
    /// 3 channels.
    pub normal: Option<ImageViewMut<'a>>,
    /// 1 channel; 1 on the object.
    pub mask: Option<ImageViewMut<'a>>,
}

impl PriorMaps<'_> {
    fn to_raw(&self) -> sys::splat_prior_maps {
        let raw = |map: &Option<ImageViewMut<'_>>| {
            map.as_ref().map_or_else(sys::splat_image::default, |view| view.to_raw())
        };
        sys::splat_prior_maps {
            depth: raw(&self.depth),
            normal: raw(&self.normal),
            mask: raw(&self.mask),
        }
    }
}

object! {
    /// A network that makes maps of pictures.
    PriorModel, splat_prior_model, splat_prior_model_destroy
}

// SAFETY: priors.h: thread-safe.
unsafe impl Send for PriorModel {}
// SAFETY: as above.
unsafe impl Sync for PriorModel {}

impl PriorModel {
    /// Load a model.
    /// # Errors
    /// `NotFound` (a preset, a file, ONNX Runtime), `Unsupported` (another library),
    /// `Format` (a model of another interface), `InvalidArgument`.
    pub fn create(desc: &PriorModelDesc<'_>) -> Result<PriorModel> {
        let preset = c_optional("preset", desc.preset)?;
        let model = c_optional_path("model", desc.model)?;
        let runtime = c_optional_path("runtime", desc.runtime)?;
        let raw = sys::splat_prior_model_desc {
            flags: desc.flags.0,
            preset: pointer(&preset),
            model_path: pointer(&model),
            runtime_path: pointer(&runtime),
            threads: desc.threads,
            tokens: desc.tokens,
            device: desc.device.map_or(std::ptr::null_mut(), Device::as_raw),
            ..Default::default()
        };
        PriorModel::made(|handle| call!(splat_prior_model_create(&raw, handle)))
    }

    /// What it makes, its licence, the size of its input.
    /// # Errors
    /// Another version of the library.
    pub fn get_info(&self) -> Result<PriorModelInfo> {
        let mut info = sys::splat_prior_model_info::default();
        call!(splat_prior_model_get_info(self.handle, &mut info))?;
        Ok(PriorModelInfo::from_raw(&info))
    }

    /// Make maps of a picture, all of its size.
    /// # Errors
    /// `InvalidArgument` (a field of an image, no map, a map that the model lacks), `ShapeMismatch`
    /// (a map of another size or other channels), `Unsupported` (a picture that is too wide or too
    /// high for the preset), `Format` (the model cannot run, or gives an output of another shape),
    /// `InvalidState` (its output is not finite), `OutOfHostMemory`.
    pub fn run(&self, picture: ImageView<'_>, maps: PriorMaps<'_>) -> Result<()> {
        let picture = picture.to_raw();
        call!(splat_prior_model_run(self.handle, &picture, &maps.to_raw(), 1))
    }

    /// The same, and the focal length of the picture's camera, pixels; 0 if the model does not tell it.
    /// # Errors
    /// As `run`.
    pub fn run_focal(&self, picture: ImageView<'_>, maps: PriorMaps<'_>) -> Result<f64> {
        let maps = maps.to_raw();
        let picture = picture.to_raw();
        let mut focal = 0.0;
        call!(splat_prior_model_run_focal(self.handle, &picture, &maps, &mut focal, 1))?;
        Ok(focal)
    }
}
