//! Images in memory, in files, and their scores.

use crate::device::Device;
use crate::error::{call, Error, Result};
use crate::object::{object, Serial};
use crate::text::{bytes, c_path, count, zeros, Plain};
use crate::values::{ImageFormat, ImageInfo, ImageScores, Pixel};
use crate::weights::Weights;
use splat_sys as sys;
use std::fmt;
use std::marker::PhantomData;
use std::os::raw::c_void;
use std::path::Path;

/// Types of samples: `u8` (0 to 255 stand for 0 to 1), `u16` (the bits of a float16) and `f32`.
///
/// # Safety
/// `PIXEL` has the size of the type, and every pattern of bits is a value.
pub unsafe trait Sample: Plain + Default + 'static {
    /// Name of the type in C.
    const PIXEL: Pixel;
}

// SAFETY: 1 byte, all patterns.
unsafe impl Sample for u8 {
    const PIXEL: Pixel = Pixel::U8;
}
// SAFETY: 2 bytes, all patterns.
unsafe impl Sample for u16 {
    const PIXEL: Pixel = Pixel::F16;
}
// SAFETY: 4 bytes, all patterns.
unsafe impl Sample for f32 {
    const PIXEL: Pixel = Pixel::F32;
}

fn raw<T: Sample>(
    pixels: *mut c_void,
    samples: usize,
    [width, height]: [u32; 2],
    channels: u32,
) -> Result<sys::splat_image> {
    if samples == 0 {
        return Err(Error::argument(format!(
            "the slice is empty, an image of {width} x {height} pixels and {channels} channels \
             needs samples"
        )));
    }
    Ok(sys::splat_image {
        pixels,
        bytes: samples * std::mem::size_of::<T>(),
        type_: T::PIXEL.0,
        width,
        height,
        channels,
        ..Default::default()
    })
}

/// Pixels of the caller that are read, in any layout that strides describe. Views are equal if they
/// show the same memory alike.
///
/// ```compile_fail,E0597
/// let view = {
///     let pixels = vec![0_u8; 12];
///     splat::ImageView::new(&pixels, [2, 2], 3)?
/// };
/// println!("{:?}", view);
/// # Ok::<(), splat::Error>(())
/// ```
#[derive(Clone, Copy, PartialEq)]
#[must_use]
pub struct ImageView<'a> {
    raw: sys::splat_image,
    lives: PhantomData<&'a [u8]>,
}

// SAFETY: a borrow of a slice that is only read.
unsafe impl Send for ImageView<'_> {}
// SAFETY: as above.
unsafe impl Sync for ImageView<'_> {}

impl<'a> ImageView<'a> {
    /// Packed rows of interleaved channels. Calls check the length.
    ///
    /// `size`: width and height in pixels. `channels`: 1 to 4.
    /// # Errors
    /// `InvalidArgument` for an empty slice.
    pub fn new<T: Sample>(pixels: &'a [T], size: [u32; 2], channels: u32) -> Result<Self> {
        let raw = raw::<T>(pixels.as_ptr() as *mut c_void, pixels.len(), size, channels)?;
        Ok(ImageView { raw, lives: PhantomData })
    }

    /// Bytes from one row, pixel and channel to the next, all >= 0.
    pub fn strides(mut self, row: u64, pixel: u64, channel: u64) -> Self {
        set_strides(&mut self.raw, [row, pixel, channel]);
        self
    }

    pub(crate) fn to_raw(self) -> sys::splat_image {
        self.raw
    }
}

/// Pixels of the caller that are written.
#[derive(PartialEq)]
#[must_use]
pub struct ImageViewMut<'a> {
    raw: sys::splat_image,
    lives: PhantomData<&'a mut [u8]>,
}

// SAFETY: a borrow of a slice that is only this one's.
unsafe impl Send for ImageViewMut<'_> {}

impl<'a> ImageViewMut<'a> {
    /// See [`ImageView::new`].
    /// # Errors
    /// As [`ImageView::new`].
    pub fn new<T: Sample>(pixels: &'a mut [T], size: [u32; 2], channels: u32) -> Result<Self> {
        let raw = raw::<T>(pixels.as_mut_ptr().cast(), pixels.len(), size, channels)?;
        Ok(ImageViewMut { raw, lives: PhantomData })
    }

    /// Like [`ImageView::strides`], but no two samples may share a place.
    pub fn strides(mut self, row: u64, pixel: u64, channel: u64) -> Self {
        set_strides(&mut self.raw, [row, pixel, channel]);
        self
    }

    pub(crate) fn to_raw(&self) -> sys::splat_image {
        self.raw
    }
}

/// Type, size and strides, without the address.
fn debug(f: &mut fmt::Formatter<'_>, name: &str, raw: &sys::splat_image) -> fmt::Result {
    f.debug_struct(name)
        .field("pixel", &Pixel(raw.type_))
        .field("size", &[raw.width, raw.height])
        .field("channels", &raw.channels)
        .field("bytes", &raw.bytes)
        .field("strides", &[raw.row_stride, raw.pixel_stride, raw.channel_stride])
        .finish()
}

impl fmt::Debug for ImageView<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        debug(f, "ImageView", &self.raw)
    }
}

impl fmt::Debug for ImageViewMut<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        debug(f, "ImageViewMut", &self.raw)
    }
}

/// Strides beyond i64 become its highest, which no slice has room for.
fn set_strides(raw: &mut sys::splat_image, strides: [u64; 3]) {
    let [row, pixel, channel] = strides.map(|stride| i64::try_from(stride).unwrap_or(i64::MAX));
    raw.row_stride = row;
    raw.pixel_stride = pixel;
    raw.channel_stride = channel;
}

/// An image with packed rows of interleaved channels. Functions take any layout as
/// [`ImageView`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image<T> {
    /// `[height, width, channels]`
    pub pixels: Vec<T>,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// 1 to 4: gray, gray and alpha, RGB, RGB and alpha.
    pub channels: u32,
}

impl<T: Sample> Image<T> {
    /// An image of zeros. `size`: width and height in pixels. `channels`: 1 to 4.
    ///
    ///
    /// ```
    /// use splat::prelude::*;
    /// use splat::image;
    /// let mut picture = Image::<u8>::new([4, 3], 3)?;
    /// picture.pixels[0] = 255;
    /// let png = image::save_memory(picture.view()?, ImageFormat::PNG)?;
    /// assert_eq!(Image::<u8>::load_memory(&png, 0)?.0, picture);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (other channels), `OutOfHostMemory`.
    pub fn new([width, height]: [u32; 2], channels: u32) -> Result<Self> {
        if !(1..=4).contains(&channels) {
            let message = format!("channels: {channels}, expected 1 to 4");
            return Err(Error::argument(message));
        }
        let sizes = [height, width, channels].map(|size| size as usize);
        Ok(Image { pixels: zeros("size", &sizes)?, width, height, channels })
    }

    /// Read an image file: PNG, JPEG, WebP or .npy. `channels`: 0 for those of the file; gray fills
    /// RGB, and a missing alpha is opaque.
    /// # Errors
    /// `NotFound`, `Io`, `Format` (damaged), `Unsupported`, `ShapeMismatch` (channels of
    /// the file have no place).
    pub fn load(path: impl AsRef<Path>, channels: u32) -> Result<(Self, ImageInfo)> {
        let path = c_path("path", path.as_ref())?;
        Self::read(channels, |image, info| call!(splat_image_load(path.as_ptr(), image, info)))
    }

    /// The same from the bytes of such a file.
    /// # Errors
    /// `InvalidArgument` (a field of the image), `ShapeMismatch` (another size, or channels of the
    /// file have no place), `NotFound`, `Io`, `Format` (damaged, truncated or no image),
    /// `Unsupported` (CMYK, an animated WebP, a side above 16384, another type of .npy),
    /// `OutOfHostMemory`.
    pub fn load_memory(data: &[u8], channels: u32) -> Result<(Self, ImageInfo)> {
        let pointer = data.as_ptr().cast();
        Self::read(channels, |image, info| {
            call!(splat_image_load_memory(pointer, data.len(), image, info))
        })
    }

    fn read(
        channels: u32,
        call: impl Fn(*mut sys::splat_image, *mut sys::splat_image_info) -> Result<()>,
    ) -> Result<(Self, ImageInfo)> {
        let mut header = sys::splat_image { type_: T::PIXEL.0, ..Default::default() };
        let mut info = sys::splat_image_info::default();
        call(&mut header, &mut info)?;
        let channels = if channels == 0 { header.channels } else { channels };
        let mut image = Image::<T>::new([header.width, header.height], channels)?;
        let mut raw = image.view_mut()?.to_raw();
        call(&mut raw, &mut info)?;
        Ok((image, ImageInfo::from_raw(&info)))
    }

    /// The image as functions take it.
    /// # Errors
    /// `InvalidArgument` for an image without samples.
    pub fn view(&self) -> Result<ImageView<'_>> {
        ImageView::new(&self.pixels, [self.width, self.height], self.channels)
    }

    /// The image to be written.
    /// # Errors
    /// As [`Image::view`].
    pub fn view_mut(&mut self) -> Result<ImageViewMut<'_>> {
        let size = [self.width, self.height];
        ImageViewMut::new(&mut self.pixels, size, self.channels)
    }
}

/// Write an image by the extension of the path: .png or .npy. The file appears whole or not at all.
/// # Errors
/// `InvalidArgument` (a field of the image), `NotFound` (there is no such folder), `Io` (the file
/// cannot be written, e.g. the disk is full), `Unsupported` (another extension), `OutOfHostMemory`.
pub fn save(path: impl AsRef<Path>, image: ImageView<'_>) -> Result<()> {
    let path = c_path("path", path.as_ref())?;
    call!(splat_image_save(path.as_ptr(), &image.to_raw()))
}

/// The same bytes. `format`: [`ImageFormat::PNG`] or [`ImageFormat::NPY`].
/// # Errors
/// `InvalidArgument` (a field of the image), `NotFound` (there is no such folder), `Io` (the file
/// cannot be written, e.g. the disk is full), `Unsupported` (another extension), `OutOfHostMemory`.
pub fn save_memory(image: ImageView<'_>, format: ImageFormat) -> Result<Vec<u8>> {
    let image = image.to_raw();
    // SAFETY: image and buffer live through the call.
    bytes(|buffer, capacity, needed| unsafe {
        sys::splat_image_save_memory(&image, format.0, buffer, capacity, needed)
    })
}

/// Write images of one size as an animation that repeats for ever: .png, .gif or .webp.
/// `milliseconds`: of each frame, 1 to 65535.
/// # Errors
/// `Unsupported` (another extension), `InvalidArgument` (a field of the image), `NotFound` (there
/// is no such folder), `Io` (the file cannot be written, e.g. the disk is full), `OutOfHostMemory`.
pub fn save_animation(
    path: impl AsRef<Path>,
    frames: &[ImageView<'_>],
    milliseconds: u32,
) -> Result<()> {
    let path = c_path("path", path.as_ref())?;
    let length = count("frames", frames.len())?;
    let frames: Vec<sys::splat_image> = frames.iter().map(|frame| frame.to_raw()).collect();
    call!(splat_image_save_animation(path.as_ptr(), frames.as_ptr(), length, milliseconds))
}

/// The same bytes. `format`: [`ImageFormat::PNG`], [`ImageFormat::GIF`] or
/// [`ImageFormat::WEBP`].
/// # Errors
/// `Unsupported` (another extension), `InvalidArgument` (a field of the image), `NotFound` (there
/// is no such folder), `Io` (the file cannot be written, e.g. the disk is full), `OutOfHostMemory`.
pub fn save_animation_memory(
    frames: &[ImageView<'_>],
    milliseconds: u32,
    format: ImageFormat,
) -> Result<Vec<u8>> {
    let length = count("frames", frames.len())?;
    let frames: Vec<sys::splat_image> = frames.iter().map(|frame| frame.to_raw()).collect();
    // SAFETY: frames and buffer live through the call.
    bytes(|buffer, capacity, needed| unsafe {
        sys::splat_image_save_animation_memory(
            frames.as_ptr(),
            length,
            milliseconds,
            format.0,
            buffer,
            capacity,
            needed,
        )
    })
}

/// Compare two images of one size: PSNR and SSIM. Alpha counts as any other channel.
///
/// ```
/// use splat::prelude::*;
/// let (a, b) = (vec![0.5_f32; 16 * 16], vec![0.6_f32; 16 * 16]);
/// let view = |pixels| ImageView::new(pixels, [16, 16], 1);
/// let scores = splat::image::compare(view(&a)?, view(&b)?)?;
/// assert!((scores.psnr - 20.0).abs() < 1e-4);
/// # Ok::<(), splat::Error>(())
/// ```
/// # Errors
/// `ShapeMismatch` for two sizes, `InvalidArgument` for a slice that is too short and for
/// numbers that are not finite.
pub fn compare(a: ImageView, b: ImageView) -> Result<ImageScores> {
    let mut scores = sys::splat_image_scores::default();
    call!(splat_image_compare(&a.raw, &b.raw, &mut scores))?;
    Ok(ImageScores::from_raw(&scores))
}

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
    /// # Errors
    /// `InvalidArgument` (a missing tensor), `ShapeMismatch`, `Unsupported`, out of memory.
    pub fn create(device: &Device, weights: &[&Weights], side: u32) -> Result<Lpips> {
        let handles: Vec<sys::splat_weights> = weights.iter().map(|file| file.handle).collect();
        let raw = sys::splat_lpips_desc {
            weights: handles.as_ptr(),
            weight_count: count("weights", handles.len())?,
            side,
            ..Default::default()
        };
        Lpips::made(|handle| call!(splat_lpips_create(device.handle, &raw, handle)))
    }

    /// The distance of two RGB images of `side` x `side` pixels with values nominally 0 to 1; equal
    /// images have 0.
    /// # Errors
    /// `ShapeMismatch` for another size, `InvalidArgument` for a slice that is too short and
    /// for numbers that are not finite, errors of the device.
    pub fn compare(&self, a: ImageView, b: ImageView) -> Result<f64> {
        let (a, b) = (a.to_raw(), b.to_raw());
        let mut value = 0.0;
        self.serial.with(|| {
            call!(splat_lpips_compare(self.handle, &a, &b, &mut value))?;
            Ok(value)
        })
    }
}
