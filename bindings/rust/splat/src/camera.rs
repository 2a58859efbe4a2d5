//! Pinhole cameras and their files.

use crate::error::{call, Error, Result};
use crate::scene::Scene;
use crate::text::{bytes, c_path, count, items, text, zeros, Texts};
use crate::values::{Camera, CameraFileDesc, Code, OrbitDesc};
use splat_sys as sys;
use std::path::Path;

/// Files of cameras in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraBytes<'a> {
    /// transforms.json, or COLMAP's cameras.bin or cameras.txt
    pub cameras: &'a [u8],
    /// COLMAP's images.bin or images.txt; None for a transforms.json
    pub images: Option<&'a [u8]>,
}

impl CameraBytes<'_> {
    fn to_raw(self) -> sys::splat_camera_bytes {
        let images = self.images.unwrap_or(&[]);
        sys::splat_camera_bytes {
            cameras: self.cameras.as_ptr().cast(),
            camera_bytes: self.cameras.len(),
            images: self.images.map_or(std::ptr::null(), |bytes| bytes.as_ptr().cast()),
            image_bytes: images.len(),
            ..Default::default()
        }
    }
}

pub(crate) fn raw(cameras: &[Camera]) -> *const sys::splat_camera {
    cameras.as_ptr().cast()
}

impl Camera {
    /// Intrinsics of an image whose horizontal field of view is `fov_x` radians, with square pixels
    /// and the principal point in the middle; the pose is the identity.
    ///
    /// ```
    /// use splat::prelude::*;
    /// let mut camera = Camera::from_fov(640, 480, 0.8)?;
    /// camera.look_at([0.0, 0.0, -2.0], [0.0; 3], [0.0, -1.0, 0.0])?;
    /// assert_eq!((camera.cx, camera.cy), (320.0, 240.0));
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument`, a side outside 1 to 16384, or an angle outside 0 to pi.
    pub fn from_fov(width: u32, height: u32, fov_x: f64) -> Result<Camera> {
        let mut camera = Camera::default();
        call!(splat_camera_from_fov(width, height, fov_x, camera.as_raw_mut()))?;
        Ok(camera)
    }

    /// Set the pose: at `eye`, looking at `target`, with `up` (a direction of the world) upwards in
    /// the image. The intrinsics stay. Scene units.
    /// # Errors
    /// `InvalidArgument`.
    pub fn look_at(
        &mut self,
        eye: impl Into<[f64; 3]>,
        target: impl Into<[f64; 3]>,
        up: impl Into<[f64; 3]>,
    ) -> Result<()> {
        let (eye, target, up) = (eye.into(), target.into(), up.into());
        let camera = self.as_raw_mut();
        call!(splat_camera_look_at(camera, eye.as_ptr(), target.as_ptr(), up.as_ptr()))
    }

    /// Set the pose from an OpenGL camera-to-world matrix, row-major: x right, y up, z backwards.
    /// # Errors
    /// `InvalidArgument` (the matrix is not a rotation with a translation).
    pub fn from_opengl(&mut self, camera_to_world: &[f64; 16]) -> Result<()> {
        call!(splat_camera_from_opengl(self.as_raw_mut(), camera_to_world.as_ptr()))
    }

    /// Give the pose as such a matrix.
    /// # Errors
    /// `InvalidArgument` (the matrix is not a rotation with a translation).
    pub fn to_opengl(&self) -> Result<[f64; 16]> {
        let mut matrix = [0.0; 16];
        let camera = (self as *const Camera).cast();
        call!(splat_camera_to_opengl(camera, matrix.as_mut_ptr()))?;
        Ok(matrix)
    }

    /// `count` cameras at equal angles on a circle around the centre of a scene.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let desc = SceneDesc { count: 2, means: Some(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]), ..Default::default() };
    /// # let scene = Scene::create(&desc)?;
    /// let desc = OrbitDesc { width: 64, height: 64, elevation: 0.4, ..Default::default() };
    /// assert_eq!(Camera::orbit(&scene, &desc, 24)?.len(), 24);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument`, `OutOfHostMemory`.
    pub fn orbit(scene: &Scene, desc: &OrbitDesc, count: u32) -> Result<Vec<Camera>> {
        let mut cameras = zeros::<Camera>("count", &[count as usize])?;
        let out = cameras.as_mut_ptr().cast();
        call!(splat_camera_orbit(scene.handle, &desc.to_raw(), count, out))?;
        Ok(cameras)
    }

    /// `count` cameras along a smooth path through `keys`, with the size and lens of the first one; a
    /// `closed` path returns to its first key.
    /// # Errors
    /// `InvalidArgument` (fewer than two different poses), `OutOfHostMemory`.
    pub fn path(keys: &[Camera], closed: bool, count: u32) -> Result<Vec<Camera>> {
        let mut cameras = zeros::<Camera>("count", &[count as usize])?;
        let out = cameras.as_mut_ptr().cast();
        let from = keys.as_ptr().cast();
        call!(splat_camera_path(from, keys.len() as u32, u32::from(closed), count, out))?;
        Ok(cameras)
    }

    /// Read the cameras of a NeRF transforms.json, or of a COLMAP model's folder.
    /// # Errors
    /// `NotFound` (there is no such file, or no model in the folder), `Io` (a file cannot be read),
    /// `Format` (damaged, truncated, an invalid camera), `Unsupported` (distortion, another lens
    /// model), `OutOfHostMemory`.
    pub fn load(path: impl AsRef<Path>, desc: &CameraFileDesc) -> Result<Vec<Camera>> {
        let path = c_path("path", path.as_ref())?;
        let desc = desc.to_raw();
        // SAFETY: path, desc and cameras live through the call; Camera has the layout of C.
        items(|cameras: *mut Camera, capacity, count| unsafe {
            sys::splat_camera_load(path.as_ptr(), &desc, cameras.cast(), capacity, count)
        })
    }

    /// JSON on the same file: names of the images in the order of the cameras, warnings.
    /// # Errors
    /// `NotFound` (there is no such file, or no model in the folder), `Io` (a file cannot be read),
    /// `Format` (damaged, truncated, an invalid camera), `Unsupported` (distortion, another lens
    /// model), `OutOfHostMemory`.
    pub fn load_report(path: impl AsRef<Path>, desc: &CameraFileDesc) -> Result<String> {
        let path = c_path("path", path.as_ref())?;
        let desc = desc.to_raw();
        // SAFETY: path, desc and buffer live through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_camera_load_report(path.as_ptr(), &desc, buffer, capacity, needed)
        })
    }

    /// Read cameras from memory.
    /// # Errors
    /// `NotFound` (there is no such file, or no model in the folder), `Io` (a file cannot be read),
    /// `Format` (damaged, truncated, an invalid camera), `Unsupported` (distortion, another lens
    /// model), `OutOfHostMemory`.
    pub fn load_memory(files: CameraBytes<'_>, desc: &CameraFileDesc) -> Result<Vec<Camera>> {
        let (files, desc) = (files.to_raw(), desc.to_raw());
        // SAFETY: files, desc and cameras live through the call; Camera has the layout of C.
        items(|cameras: *mut Camera, capacity, count| unsafe {
            sys::splat_camera_load_memory(&files, &desc, cameras.cast(), capacity, count)
        })
    }

    /// JSON on the same files.
    /// # Errors
    /// `NotFound` (there is no such file, or no model in the folder), `Io` (a file cannot be read),
    /// `Format` (damaged, truncated, an invalid camera), `Unsupported` (distortion, another lens
    /// model), `OutOfHostMemory`.
    pub fn load_memory_report(files: CameraBytes<'_>, desc: &CameraFileDesc) -> Result<String> {
        let (files, desc) = (files.to_raw(), desc.to_raw());
        // SAFETY: files, desc and buffer live through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_camera_load_memory_report(&files, &desc, buffer, capacity, needed)
        })
    }

    /// Write cameras as a NeRF transforms.json. `names`: paths of the images, one for each camera,
    /// or none for empty ones.
    /// # Errors
    /// `InvalidArgument` (an invalid camera), `NotFound` (there is no such folder), `Io` (the file
    /// cannot be written), `OutOfHostMemory`.
    pub fn save(path: impl AsRef<Path>, cameras: &[Camera], names: &[&str]) -> Result<()> {
        let path = c_path("path", path.as_ref())?;
        let (length, names) = named(cameras, names)?;
        call!(splat_camera_save(path.as_ptr(), raw(cameras), names_pointer(&names), length))
    }

    /// The same bytes.
    ///
    /// ```
    /// use splat::prelude::*;
    /// let cameras = [Camera::from_fov(640, 480, 0.8)?];
    /// let json = Camera::save_memory(&cameras, &["a.png"])?;
    /// let files = CameraBytes { cameras: &json, ..Default::default() };
    /// assert_eq!(Camera::load_memory(files, &Default::default())?[0].width, 640);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (an invalid camera), `NotFound` (there is no such folder), `Io` (the file
    /// cannot be written), `OutOfHostMemory`.
    pub fn save_memory(cameras: &[Camera], names: &[&str]) -> Result<Vec<u8>> {
        let (length, names) = named(cameras, names)?;
        // SAFETY: cameras, names and buffer live through the call; Camera has the layout of C.
        bytes(|buffer, capacity, needed| unsafe {
            let (cameras, names) = (raw(cameras), names_pointer(&names));
            sys::splat_camera_save_memory(cameras, names, length, buffer, capacity, needed)
        })
    }

    fn as_raw_mut(&mut self) -> *mut sys::splat_camera {
        (self as *mut Camera).cast()
    }
}

fn named(cameras: &[Camera], names: &[&str]) -> Result<(u32, Texts)> {
    if !names.is_empty() && names.len() != cameras.len() {
        return Err(Error::new(
            Code::ShapeMismatch,
            format!("names: {} of them, expected {} or none", names.len(), cameras.len()),
        ));
    }
    Ok((count("cameras", cameras.len())?, Texts::new("names", names)?))
}

fn names_pointer(names: &Texts) -> *const *const std::os::raw::c_char {
    if names.len() == 0 {
        std::ptr::null()
    } else {
        names.as_ptr()
    }
}
