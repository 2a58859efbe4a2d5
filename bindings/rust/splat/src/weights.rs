//! Named tensors of network weights.

use crate::error::{call, Result};
use crate::object::object;
use crate::tensor::{eight, elements};
use crate::text::{bytes, c_path, c_text, text, zeros};
use crate::values::{FoldFlags, WeightsFlags, WeightsFormat, WeightsInfo};
use splat_sys as sys;
use std::ffi::CString;
use std::path::Path;

/// A tensor in the caller's memory, row-major.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NamedArray<'a> {
    /// Key of the tensor.
    pub name: &'a str,
    /// The product of `dims` numbers.
    pub values: &'a [f32],
    /// Outermost first; a 0 means no elements.
    pub dims: &'a [i64],
}

object! {
    /// Named tensors of network weights; needs no device and never changes.
    ///
    /// float32 values of a .safetensors file of 1 MiB or more are not copied: the file stays open
    /// and mapped, and must not be written in place. [`WeightsFlags::COPY`] copies them.
    Weights, splat_weights, splat_weights_destroy
}

// SAFETY: model.h: weights are thread-safe.
unsafe impl Send for Weights {}
// SAFETY: model.h: weights are thread-safe.
unsafe impl Sync for Weights {}

impl Weights {
    /// Load a .safetensors, .pth or .npz file, recognised by its contents. `flags`:
    /// [`WeightsFlags::COPY`].
    /// # Errors
    /// `NotFound`, `Io`, `Format` (damaged, or no weights), `Unsupported`.
    pub fn load(path: impl AsRef<Path>, flags: WeightsFlags) -> Result<Weights> {
        let path = c_path("path", path.as_ref())?;
        Weights::made(|handle| call!(splat_weights_load(path.as_ptr(), flags.0, handle)))
    }

    /// Load weights from the bytes of such a file, which are copied.
    /// # Errors
    /// `NotFound`, `Io`, `Format` (damaged, truncated, or not weights), `Unsupported` (a pickle
    /// that holds more than weights, another number type), `OutOfHostMemory`.
    pub fn load_memory(data: &[u8]) -> Result<Weights> {
        Weights::made(|handle| {
            call!(splat_weights_load_memory(data.as_ptr().cast(), data.len(), handle))
        })
    }

    /// Make weights of arrays, which are copied, in their order.
    ///
    /// ```
    /// use splat::prelude::*;
    /// let array = NamedArray { name: "a", values: &[1.0, 2.0], dims: &[2] };
    /// let weights = Weights::from_arrays(&[array])?;
    /// let bytes = weights.save_memory(WeightsFormat::SAFETENSORS, WeightsFlags::empty())?;
    /// let weights = Weights::load_memory(&bytes)?;
    /// assert_eq!(weights.to_vec(weights.find("a")?)?, [1.0, 2.0]);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `ShapeMismatch` (values do not fit dims), `InvalidArgument` (a rank, a name used
    /// twice).
    pub fn from_arrays(arrays: &[NamedArray<'_>]) -> Result<Weights> {
        let names: Vec<CString> =
            arrays.iter().map(|array| c_text("name", array.name)).collect::<Result<_>>()?;
        let raw: Vec<sys::splat_named_array> = arrays
            .iter()
            .zip(&names)
            .map(|(array, name)| sys::splat_named_array {
                name: name.as_ptr(),
                values: array.values.as_ptr(),
                value_count: array.values.len() as u64,
                dims: eight(array.dims),
                rank: array.dims.len() as u32,
                reserved: 0,
            })
            .collect();
        Weights::made(|handle| {
            call!(splat_weights_from_arrays(raw.as_ptr(), raw.len() as u64, handle))
        })
    }

    /// Write .safetensors or .npz by the extension; the file appears whole or not at all. `flags`:
    /// [`WeightsFlags::HALF`].
    /// # Errors
    /// `InvalidArgument` (values beyond float16, metadata that is no number), `NotFound` (there is
    /// no such folder), `Io` (the file cannot be written, or the mapped one has changed),
    /// `Unsupported` (another extension), `OutOfHostMemory`.
    pub fn save(&self, path: impl AsRef<Path>, flags: WeightsFlags) -> Result<()> {
        let path = c_path("path", path.as_ref())?;
        call!(splat_weights_save(self.handle, path.as_ptr(), flags.0))
    }

    /// The same bytes.
    /// # Errors
    /// `InvalidArgument` (values beyond float16, metadata that is no number), `NotFound` (there is
    /// no such folder), `Io` (the file cannot be written, or the mapped one has changed),
    /// `Unsupported` (another extension), `OutOfHostMemory`.
    pub fn save_memory(&self, format: WeightsFormat, flags: WeightsFlags) -> Result<Vec<u8>> {
        // SAFETY: the buffer lives through the call.
        bytes(|buffer, capacity, needed| unsafe {
            let (format, flags) = (format.0, flags.0);
            sys::splat_weights_save_memory(self.handle, format, flags, buffer, capacity, needed)
        })
    }

    /// Count the tensors.
    /// # Errors
    /// Another version of the library.
    pub fn count(&self) -> Result<u32> {
        let mut count = 0;
        call!(splat_weights_count(self.handle, &mut count))?;
        Ok(count)
    }

    /// Describe a tensor by its index, in the order of the file.
    /// # Errors
    /// `InvalidArgument` (no such index).
    pub fn get_info(&self, index: u32) -> Result<WeightsInfo> {
        let mut info = sys::splat_weights_info::default();
        call!(splat_weights_get_info(self.handle, index, &mut info))?;
        Ok(WeightsInfo::from_raw(&info))
    }

    /// Find the index of a tensor by its name.
    /// # Errors
    /// `NotFound`.
    pub fn find(&self, name: &str) -> Result<u32> {
        let name = c_text("name", name)?;
        let mut index = 0;
        call!(splat_weights_find(self.handle, name.as_ptr(), &mut index))?;
        Ok(index)
    }

    /// Copy the values of a tensor into `values`, which has at least its numbers.
    /// # Errors
    /// `InvalidArgument` (no such index, a slice that is too short), `Io` (the mapped file has
    /// changed).
    pub fn read(&self, index: u32, values: &mut [f32]) -> Result<()> {
        let bytes = std::mem::size_of_val(values);
        call!(splat_weights_read(self.handle, index, values.as_mut_ptr(), bytes))
    }

    /// Copy the values of a tensor into a new vector.
    /// # Errors
    /// As [`Weights::read`].
    pub fn to_vec(&self, index: u32) -> Result<Vec<f32>> {
        let mut values = zeros("values", &[elements(&self.get_info(index)?.dims)])?;
        self.read(index, &mut values)?;
        Ok(values)
    }

    /// Give the values of a tensor without a copy.
    ///
    /// # Safety
    /// No program writes the file of mapped values in place while the slice is used.
    ///
    /// ```compile_fail,E0597
    /// # fn escape() -> splat::Result<()> {
    /// let values = {
    ///     let weights = splat::Weights::from_arrays(&[])?;
    ///     unsafe { weights.data(0)? }
    /// };
    /// println!("{:?}", values);
    /// # Ok(())
    /// # }
    /// ```
    /// # Errors
    /// `InvalidArgument` (no such index, a slice that is too short), `Io` (the mapped file has
    /// changed).
    pub unsafe fn data(&self, index: u32) -> Result<&[f32]> {
        let mut values = std::ptr::null();
        let mut count = 0;
        call!(splat_weights_data(self.handle, index, &mut values, &mut count))?;
        if values.is_null() {
            return Ok(&[]);
        }
        // SAFETY: the library's values live as long as these weights; the caller keeps their file.
        Ok(unsafe { std::slice::from_raw_parts(values, count as usize) })
    }

    /// JSON on the file: format, metadata, warnings, published configurations that fit.
    /// # Errors
    /// Another version of the library.
    pub fn report(&self) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_weights_report(self.handle, buffer, capacity, needed)
        })
    }

    /// Fold low-rank adapters into the weights they belong to: W + alpha / rank * (B A). Without
    /// `adapters`, those among the weights.
    /// # Errors
    /// `ShapeMismatch` (which layer), `InvalidArgument`, `OutOfHostMemory`.
    pub fn fold(
        &self,
        adapters: Option<&Weights>,
        alpha: f64,
        flags: FoldFlags,
    ) -> Result<Weights> {
        let adapters = adapters.map_or(std::ptr::null_mut(), |weights| weights.handle);
        Weights::made(|handle| {
            call!(splat_weights_fold(self.handle, adapters, alpha, flags.0, handle))
        })
    }
}
