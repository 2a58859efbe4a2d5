//! Learned perceptual image patch similarity.

use crate::device::Device;
use crate::error::{call, Result};
use crate::image::ImageView;
use crate::object::{object, Serial};
use crate::text::count;
use crate::weights::Weights;
use splat_sys as sys;

object! {
    /// LPIPS, version 0.1 with VGG16 (Zhang et al. 2018), for images of one size.
    ///
    /// The caller synchronises calls on one object: it can be sent to another thread but not
    /// shared. Evaluators that use it wait for its calls.
    Lpips, splat_lpips, splat_lpips_destroy, serial: Serial
}

// SAFETY: render.h: the caller synchronises calls on one object. It is not Sync, and evaluators
// share `serial`.
unsafe impl Send for Lpips {}

impl Lpips {
    /// Create the network. `weights`: of torchvision's vgg16 and of the lpips package, one file or
    /// two. `side`: pixels, both ways; >= 16.
    ///
    /// Errors: `InvalidArgument` (a missing tensor), `ShapeMismatch`, `Unsupported`, out of memory.
    pub fn create(device: &Device, weights: &[&Weights], side: u32) -> Result<Lpips> {
        let handles: Vec<sys::splat_weights> = weights.iter().map(|file| file.handle).collect();
        let raw = sys::splat_lpips_desc {
            weights: handles.as_ptr(),
            weight_count: count("weights", handles.len())?,
            side,
            ..Default::default()
        };
        let mut handle = std::ptr::null_mut();
        call!(splat_lpips_create(device.handle, &raw, &mut handle))?;
        Ok(Lpips {
            handle,
            serial: Serial::new(),
        })
    }

    /// The distance of two RGB images of `side` x `side` pixels with values nominally 0 to 1; equal
    /// images have 0.
    ///
    /// Errors: `ShapeMismatch` for another size, `InvalidArgument` for a slice that is too short and
    /// for numbers that are not finite, errors of the device.
    pub fn compare(&self, a: ImageView, b: ImageView) -> Result<f64> {
        let (a, b) = (a.to_raw(), b.to_raw());
        let mut value = 0.0;
        let _lock = self.serial.lock();
        call!(splat_lpips_compare(self.handle, &a, &b, &mut value))?;
        Ok(value)
    }
}
