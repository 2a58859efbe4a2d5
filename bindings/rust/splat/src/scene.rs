//! Scenes of 3D Gaussians.

pub(crate) mod mesh;

use crate::camera;
use crate::device::Device;
use crate::error::{call, Result};
use crate::image::{Image, ImageViewMut, Sample};
use crate::object::object;
use crate::tensor::Tensor;
use crate::text::{array, bytes, c_path, c_text, count, text, zeros};
use crate::values::{
    Camera, DrawnFlags, FilterFlags, PointScores, SceneFileDesc, SceneInfo, SceneRenderDesc,
    Similarity,
};
use splat_sys as sys;
use std::path::Path;

/// The parameters of a new scene, float32, row-major, K = (sh_degree + 1)^2.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SceneDesc<'a> {
    /// Gaussians n.
    pub count: u64,
    /// 0 to 3.
    pub sh_degree: u32,
    /// `[n,3]` scene units; None: zeros, like the others.
    pub means: Option<&'a [f32]>,
    /// `[n,3]`
    pub log_scales: Option<&'a [f32]>,
    /// `[n,4]` w, x, y, z; None: 1, 0, 0, 0
    pub rotations: Option<&'a [f32]>,
    /// `[n]`
    pub opacity_logits: Option<&'a [f32]>,
    /// `[n,K,3]` constant term first
    pub sh: Option<&'a [f32]>,
    /// What a file would say of drawing the scene
    pub drawn_as: DrawnFlags,
}

object! {
    /// A set of 3D Gaussians in host memory, in the parameters that 3DGS files store. Needs no
    /// device. Axes are those of 3DGS .ply files: x right, y down, z forward. Several owners share it by
    /// `Arc`; `Scene::merge(&[&scene])` is a copy.
    ///
    /// Attributes are "means" `[n,3]`, "log_scales" `[n,3]` or activated "scales", "rotations" `[n,4]`
    /// (w, x, y, z), "opacity_logits" `[n]` or activated "opacities", and "sh" `[n,K,3]`.
    Scene, splat_scene, splat_scene_destroy
}

// SAFETY: scene.h: a scene is thread-safe.
unsafe impl Send for Scene {}
// SAFETY: scene.h: a scene is thread-safe.
unsafe impl Sync for Scene {}

impl Scene {
    /// Create a scene of arrays, which are copied.
    ///
    /// ```
    /// use splat::prelude::*;
    /// let desc = SceneDesc {
    ///     count: 2,
    ///     means: Some(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
    ///     ..Default::default()
    /// };
    /// let scene = Scene::create(&desc)?;
    /// assert_eq!(scene.to_vec("means")?[3], 1.0);
    /// assert_eq!(scene.get_info()?.count, 2);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (sh_degree, an array that is too short), `Unsupported` (more than
    /// 2^27 Gaussians).
    pub fn create(desc: &SceneDesc<'_>) -> Result<Scene> {
        let of = |name, slice| {
            if desc.count == 0 {
                array(name, None)
            } else {
                array(name, slice)
            }
        };
        let (means, mean_count) = of("means", desc.means)?;
        let (log_scales, log_scale_count) = of("log_scales", desc.log_scales)?;
        let (rotations, rotation_count) = of("rotations", desc.rotations)?;
        let (opacity_logits, opacity_logit_count) = of("opacity_logits", desc.opacity_logits)?;
        let (sh, sh_count) = of("sh", desc.sh)?;
        let raw = sys::splat_scene_desc {
            count: desc.count,
            sh_degree: desc.sh_degree,
            drawn_as: desc.drawn_as.0,
            means,
            log_scales,
            rotations,
            opacity_logits,
            sh,
            mean_count,
            log_scale_count,
            rotation_count,
            opacity_logit_count,
            sh_count,
            ..Default::default()
        };
        Scene::made(|handle| call!(splat_scene_create(&raw, handle)))
    }

    /// Read a scene file.
    /// # Errors
    /// `NotFound`, `Io`, `Format` (damaged, or no scene), `Unsupported`, `InvalidArgument`.
    pub fn load(path: impl AsRef<Path>, desc: &SceneFileDesc) -> Result<Scene> {
        let path = c_path("path", path.as_ref())?;
        Scene::made(|handle| call!(splat_scene_load(path.as_ptr(), &desc.to_raw(), handle)))
    }

    /// Number of Gaussians of a file and degree of their harmonics, from its head, to decide whether
    /// to load it.
    /// # Errors
    /// As [`Scene::load`].
    pub fn peek(path: impl AsRef<Path>, desc: &SceneFileDesc) -> Result<(u64, u32)> {
        let path = c_path("path", path.as_ref())?;
        let (mut count, mut degree) = (0, 0);
        call!(splat_scene_peek(path.as_ptr(), &desc.to_raw(), &mut count, &mut degree))?;
        Ok((count, degree))
    }

    /// Read a scene from the bytes of a file. A .splat must be named in `desc.format`.
    /// # Errors
    /// `NotFound`, `Io`, `Format` (damaged, truncated, not a scene or not of desc.format),
    /// `Unsupported` (a known format that cannot be read, or more than max_count),
    /// `OutOfHostMemory`.
    pub fn load_memory(data: &[u8], desc: &SceneFileDesc) -> Result<Scene> {
        let pointer = data.as_ptr().cast();
        Scene::made(|handle| {
            call!(splat_scene_load_memory(pointer, data.len(), &desc.to_raw(), handle))
        })
    }

    /// JSON: what was found in the scene's file; `{}` for a scene without one.
    /// # Errors
    /// Another version of the library.
    pub fn load_report(&self) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_scene_load_report(self.handle, buffer, capacity, needed)
        })
    }

    /// Write the scene to a file, which appears whole or not at all.
    /// # Errors
    /// `InvalidArgument` (values that the format cannot hold), `NotFound` (there is no such
    /// folder), `Io` (the file cannot be written), `Unsupported` (a format or extension that cannot
    /// be written), `OutOfHostMemory`.
    pub fn save(&self, path: impl AsRef<Path>, desc: &SceneFileDesc) -> Result<()> {
        let path = c_path("path", path.as_ref())?;
        call!(splat_scene_save(self.handle, path.as_ptr(), &desc.to_raw()))
    }

    /// The bytes of such a file. `desc` names the format.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let desc = SceneDesc { count: 2, means: Some(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]), ..Default::default() };
    /// # let scene = Scene::create(&desc)?;
    /// let desc = SceneFileDesc { format: SceneFormat::SPLAT, ..Default::default() };
    /// let bytes = scene.save_memory(&desc)?;
    /// assert_eq!(Scene::load_memory(&bytes, &desc)?.get_info()?.count, 2);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (values that the format cannot hold), `NotFound` (there is no such
    /// folder), `Io` (the file cannot be written), `Unsupported` (a format or extension that cannot
    /// be written), `OutOfHostMemory`.
    pub fn save_memory(&self, desc: &SceneFileDesc) -> Result<Vec<u8>> {
        let desc = desc.to_raw();
        // SAFETY: desc and buffer live through the call.
        bytes(|buffer, capacity, needed| unsafe {
            sys::splat_scene_save_memory(self.handle, &desc, buffer, capacity, needed)
        })
    }

    /// Copy an attribute into `values`, which has at least its numbers; the rest stays.
    /// # Errors
    /// `InvalidArgument` (name), `OutOfHostMemory`.
    pub fn read(&self, name: &str, values: &mut [f32]) -> Result<()> {
        let name = c_text("name", name)?;
        let bytes = std::mem::size_of_val(values);
        call!(splat_scene_read(self.handle, name.as_ptr(), values.as_mut_ptr(), bytes))
    }

    /// Copy an attribute into a new vector.
    /// # Errors
    /// As [`Scene::read`].
    pub fn to_vec(&self, name: &str) -> Result<Vec<f32>> {
        let (count, sh_degree) = self.get_size()?;
        let each = match name {
            "opacity_logits" | "opacities" => 1,
            "rotations" => 4,
            "sh" => 3 * (sh_degree as usize + 1).pow(2),
            _ => 3,
        };
        let mut values = zeros(name, &[count as usize, each])?;
        self.read(name, &mut values)?;
        Ok(values)
    }

    /// Replace the values of an attribute by the first ones of `values`.
    /// # Errors
    /// `InvalidArgument` (name), `OutOfHostMemory`.
    pub fn write(&self, name: &str, values: &[f32]) -> Result<()> {
        let name = c_text("name", name)?;
        let bytes = std::mem::size_of_val(values);
        call!(splat_scene_write(self.handle, name.as_ptr(), values.as_ptr(), bytes))
    }

    /// Copy an attribute to a new tensor of its shape.
    /// # Errors
    /// `InvalidState` (the tensor is mapped), `InvalidArgument` (name), `Unsupported` (more bytes
    /// than max_storage_buffer_bytes of the device), `OutOfHostMemory`, errors of the device.
    pub fn to_tensor(&self, name: &str, device: &Device) -> Result<Tensor> {
        let name = c_text("name", name)?;
        Tensor::wrap(|handle| {
            call!(splat_scene_to_tensor(self.handle, name.as_ptr(), device.handle, handle))
        })
    }

    /// Draw one image for each camera, of its size. `device`: None opens the best one for the call.
    /// `channels`: those of the output, or 4 for RGB with alpha. A program that draws again and
    /// again keeps a [`Rasterizer`](crate::Rasterizer).
    ///
    /// ```no_run
    /// # fn main() -> splat::Result<()> {
    /// let scene = splat::Scene::load("scene.ply", &Default::default())?;
    /// let cameras = splat::Camera::orbit(&scene, &Default::default(), 4)?;
    /// let images = scene.render::<u8>(None, &cameras, 3, &Default::default())?;
    /// splat::image::save("view.png", images[0].view()?)?;
    /// # Ok(())
    /// # }
    /// ```
    /// # Errors
    /// `InvalidArgument` (a camera, a field of `desc`), `ShapeMismatch` (channels), as
    /// `Device::create`, and of the device.
    pub fn render<T: Sample>(
        &self,
        device: Option<&Device>,
        cameras: &[Camera],
        channels: u32,
        desc: &SceneRenderDesc,
    ) -> Result<Vec<Image<T>>> {
        let length = count("cameras", cameras.len())?;
        let mut images: Vec<Image<T>> = cameras
            .iter()
            .map(|camera| Image::new([camera.width, camera.height], channels))
            .collect::<Result<_>>()?;
        let views: Result<Vec<ImageViewMut<'_>>> = images.iter_mut().map(Image::view_mut).collect();
        let raw: Vec<sys::splat_image> = views?.iter().map(ImageViewMut::to_raw).collect();
        call!(splat_scene_render(
            self.handle,
            device.map_or(std::ptr::null_mut(), |device| device.handle),
            camera::raw(cameras),
            length,
            &desc.to_raw(),
            raw.as_ptr()
        ))?;
        Ok(images)
    }

    /// Move, turn and scale the scene, including its spherical harmonics.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let desc = SceneDesc { count: 2, means: Some(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]), ..Default::default() };
    /// # let scene = Scene::create(&desc)?;
    /// let similarity = Similarity {
    ///     scale: 2.0,
    ///     rotation: [1.0, 0.0, 0.0, 0.0],
    ///     translation: [0.0, 5.0, 0.0],
    /// };
    /// scene.transform(&similarity)?;
    /// assert_eq!(scene.to_vec("means")?[3..], [2.0, 5.0, 0.0]);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (the similarity, or one that moves means beyond float32),
    /// `OutOfHostMemory`.
    pub fn transform(&self, similarity: &Similarity) -> Result<()> {
        let pointer = (similarity as *const Similarity).cast();
        call!(splat_scene_transform(self.handle, pointer))
    }

    /// Keep the Gaussians whose mean lies in a box, in scene units.
    /// # Errors
    /// `InvalidArgument` (the similarity, or one that moves means beyond float32),
    /// `OutOfHostMemory`.
    pub fn crop(&self, low: impl Into<[f64; 3]>, high: impl Into<[f64; 3]>) -> Result<()> {
        let (low, high) = (low.into(), high.into());
        call!(splat_scene_crop(self.handle, low.as_ptr(), high.as_ptr()))
    }

    /// Keep the Gaussians whose mean lies in a sphere, in scene units; its surface belongs to it.
    /// # Errors
    /// `InvalidArgument` (a centre that is not finite, a radius that is not >= 0),
    /// `OutOfHostMemory`.
    pub fn crop_sphere(&self, center: impl Into<[f64; 3]>, radius: f64) -> Result<()> {
        let center = center.into();
        call!(splat_scene_crop_sphere(self.handle, center.as_ptr(), radius))
    }

    /// Change the degree of the spherical harmonics, 0 to 3: bands above it are dropped, missing
    /// ones are zeros.
    /// # Errors
    /// `InvalidArgument` (the degree), `OutOfHostMemory`.
    pub fn set_sh_degree(&self, sh_degree: u32) -> Result<()> {
        call!(splat_scene_set_sh_degree(self.handle, sh_degree))
    }

    /// Keep the Gaussians of opacity >= `min_opacity` (0 to 1), in their order.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let desc = SceneDesc { count: 2, means: Some(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]), ..Default::default() };
    /// # let scene = Scene::create(&desc)?;
    /// scene.filter(FilterFlags::FINITE | FilterFlags::SORT, 0.1)?;
    /// assert_eq!(scene.get_info()?.count, 2);
    /// scene.filter(FilterFlags::empty(), 0.9)?;
    /// assert_eq!(scene.get_info()?.count, 0);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (the similarity, or one that moves means beyond float32),
    /// `OutOfHostMemory`.
    pub fn filter(&self, flags: FilterFlags, min_opacity: f64) -> Result<()> {
        call!(splat_scene_filter(self.handle, flags.0, min_opacity))
    }

    /// Chamfer distance and F-score of the means of the Gaussians against true points, x, y, z of
    /// each.
    ///
    /// `min_opacity`: of the Gaussians that count. `threshold`: distance of precision, recall and
    /// F-score.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let desc = SceneDesc { count: 2, means: Some(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]), ..Default::default() };
    /// # let scene = Scene::create(&desc)?;
    /// let scores = scene.compare_points(&[0.0, 0.0, 0.0], 0.5, 0.0)?;
    /// assert_eq!((scores.precision, scores.recall), (0.5, 1.0));
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument`.
    pub fn compare_points(
        &self,
        points: &[f32],
        threshold: f64,
        min_opacity: f64,
    ) -> Result<PointScores> {
        let mut scores = sys::splat_point_scores::default();
        call!(splat_scene_compare_points(
            self.handle,
            min_opacity,
            points.as_ptr(),
            points.len() as u64,
            threshold,
            &mut scores
        ))?;
        Ok(PointScores::from_raw(&scores))
    }

    /// Concatenate scenes into a new one, with the highest of their degrees.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let desc = SceneDesc { count: 2, means: Some(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]), ..Default::default() };
    /// # let scene = Scene::create(&desc)?;
    /// let copy = Scene::merge(&[&scene])?;
    /// assert_eq!(Scene::merge(&[&scene, &copy])?.get_info()?.count, 4);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `Unsupported` (more than 2^27 Gaussians), `OutOfHostMemory`.
    pub fn merge(scenes: &[&Scene]) -> Result<Scene> {
        let length = count("scenes", scenes.len())?;
        let handles: Vec<sys::splat_scene> = scenes.iter().map(|scene| scene.handle).collect();
        Scene::made(|handle| call!(splat_scene_merge(handles.as_ptr(), length, handle)))
    }

    /// The number of Gaussians and the degree of the spherical harmonics, without measuring the scene.
    /// # Errors
    /// Another version of the library.
    pub fn get_size(&self) -> Result<(u64, u32)> {
        let (mut count, mut sh_degree) = (0, 0);
        call!(splat_scene_get_size(self.handle, &mut count, &mut sh_degree))?;
        Ok((count, sh_degree))
    }

    /// Measure the scene.
    /// # Errors
    /// `OutOfHostMemory`.
    pub fn get_info(&self) -> Result<SceneInfo> {
        let mut info = sys::splat_scene_info::default();
        call!(splat_scene_get_info(self.handle, &mut info))?;
        Ok(SceneInfo::from_raw(&info))
    }
}

/// JSON array of all formats of scene files.
/// # Errors
/// Another version of the library.
pub fn formats() -> Result<String> {
    // SAFETY: the buffer lives through the call.
    text(|buffer, capacity, needed| unsafe { sys::splat_scene_formats(buffer, capacity, needed) })
}
