//! The differentiable rasterizer.

use crate::camera;
use crate::device::Device;
use crate::error::{call, Result};
use crate::image::ImageViewMut;
use crate::object::object;
use crate::scene::Scene;
use crate::tensor::Tensor;
use crate::text::{count, zeros};
use crate::values::{Camera, GradientsFlags, Output, RasterizerDesc, RasterizerInfo};
use splat_sys as sys;

object! {
    /// Draws up to N Gaussians into up to V views of up to W x H pixels, and computes gradients.
    ///
    /// The caller synchronises calls on one rasterizer and its states, so it can be sent to another
    /// thread but not shared:
    ///
    /// ```compile_fail,E0277
    /// fn shared<T: Sync>() {}
    /// shared::<splat::Rasterizer>();
    /// ```
    Rasterizer, splat_rasterizer, splat_rasterizer_destroy, size: [usize; 2]
}

// SAFETY: render.h: the caller synchronises calls on one rasterizer and its states. States act only
// through `&Rasterizer`, which no two threads have, since it is not Sync.
unsafe impl Send for Rasterizer {}

object! {
    /// The memory of one more forward call, with its images and with what its backward call needs.
    /// Its rasterizer may be dropped before.
    RasterState, splat_raster_state, splat_raster_state_destroy
}

// SAFETY: as Rasterizer: the state itself has no calls but its destruction, which may run anywhere.
unsafe impl Send for RasterState {}

impl RasterState {
    /// Create one more state of a rasterizer.
    /// # Errors
    /// `InvalidArgument` (a field of desc outside its range, or flags that exclude each other),
    /// `Unsupported` (more Gaussians, views or pixels than the device takes), `OutOfHostMemory`,
    /// errors of the device.
    pub fn create(rasterizer: &Rasterizer) -> Result<RasterState> {
        RasterState::made(|handle| call!(splat_raster_state_create(rasterizer.handle, handle)))
    }
}

/// Gaussians that are tensors of the rasterizer's device; all None for n = 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gaussians<'a> {
    /// `[n,3]` scene units; its n counts
    pub means: Option<&'a Tensor>,
    /// `[n,3]` standard deviations, scene units
    pub scales: Option<&'a Tensor>,
    /// `[n,4]` w, x, y, z
    pub rotations: Option<&'a Tensor>,
    /// `[n]` 0 to 1
    pub opacities: Option<&'a Tensor>,
    /// `[n,(sh_degree+1)^2,3]`; None with direct colours
    pub sh: Option<&'a Tensor>,
    /// `[n,3]`; None without direct colours
    pub colors: Option<&'a Tensor>,
    /// `[v,ceil(H/16),ceil(W/16)]` tiles of the call's views; None: all. Pixels of a tile with 0 are
    /// the background with alpha 0, and pass no gradient
    pub active_tiles: Option<&'a [u8]>,
    /// `[v,2]` the first Gaussian that each view of the call sees, and how many; None: all. Each range
    /// costs what a call for it would, with the same bits
    pub view_ranges: Option<&'a [u32]>,
    /// Drawn instead of tensors, which are None then
    pub scene: Option<&'a Scene>,
}

/// Tensors of a backward call, in the shapes of the last forward call: V views, N Gaussians. None
/// is a gradient of zeros, or one that is not computed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gradients<'a> {
    /// Accumulate or overwrite.
    pub flags: GradientsFlags,
    /// In: `[V,H,W,3]`
    pub grad_rgb: Option<&'a Tensor>,
    /// In: `[V,H,W]`
    pub grad_alpha: Option<&'a Tensor>,
    /// In: `[V,H,W]`
    pub grad_depth: Option<&'a Tensor>,
    /// Out: `[N,3]`
    pub grad_means: Option<&'a Tensor>,
    /// Out: `[N,3]`
    pub grad_scales: Option<&'a Tensor>,
    /// Out: `[N,4]`
    pub grad_rotations: Option<&'a Tensor>,
    /// Out: `[N]`
    pub grad_opacities: Option<&'a Tensor>,
    /// Out: `[N,(sh_degree+1)^2,3]`
    pub grad_sh: Option<&'a Tensor>,
    /// Out: `[N,3]` direct colours
    pub grad_colors: Option<&'a Tensor>,
    /// Out: `[V,N,2]` per pixel
    pub grad_means2d: Option<&'a Tensor>,
    /// Out: `[V,N,2]` sums over the pixels of absolute values
    pub grad_means2d_abs: Option<&'a Tensor>,
    /// Out: `[V,3,4]` rows of the rotation and the translation
    pub grad_world_to_camera: Option<&'a Tensor>,
    /// Out: `[V,4]` fx, fy, cx, cy
    pub grad_intrinsics: Option<&'a Tensor>,
    /// Out: `[N,2]` sum of its weights, number of pixels, over all views
    pub contributions: Option<&'a Tensor>,
}

pub(crate) fn handle(tensor: Option<&Tensor>) -> sys::splat_tensor {
    tensor.map_or(std::ptr::null_mut(), |tensor| tensor.handle)
}

fn state_handle(state: Option<&RasterState>) -> sys::splat_raster_state {
    state.map_or(std::ptr::null_mut(), |state| state.handle)
}

fn background_pointer(background: &Option<[f32; 3]>) -> *const f32 {
    background.as_ref().map_or(std::ptr::null(), |color| color.as_ptr())
}

impl Rasterizer {
    /// Create a rasterizer with its memory; the memory for intersections grows on demand.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let device = Device::create(&Default::default())?;
    /// # let desc = SceneDesc { count: 1, means: Some(&[0.0, 0.0, 2.0]), sh: Some(&[1.0; 3]), ..Default::default() };
    /// # let scene = Scene::create(&desc)?;
    /// let desc = RasterizerDesc { gaussians: 10, width: 32, height: 32, ..Default::default() };
    /// let rasterizer = Rasterizer::create(&device, &desc)?;
    /// let camera = Camera::from_fov(32, 32, 0.8)?;
    /// rasterizer.forward_scene(None, &scene, &[camera], Some([1.0; 3]))?;
    /// assert_eq!(rasterizer.to_vec(None, Output::RGB)?.len(), 32 * 32 * 3);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (a field, flags that exclude each other), `Unsupported` (more than
    /// the device takes at once), and out of memory.
    pub fn create(device: &Device, desc: &RasterizerDesc) -> Result<Rasterizer> {
        let raw = desc.to_raw();
        let mut rasterizer =
            Rasterizer::made(|handle| call!(splat_rasterizer_create(device.handle, &raw, handle)))?;
        rasterizer.size = [desc.height as usize, desc.width as usize];
        Ok(rasterizer)
    }

    /// Draw a scene; the images stay in the state. `state`: None is the rasterizer's own.
    /// `background`: RGB; None is black.
    /// # Errors
    /// `InvalidArgument` (a camera, more cameras or Gaussians than the rasterizer was made
    /// for, a state of another rasterizer), `InvalidState`, `Unsupported`, errors of the device.
    pub fn forward_scene(
        &self,
        state: Option<&RasterState>,
        scene: &Scene,
        cameras: &[Camera],
        background: Option<[f32; 3]>,
    ) -> Result<()> {
        let length = count("cameras", cameras.len())?;
        let (state, background) = (state_handle(state), background_pointer(&background));
        let cameras = camera::raw(cameras);
        call!(splat_rasterizer_forward_scene(
            self.handle,
            state,
            scene.handle,
            cameras,
            length,
            background
        ))
    }

    /// Draw Gaussians that are tensors.
    /// # Errors
    /// Also `ShapeMismatch`, naming the tensor.
    pub fn forward(
        &self,
        state: Option<&RasterState>,
        gaussians: &Gaussians<'_>,
        cameras: &[Camera],
        background: Option<[f32; 3]>,
    ) -> Result<()> {
        let raw = sys::splat_gaussians_desc {
            means: handle(gaussians.means),
            scales: handle(gaussians.scales),
            rotations: handle(gaussians.rotations),
            opacities: handle(gaussians.opacities),
            sh: handle(gaussians.sh),
            colors: handle(gaussians.colors),
            active_tiles: gaussians.active_tiles.map_or(std::ptr::null(), |tiles| tiles.as_ptr()),
            active_tile_count: gaussians.active_tiles.map_or(0, |tiles| tiles.len()),
            view_ranges: gaussians.view_ranges.map_or(std::ptr::null(), |all| all.as_ptr()),
            view_range_count: gaussians.view_ranges.map_or(0, |all| all.len()),
            scene: gaussians.scene.map_or(std::ptr::null_mut(), |scene| scene.handle),
            ..Default::default()
        };
        let length = count("cameras", cameras.len())?;
        let (state, background) = (state_handle(state), background_pointer(&background));
        let cameras = camera::raw(cameras);
        call!(splat_rasterizer_forward(self.handle, state, &raw, cameras, length, background))
    }

    /// Copy an output of the last forward call to a tensor of its shape.
    /// # Errors
    /// `ShapeMismatch`, `InvalidArgument` (not a valid output, device or dtype), `InvalidState`,
    /// `OutOfHostMemory`, errors of the device.
    pub fn output(
        &self,
        state: Option<&RasterState>,
        output: Output,
        tensor: &Tensor,
    ) -> Result<()> {
        let state = state_handle(state);
        call!(splat_rasterizer_output(self.handle, state, output.0, tensor.handle))
    }

    /// Copy an output of the last forward call into `values`, which has at least its numbers; the
    /// rest stays. Untouched on an error.
    /// # Errors
    /// `InvalidArgument` (not a valid output, device or dtype), `ShapeMismatch`, `InvalidState`,
    /// `OutOfHostMemory`, errors of the device.
    pub fn read(
        &self,
        state: Option<&RasterState>,
        output: Output,
        values: &mut [f32],
    ) -> Result<()> {
        let bytes = std::mem::size_of_val(values);
        let (state, values) = (state_handle(state), values.as_mut_ptr());
        call!(splat_rasterizer_read(self.handle, state, output.0, values, bytes))
    }

    /// Copy an output of the last forward call into a new vector, in the shape of [`Output`].
    /// # Errors
    /// As [`Rasterizer::read`].
    pub fn to_vec(&self, state: Option<&RasterState>, output: Output) -> Result<Vec<f32>> {
        let info = self.get_info(state)?;
        let pixels = self.size[0] * self.size[1];
        let (pixels, items) = (info.views as usize * pixels, info.items as usize);
        let shape = match output {
            Output::RGB | Output::NORMALS => [3, pixels],
            Output::MEANS2D | Output::RADII => [2, items],
            Output::CONICS => [3, items],
            Output::DEPTHS | Output::VISIBILITY => [1, items],
            _ => [1, pixels],
        };
        let mut values = zeros("output", &shape)?;
        self.read(state, output, &mut values)?;
        Ok(values)
    }

    /// Copy views of an output into images, from view `first` on. 8 bits are 255 v, rounded and
    /// clamped. Four channels of [`Output::RGB`] have alpha last.
    /// # Errors
    /// `InvalidArgument` (an output of Gaussians), `ShapeMismatch` (an image of another size or
    /// number of channels), `InvalidState`, `OutOfHostMemory`, errors of the device.
    pub fn read_images(
        &self,
        state: Option<&RasterState>,
        output: Output,
        first: u32,
        images: &mut [ImageViewMut<'_>],
    ) -> Result<()> {
        let length = count("images", images.len())?;
        let raw: Vec<sys::splat_image> = images.iter().map(|image| image.to_raw()).collect();
        let (state, raw) = (state_handle(state), raw.as_ptr());
        call!(splat_rasterizer_read_images(self.handle, state, output.0, first, raw, length))
    }

    /// Compute gradients at the inputs of the state's last forward call.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let device = Device::create(&Default::default())?;
    /// let desc = RasterizerDesc {
    ///     flags: RasterizerFlags::BACKWARD | RasterizerFlags::DIRECT_COLORS,
    ///     gaussians: 1,
    ///     width: 16,
    ///     height: 16,
    ///     ..Default::default()
    /// };
    /// let rasterizer = Rasterizer::create(&device, &desc)?;
    /// let tensor = |dims: &[i64], values: &[f32]| Tensor::from_slice(&device, dims, values);
    /// let means = tensor(&[1, 3], &[0.0, 0.0, 2.0])?;
    /// let scales = tensor(&[1, 3], &[0.2; 3])?;
    /// let rotations = tensor(&[1, 4], &[1.0, 0.0, 0.0, 0.0])?;
    /// let (opacities, colors) = (tensor(&[1], &[0.9])?, tensor(&[1, 3], &[0.5; 3])?);
    /// let gaussians = Gaussians {
    ///     means: Some(&means),
    ///     scales: Some(&scales),
    ///     rotations: Some(&rotations),
    ///     opacities: Some(&opacities),
    ///     colors: Some(&colors),
    ///     ..Default::default()
    /// };
    /// rasterizer.forward(None, &gaussians, &[Camera::from_fov(16, 16, 0.8)?], None)?;
    /// let grad_rgb = tensor(&[1, 16, 16, 3], &[1.0; 16 * 16 * 3])?;
    /// let grad_colors = tensor(&[1, 3], &[0.0; 3])?;
    /// let gradients = Gradients {
    ///     grad_rgb: Some(&grad_rgb),
    ///     grad_colors: Some(&grad_colors),
    ///     ..Default::default()
    /// };
    /// rasterizer.backward(None, &gradients)?;
    /// assert!(grad_colors.to_vec::<f32>()?[0] > 0.0);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `ShapeMismatch`, `InvalidArgument` (a tensor of another device or dtype, an output
    /// that is also another tensor of the call), `InvalidState` (no forward call, a gradient that
    /// the rasterizer's flags do not include), errors of the device.
    pub fn backward(&self, state: Option<&RasterState>, gradients: &Gradients<'_>) -> Result<()> {
        let raw = sys::splat_gradients_desc {
            flags: gradients.flags.0,
            grad_rgb: handle(gradients.grad_rgb),
            grad_alpha: handle(gradients.grad_alpha),
            grad_depth: handle(gradients.grad_depth),
            grad_means: handle(gradients.grad_means),
            grad_scales: handle(gradients.grad_scales),
            grad_rotations: handle(gradients.grad_rotations),
            grad_opacities: handle(gradients.grad_opacities),
            grad_sh: handle(gradients.grad_sh),
            grad_colors: handle(gradients.grad_colors),
            grad_means2d: handle(gradients.grad_means2d),
            grad_means2d_abs: handle(gradients.grad_means2d_abs),
            grad_world_to_camera: handle(gradients.grad_world_to_camera),
            grad_intrinsics: handle(gradients.grad_intrinsics),
            contributions: handle(gradients.contributions),
            ..Default::default()
        };
        call!(splat_rasterizer_backward(self.handle, state_handle(state), &raw))
    }

    /// Describe the last forward call of a state; zeros before the first.
    /// # Errors
    /// Another version of the library.
    pub fn get_info(&self, state: Option<&RasterState>) -> Result<RasterizerInfo> {
        let mut info = sys::splat_rasterizer_info::default();
        call!(splat_rasterizer_get_info(self.handle, state_handle(state), &mut info))?;
        Ok(RasterizerInfo::from_raw(&info))
    }
}
