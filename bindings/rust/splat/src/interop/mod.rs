//! What the optional features bring: conversions from and to types of other crates.

#[cfg(feature = "glam")]
mod with_glam {
    use crate::values::{Camera, Similarity};
    use glam::{DAffine3, DMat4, DQuat, DVec3};

    /// Matrices of glam are column-major; those of this crate are row-major.
    impl Camera {
        /// The matrix of [`Camera::world_to_camera`] for glam. `.as_mat4()` makes it one of f32.
        #[must_use]
        pub fn world_to_camera_mat4(&self) -> DMat4 {
            DMat4::from_cols_array(&self.world_to_camera).transpose()
        }

        /// Set the pose. A matrix of f32: `.as_dmat4()`.
        pub fn set_world_to_camera_mat4(&mut self, matrix: DMat4) {
            self.world_to_camera = matrix.transpose().to_cols_array();
        }

        /// Where the camera is, in the world.
        #[must_use]
        pub fn position(&self) -> DVec3 {
            self.world_to_camera_mat4().inverse().w_axis.truncate()
        }
    }

    impl From<Similarity> for DAffine3 {
        fn from(own: Similarity) -> Self {
            let [w, x, y, z] = own.rotation;
            let turn = DQuat::from_xyzw(x, y, z, w).normalize();
            let scale = DVec3::splat(own.scale);
            DAffine3::from_scale_rotation_translation(scale, turn, own.translation.into())
        }
    }
}

#[cfg(feature = "bytemuck")]
mod with_bytemuck {
    use crate::values::{Camera, Similarity};

    // SAFETY: C's layout, numbers without gaps (values.rs compares the sizes), all bits are values.
    unsafe impl bytemuck::Zeroable for Camera {}
    // SAFETY: as above.
    unsafe impl bytemuck::Pod for Camera {}
    // SAFETY: as above.
    unsafe impl bytemuck::Zeroable for Similarity {}
    // SAFETY: as above.
    unsafe impl bytemuck::Pod for Similarity {}

    const _: () = assert!(std::mem::size_of::<Camera>() == 2 * 4 + 20 * 8);
    const _: () = assert!(std::mem::size_of::<Similarity>() == 8 * 8);
}

#[cfg(feature = "image")]
mod with_image {
    use crate::error::{Error, Result};
    use crate::image::{Image, ImageView, Sample};
    use crate::values::Code;
    use image::{DynamicImage, ImageBuffer, Pixel, Primitive};

    /// Samples that mean the same in both crates: u16 is float16 here.
    pub trait Shared: Sample + Primitive {}
    impl Shared for u8 {}
    impl Shared for f32 {}

    type Buffer<P> = ImageBuffer<P, Vec<<P as Pixel>::Subpixel>>;

    impl<P: Pixel> From<Buffer<P>> for Image<P::Subpixel>
    where
        P::Subpixel: Shared,
    {
        fn from(buffer: Buffer<P>) -> Self {
            let (width, height) = buffer.dimensions();
            let channels = u32::from(P::CHANNEL_COUNT);
            let mut pixels = buffer.into_raw();
            pixels.truncate(width as usize * height as usize * channels as usize);
            Image { pixels, width, height, channels }
        }
    }

    /// The channels of the picture, 8 bits each.
    impl From<DynamicImage> for Image<u8> {
        fn from(picture: DynamicImage) -> Self {
            match picture.color().channel_count() {
                1 => picture.into_luma8().into(),
                2 => picture.into_luma_alpha8().into(),
                3 => picture.into_rgb8().into(),
                _ => picture.into_rgba8().into(),
            }
        }
    }

    /// `ShapeMismatch` for another number of channels, or of samples.
    impl<P: Pixel> TryFrom<Image<P::Subpixel>> for Buffer<P>
    where
        P::Subpixel: Shared,
    {
        type Error = Error;

        fn try_from(own: Image<P::Subpixel>) -> Result<Self> {
            let Image { pixels, width, height, channels } = own;
            let expected = u32::from(P::CHANNEL_COUNT);
            let message = format!(
                "image: {channels} channels, expected {expected}, and the samples of all pixels"
            );
            let made =
                ImageBuffer::from_raw(width, height, pixels).filter(|_| channels == expected);
            made.ok_or_else(|| Error::new(Code::ShapeMismatch, message))
        }
    }

    /// Fails where [`ImageView::new`] does.
    impl<'a, P: Pixel> TryFrom<&'a Buffer<P>> for ImageView<'a>
    where
        P::Subpixel: Shared,
    {
        type Error = Error;

        fn try_from(buffer: &'a Buffer<P>) -> Result<Self> {
            let (width, height) = buffer.dimensions();
            ImageView::new(buffer, [width, height], u32::from(P::CHANNEL_COUNT))
        }
    }
}

#[cfg(feature = "ndarray")]
mod with_ndarray {
    use crate::device::Device;
    use crate::error::{Error, Result};
    use crate::image::{Image, ImageView, Sample};
    use crate::tensor::{Element, Tensor};
    use crate::values::Code;
    use ndarray::{Array3, ArrayD, ArrayView, ArrayView3, Dimension};

    fn wrong(error: impl std::fmt::Display) -> Error {
        Error::new(Code::ShapeMismatch, format!("array: {error}"))
    }

    fn side(size: usize) -> Result<u32> {
        u32::try_from(size)
            .map_err(|_| wrong(format!("{size} pixels or channels, expected less than 2^32")))
    }

    /// `array[[row, column, channel]]`; `ShapeMismatch` if the image has not the samples of all pixels.
    impl<T: Sample> TryFrom<Image<T>> for Array3<T> {
        type Error = Error;

        fn try_from(own: Image<T>) -> Result<Self> {
            let shape = [own.height, own.width, own.channels].map(|size| size as usize);
            Array3::from_shape_vec(shape, own.pixels).map_err(wrong)
        }
    }

    /// `array[[row, column, channel]]`, in any layout.
    impl<T: Sample> TryFrom<ArrayView3<'_, T>> for Image<T> {
        type Error = Error;

        fn try_from(array: ArrayView3<'_, T>) -> Result<Self> {
            let (height, width, channels) = array.dim();
            let (height, width, channels) = (side(height)?, side(width)?, side(channels)?);
            Ok(Image { pixels: array.iter().copied().collect(), width, height, channels })
        }
    }

    /// `array[[row, column, channel]]`, also of permuted axes; `InvalidArgument` for reversed axes and for a part of
    /// an array.
    impl<'a, T: Sample> TryFrom<ArrayView3<'a, T>> for ImageView<'a> {
        type Error = Error;

        fn try_from(array: ArrayView3<'a, T>) -> Result<Self> {
            let (height, width, channels) = array.dim();
            let place = || {
                let mut strides = [0; 3];
                for (to, &stride) in strides.iter_mut().zip(array.strides()) {
                    *to = u64::try_from(stride).ok()? * std::mem::size_of::<T>() as u64;
                }
                Some((array.to_slice_memory_order()?, strides))
            };
            let (pixels, [row, pixel, channel]) = place().ok_or_else(|| {
                Error::argument(
                    "array: a part of one, or with reversed axes: copy it by to_owned()",
                )
            })?;
            let view = ImageView::new(pixels, [side(width)?, side(height)?], side(channels)?)?;
            Ok(view.strides(row, pixel, channel))
        }
    }

    impl Tensor {
        /// Create a tensor with the dimensions and values of an array, in any layout: `&array.view()`.
        /// # Errors
        /// As [`Tensor::from_host`].
        pub fn from_array<T: Element, D: Dimension>(
            device: &Device,
            array: &ArrayView<'_, T, D>,
        ) -> Result<Tensor> {
            let dims: Vec<i64> = array.shape().iter().map(|&size| size as i64).collect();
            let packed = array.as_standard_layout();
            Tensor::from_slice(device, &dims, packed.as_slice().unwrap_or_default())
        }

        /// Copy the values to an array of the same dimensions.
        /// # Errors
        /// As [`Tensor::to_vec`].
        pub fn to_array<T: Element>(&self) -> Result<ArrayD<T>> {
            let shape: Vec<usize> = self.dims().iter().map(|&size| size as usize).collect();
            ArrayD::from_shape_vec(shape, self.to_vec()?).map_err(wrong)
        }
    }
}
