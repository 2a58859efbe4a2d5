//! Tensors.

use crate::device::Device;
use crate::error::{call, Error, Result};
use crate::log::{dropping, held};
use crate::object::object;
use crate::text::{c_optional, pointer};
use crate::values::{Access, Code, Dtype, TensorInfo, TensorStats};
use splat_sys as sys;
use std::marker::PhantomData;
use std::os::raw::{c_char, c_void};

/// Numbers that a tensor can hold.
///
/// # Safety
/// `DTYPE` has the size of the type, and every pattern of bits is a value.
pub unsafe trait Element: Copy + Default + 'static {
    /// Name of the type in C.
    const DTYPE: Dtype;
}

// SAFETY: 4 bytes, all patterns.
unsafe impl Element for f32 {
    const DTYPE: Dtype = Dtype::F32;
}
// SAFETY: 4 bytes, all patterns.
unsafe impl Element for i32 {
    const DTYPE: Dtype = Dtype::I32;
}
// SAFETY: 4 bytes, all patterns.
unsafe impl Element for u32 {
    const DTYPE: Dtype = Dtype::U32;
}

/// What a new tensor is like.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TensorDesc {
    /// Used in messages.
    pub name: Option<String>,
    /// The default is [`Dtype::F32`].
    pub dtype: Dtype,
    /// Elements, outermost first; none makes a scalar.
    pub dims: Vec<i64>,
}

object! {
    /// An array of numbers on a device.
    Tensor, splat_tensor, splat_tensor_destroy, dtype: Dtype, dims: Vec<i64>
}

// SAFETY: core.h: a tensor is thread-safe.
unsafe impl Send for Tensor {}
// SAFETY: core.h: a tensor is thread-safe.
unsafe impl Sync for Tensor {}

impl Tensor {
    /// Create a tensor of zeros, row-major and contiguous.
    ///
    /// Errors: `InvalidArgument` (more than 8 dimensions, one below 1, 2^31 elements),
    /// `Unsupported` (beyond the device's limit), and out of memory.
    pub fn create(device: &Device, desc: &TensorDesc) -> Result<Tensor> {
        let name = c_optional("name", desc.name.as_deref())?;
        let raw = raw_desc(desc, pointer(&name));
        Tensor::wrap(|handle| call!(splat_tensor_create(device.handle, &raw, handle)))
    }

    /// Create a tensor and fill it as [`Tensor::write`] does. `desc.dtype` may be left out.
    pub fn from_host<T: Element>(
        device: &Device,
        desc: &TensorDesc,
        data: &[T],
        strides: Option<&[i64]>,
    ) -> Result<Tensor> {
        let desc = TensorDesc {
            dtype: of_slice::<T>(desc)?,
            ..desc.clone()
        };
        let strides = check_slice("data", &desc.dims, data.len(), strides)?;
        let name = c_optional("name", desc.name.as_deref())?;
        let raw = raw_desc(&desc, pointer(&name));
        let bytes = std::mem::size_of_val(data);
        let data = data.as_ptr().cast();
        Tensor::wrap(|handle| {
            call!(splat_tensor_from_host(
                device.handle,
                &raw,
                data,
                bytes,
                strides,
                handle
            ))
        })
    }

    /// Create a tensor of `dims` with row-major values.
    pub fn from_slice<T: Element>(device: &Device, dims: &[i64], data: &[T]) -> Result<Tensor> {
        let desc = TensorDesc {
            dims: dims.to_vec(),
            ..Default::default()
        };
        Tensor::from_host(device, &desc, data, None)
    }

    /// Own a new tensor, whose type and shape never change.
    pub(crate) fn wrap(make: impl FnOnce(*mut sys::splat_tensor) -> Result<()>) -> Result<Tensor> {
        held(|| {
            let mut tensor = Tensor::made(make)?;
            let info = tensor.get_info()?;
            tensor.dtype = info.dtype;
            tensor.dims = info.dims;
            Ok(tensor)
        })
    }

    /// Dimensions, outermost first.
    pub fn dims(&self) -> &[i64] {
        &self.dims
    }

    /// The type of its elements.
    pub fn dtype(&self) -> Dtype {
        self.dtype
    }

    /// The number of its elements.
    pub fn elements(&self) -> usize {
        elements(&self.dims)
    }

    /// Copy numbers into the tensor. Without strides `data` has exactly its elements, row-major.
    ///
    /// `strides`: elements between neighbours, one for each dimension, >= 0.
    /// Errors: `ShapeMismatch` (another number of elements or strides), `InvalidArgument` (another
    /// type, strides that reach beyond `data`), `InvalidState` (mapped), errors of the device.
    pub fn write<T: Element>(&self, data: &[T], strides: Option<&[i64]>) -> Result<()> {
        self.check_type::<T>()?;
        let strides = check_slice("data", &self.dims, data.len(), strides)?;
        let bytes = std::mem::size_of_val(data);
        call!(splat_tensor_write(
            self.handle,
            data.as_ptr().cast(),
            bytes,
            strides
        ))
    }

    /// Copy the tensor into `data`, which stays untouched on an error. Strides as in
    /// [`Tensor::write`], but no two elements may share a place.
    pub fn read<T: Element>(&self, data: &mut [T], strides: Option<&[i64]>) -> Result<()> {
        self.check_type::<T>()?;
        let strides = check_slice("data", &self.dims, data.len(), strides)?;
        let bytes = std::mem::size_of_val(data);
        call!(splat_tensor_read(
            self.handle,
            data.as_mut_ptr().cast(),
            bytes,
            strides
        ))
    }

    /// Copy the tensor into a new vector, row-major.
    pub fn to_vec<T: Element>(&self) -> Result<Vec<T>> {
        let mut data = vec![T::default(); self.elements()];
        self.read(&mut data, None)?;
        Ok(data)
    }

    /// Give the host the tensor's elements until the mapping is dropped. Meanwhile other calls with
    /// this tensor return `InvalidState`. With [`Access::WRITE`] the contents are undefined until
    /// written.
    pub fn map(&self, access: Access) -> Result<Mapping<'_>> {
        let mut pointer = std::ptr::null_mut();
        let mut bytes = 0;
        call!(splat_tensor_map(
            self.handle,
            access.0,
            &mut pointer,
            &mut bytes
        ))?;
        Ok(Mapping {
            tensor: self,
            access,
            pointer,
            bytes,
            lives: PhantomData,
        })
    }

    /// A pointer to the elements, row-major, and their bytes, good until the tensor is dropped. No
    /// call that uses the tensor may run on another thread while it is followed.
    ///
    /// Errors: `Unsupported` where the device's memory is not the host's.
    pub fn host_pointer(&self) -> Result<(*mut c_void, usize)> {
        let mut pointer = std::ptr::null_mut();
        let mut bytes = 0;
        call!(splat_tensor_host_pointer(
            self.handle,
            &mut pointer,
            &mut bytes
        ))?;
        Ok((pointer, bytes))
    }

    /// Share the memory as a DLPack tensor on the CPU. The caller must call its deleter once.
    ///
    /// Errors: as [`Tensor::host_pointer`].
    pub fn to_dlpack(&self) -> Result<*mut sys::DLManagedTensorVersioned> {
        let mut managed = std::ptr::null_mut();
        call!(splat_tensor_to_dlpack(self.handle, &mut managed))?;
        Ok(managed)
    }

    /// Describe the tensor.
    pub fn get_info(&self) -> Result<TensorInfo> {
        let mut info = sys::splat_tensor_info::default();
        call!(splat_tensor_get_info(self.handle, &mut info))?;
        Ok(TensorInfo::from_raw(&info))
    }

    /// Measure a tensor of [`Dtype::F32`] on the device.
    pub fn check(&self) -> Result<TensorStats> {
        let mut stats = sys::splat_tensor_stats::default();
        call!(splat_tensor_check(self.handle, &mut stats))?;
        Ok(TensorStats::from_raw(&stats))
    }

    fn check_type<T: Element>(&self) -> Result<()> {
        if self.dtype == T::DTYPE {
            return Ok(());
        }
        Err(Error::argument(format!(
            "the tensor holds {:?}, the slice {:?}; use a slice of the tensor's type",
            self.dtype,
            T::DTYPE
        )))
    }
}

/// A tensor's elements in host memory. Dropping it ends the mapping.
///
/// It cannot outlive the tensor:
///
/// ```compile_fail,E0597
/// # fn escape(device: &splat::Device) -> splat::Result<()> {
/// let mapping = {
///     let tensor = splat::Tensor::from_slice(device, &[2], &[1.0_f32, 2.0])?;
///     tensor.map(splat::Access::READ)?
/// };
/// println!("{:?}", mapping.as_slice::<f32>()?);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Mapping<'a> {
    tensor: &'a Tensor,
    access: Access,
    pointer: *mut c_void,
    bytes: usize,
    lives: PhantomData<&'a mut [u8]>,
}

impl Mapping<'_> {
    /// The elements, row-major.
    ///
    /// Errors: `InvalidArgument` for another type than the tensor's.
    pub fn as_slice<T: Element>(&self) -> Result<&[T]> {
        self.tensor.check_type::<T>()?;
        let length = self.bytes / std::mem::size_of::<T>();
        // SAFETY: the library refuses other calls with a mapped tensor or its memory, which it keeps.
        Ok(unsafe { std::slice::from_raw_parts(self.pointer.cast(), length) })
    }

    /// The elements, to be written.
    ///
    /// Errors: `InvalidArgument` for another type than the tensor's, `InvalidState` without write
    /// access.
    pub fn as_mut_slice<T: Element>(&mut self) -> Result<&mut [T]> {
        self.tensor.check_type::<T>()?;
        if self.access == Access::READ {
            return Err(Error::new(
                Code::InvalidState,
                "the tensor is mapped to be read only; map it with Access::READ_WRITE",
            ));
        }
        let length = self.bytes / std::mem::size_of::<T>();
        // SAFETY: as in as_slice; this mapping is borrowed alone.
        Ok(unsafe { std::slice::from_raw_parts_mut(self.pointer.cast(), length) })
    }

    /// End the mapping and tell whether that worked; written values are the tensor's then.
    pub fn unmap(self) -> Result<()> {
        let handle = self.tensor.handle;
        std::mem::forget(self);
        call!(splat_tensor_unmap(handle))
    }
}

impl Drop for Mapping<'_> {
    fn drop(&mut self) {
        // SAFETY: the tensor is alive and mapped. An error of the device shows in its next call.
        dropping(|| unsafe { sys::splat_tensor_unmap(self.tensor.handle) });
    }
}

pub(crate) fn elements(dims: &[i64]) -> usize {
    let sizes = dims.iter().map(|&dim| usize::try_from(dim).unwrap_or(0));
    sizes.fold(1, usize::saturating_mul)
}

fn of_slice<T: Element>(desc: &TensorDesc) -> Result<Dtype> {
    if desc.dtype == Dtype::default() || desc.dtype == T::DTYPE {
        return Ok(T::DTYPE);
    }
    Err(Error::argument(format!(
        "desc.dtype is {:?}, the slice holds {:?}; leave desc.dtype out",
        desc.dtype,
        T::DTYPE
    )))
}

fn raw_desc(desc: &TensorDesc, name: *const c_char) -> sys::splat_tensor_desc {
    sys::splat_tensor_desc {
        name,
        dtype: desc.dtype.0,
        rank: desc.dims.len() as u32,
        dims: eight(&desc.dims),
        ..Default::default()
    }
}

/// The first eight dimensions; the library refuses a higher rank.
pub(crate) fn eight(dims: &[i64]) -> [i64; sys::SPLAT_MAX_RANK] {
    let mut array = [0; sys::SPLAT_MAX_RANK];
    array
        .iter_mut()
        .zip(dims)
        .for_each(|(place, &dim)| *place = dim);
    array
}

/// Check a slice against a shape. The library checks how far strides reach.
fn check_slice(
    argument: &str,
    dims: &[i64],
    length: usize,
    strides: Option<&[i64]>,
) -> Result<*const i64> {
    let refuse = |got: usize, expected: usize, what: &str| {
        Err(Error::new(
            Code::ShapeMismatch,
            format!("{argument}: {got} {what}, a tensor of {dims:?} needs {expected}"),
        ))
    };
    match strides {
        Some(strides) if strides.len() != dims.len() => {
            refuse(strides.len(), dims.len(), "strides")
        }
        Some(strides) => Ok(strides.as_ptr()),
        None if length != elements(dims) => refuse(length, elements(dims), "elements"),
        None => Ok(std::ptr::null()),
    }
}
