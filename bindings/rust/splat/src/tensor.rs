//! Tensors.

use crate::device::Device;
use crate::error::{call, Error, Result};
use crate::log::{dropping, held};
use crate::object::object;
use crate::text::{c_optional, pointer, zeros, Plain};
use crate::values::{Access, Code, Dtype, TensorInfo, TensorStats};
use splat_sys as sys;
use std::fmt;
use std::os::raw::{c_char, c_void};

/// Numbers that a tensor can hold.
///
/// # Safety
/// `DTYPE` has the size of the type, and every pattern of bits is a value.
pub unsafe trait Element: Plain + Default + 'static {
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
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct TensorDesc {
    /// Used in messages.
    pub name: Option<String>,
    /// The default is [`Dtype::F32`].
    pub dtype: Dtype,
    /// Elements, outermost first; none makes a scalar.
    pub dims: Vec<i64>,
    /// In an allocation of its own, for [`Tensor::export`].
    pub exportable: bool,
}

/// Memory of a device, as one API or process gives it to another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExternalMemory {
    /// A file descriptor; on Windows (never tried) an NT handle.
    pub handle: i64,
    /// Bytes of the whole allocation.
    pub memory_bytes: u64,
    /// Bytes from its start to the first element.
    pub offset: u64,
    /// 1 + Vulkan's index of its type of memory; 0: not known.
    pub memory_type: u32,
    /// Vulkan's, on NVIDIA also CUDA's; zeros: not checked.
    pub device_uuid: [u8; 16],
    /// Vulkan's; zeros: not checked.
    pub driver_uuid: [u8; 16],
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
    /// # Errors
    /// `InvalidArgument` (more than 8 dimensions, one below 1, 2^31 elements),
    /// `Unsupported` (beyond the device's limit), and out of memory.
    pub fn create(device: &Device, desc: &TensorDesc) -> Result<Tensor> {
        let name = c_optional("name", desc.name.as_deref())?;
        let raw = raw_desc(desc, pointer(&name));
        Tensor::wrap(|handle| call!(splat_tensor_create(device.handle, &raw, handle)))
    }

    /// Create a tensor and fill it as [`Tensor::write`] does. `desc.dtype` may be left out.
    /// # Errors
    /// `InvalidArgument` (rank, dtype, a dimension < 1, or 2^31 elements or more), `Unsupported`
    /// (more bytes than max_storage_buffer_bytes of the device), `InvalidState` (the tensor is
    /// mapped), `OutOfHostMemory`, errors of the device.
    pub fn from_host<T: Element>(
        device: &Device,
        desc: &TensorDesc,
        data: &[T],
        strides: Option<&[i64]>,
    ) -> Result<Tensor> {
        let desc = TensorDesc { dtype: of_slice::<T>(desc)?, ..desc.clone() };
        let strides = check_slice("data", &desc.dims, data.len(), strides)?;
        let name = c_optional("name", desc.name.as_deref())?;
        let raw = raw_desc(&desc, pointer(&name));
        let bytes = std::mem::size_of_val(data);
        let data = data.as_ptr().cast();
        Tensor::wrap(|handle| {
            call!(splat_tensor_from_host(device.handle, &raw, data, bytes, strides, handle))
        })
    }

    /// Create a tensor of `dims` with row-major values.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let device = Device::create(&Default::default())?;
    /// let tensor = Tensor::from_slice(&device, &[2, 3], &[1, 2, 3, 4, 5, 6])?;
    /// assert_eq!((tensor.dims(), tensor.dtype()), (&[2, 3][..], Dtype::I32));
    /// tensor.write(&[0; 6], None)?;
    /// assert_eq!(tensor.to_vec::<i32>()?, [0; 6]);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// As [`Tensor::from_host`].
    pub fn from_slice<T: Element>(device: &Device, dims: &[i64], data: &[T]) -> Result<Tensor> {
        let desc = TensorDesc { dims: dims.to_vec(), ..Default::default() };
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
    #[must_use]
    pub fn dims(&self) -> &[i64] {
        &self.dims
    }

    /// The type of its elements.
    #[must_use]
    pub fn dtype(&self) -> Dtype {
        self.dtype
    }

    /// The number of its elements.
    #[must_use]
    pub fn elements(&self) -> usize {
        elements(&self.dims)
    }

    /// Copy numbers into the tensor. Without strides `data` has exactly its elements, row-major.
    ///
    /// `strides`: elements between neighbours, one for each dimension, >= 0.
    /// # Errors
    /// `ShapeMismatch` (another number of elements or strides), `InvalidArgument` (another
    /// type, strides that reach beyond `data`), `InvalidState` (mapped), errors of the device.
    pub fn write<T: Element>(&self, data: &[T], strides: Option<&[i64]>) -> Result<()> {
        self.check_type::<T>()?;
        let strides = check_slice("data", &self.dims, data.len(), strides)?;
        let bytes = std::mem::size_of_val(data);
        call!(splat_tensor_write(self.handle, data.as_ptr().cast(), bytes, strides))
    }

    /// Copy the tensor into `data`, which stays untouched on an error. Strides as in
    /// [`Tensor::write`], but no two elements may share a place.
    /// # Errors
    /// `InvalidArgument` (NULL data, a negative stride, or strides that reach beyond `bytes`),
    /// `InvalidState` (the tensor is mapped), `OutOfHostMemory`, errors of the device.
    pub fn read<T: Element>(&self, data: &mut [T], strides: Option<&[i64]>) -> Result<()> {
        self.check_type::<T>()?;
        let strides = check_slice("data", &self.dims, data.len(), strides)?;
        let bytes = std::mem::size_of_val(data);
        call!(splat_tensor_read(self.handle, data.as_mut_ptr().cast(), bytes, strides))
    }

    /// Copy the tensor into a new vector, row-major.
    /// # Errors
    /// As [`Tensor::read`].
    pub fn to_vec<T: Element>(&self) -> Result<Vec<T>> {
        let mut data = zeros("data", &[self.elements()])?;
        self.read(&mut data, None)?;
        Ok(data)
    }

    /// Give the host the tensor's elements to read until the mapping is dropped. Meanwhile other calls
    /// with this tensor return `InvalidState`.
    ///
    /// ```
    /// # fn main() -> splat::Result<()> {
    /// # use splat::{Access, Device, Tensor};
    /// let device = Device::create(&Default::default())?;
    /// let tensor = Tensor::from_slice(&device, &[2], &[1.0_f32, 2.0])?;
    /// assert_eq!(tensor.map::<f32>()?.iter().sum::<f32>(), 3.0);
    /// tensor.map_mut::<f32>(Access::READ_WRITE)?[0] = 5.0;
    /// assert_eq!(tensor.to_vec::<f32>()?, [5.0, 2.0]);
    /// # Ok(())
    /// # }
    /// ```
    /// # Errors
    /// `InvalidArgument` (another type), `InvalidState` (mapped already, or a tensor of the same
    /// memory is), `OutOfHostMemory`, errors of the device.
    pub fn map<T: Element>(&self) -> Result<Mapping<'_, T>> {
        self.check_type::<T>()?;
        held(|| {
            let (mut pointer, mut bytes) = (std::ptr::null_mut(), 0);
            call!(splat_tensor_map(self.handle, Access::READ.0, &mut pointer, &mut bytes))?;
            Ok(Mapping::of(self, pointer, bytes))
        })
    }

    /// Give the host the tensor's elements to write. With [`Access::WRITE`] they are undefined until
    /// written, with [`Access::READ_WRITE`] they are the tensor's.
    /// # Errors
    /// As [`Tensor::map`]; `InvalidArgument` also for [`Access::READ`].
    pub fn map_mut<T: Element>(&self, access: Access) -> Result<MappingMut<'_, T>> {
        self.check_type::<T>()?;
        if access == Access::READ {
            return Err(Error::argument(
                "access is READ, expected WRITE or READ_WRITE; Tensor::map reads",
            ));
        }
        held(|| {
            let (mut pointer, mut bytes) = (std::ptr::null_mut(), 0);
            call!(splat_tensor_map(self.handle, access.0, &mut pointer, &mut bytes))?;
            Ok(MappingMut(Mapping::of(self, pointer, bytes)))
        })
    }

    /// A pointer to the elements, row-major, and their bytes, good until the tensor is dropped. No
    /// call that uses the tensor may run on another thread while it is followed.
    /// # Errors
    /// `Unsupported` where the device's memory is not the host's.
    pub fn host_pointer(&self) -> Result<(*mut c_void, usize)> {
        let mut pointer = std::ptr::null_mut();
        let mut bytes = 0;
        call!(splat_tensor_host_pointer(self.handle, &mut pointer, &mut bytes))?;
        Ok((pointer, bytes))
    }

    /// Share the memory as a DLPack tensor on the CPU. The caller must call its deleter once.
    /// # Errors
    /// As [`Tensor::host_pointer`].
    pub fn to_dlpack(&self) -> Result<*mut sys::DLManagedTensorVersioned> {
        crate::load::loaded()?;
        let mut managed = std::ptr::null_mut();
        // SAFETY: as with `call`. A panic of a callback, which would leave the memory without an owner, waits.
        let make = || unsafe { sys::splat_tensor_to_dlpack(self.handle, &mut managed) };
        crate::error::check(crate::log::dropping(make))?;
        Ok(managed)
    }

    /// A handle of the memory of a tensor with [`TensorDesc::exportable`], which the caller closes. It and
    /// all who opened it keep the memory alive, whatever becomes of the tensor. Calls have ended on the
    /// device when they return; what others do there must have ended before a call that uses the tensor.
    /// # Errors
    /// `InvalidState` (not exportable, imported itself, mapped), errors of the device.
    pub fn export(&self) -> Result<ExternalMemory> {
        let mut raw = sys::splat_external_memory::default();
        call!(splat_tensor_export(self.handle, &mut raw))?;
        Ok(ExternalMemory {
            handle: raw.handle,
            memory_bytes: raw.memory_bytes,
            offset: raw.offset,
            memory_type: raw.memory_type,
            device_uuid: raw.device_uuid,
            driver_uuid: raw.driver_uuid,
        })
    }

    /// Create a tensor in memory that others exported on the same device and driver. The handle stays the
    /// caller's, who may close it afterwards.
    /// # Safety
    /// `memory_bytes` is that of the handle's memory, and nobody writes there while the tensor is mapped or
    /// its pointer is followed.
    /// # Errors
    /// `InvalidArgument` (a handle of no memory of the device, UUIDs of another, too little memory),
    /// `Unsupported` (the device has no [`crate::Features::EXTERNAL_MEMORY`]), and out of memory.
    pub unsafe fn import(
        device: &Device,
        desc: &TensorDesc,
        memory: &ExternalMemory,
    ) -> Result<Tensor> {
        let name = c_optional("name", desc.name.as_deref())?;
        let raw = raw_desc(desc, pointer(&name));
        let memory = sys::splat_external_memory {
            memory_type: memory.memory_type,
            handle: memory.handle,
            memory_bytes: memory.memory_bytes,
            offset: memory.offset,
            device_uuid: memory.device_uuid,
            driver_uuid: memory.driver_uuid,
            ..Default::default()
        };
        Tensor::wrap(|handle| call!(splat_tensor_import(device.handle, &raw, &memory, handle)))
    }

    /// Describe the tensor.
    /// # Errors
    /// Another version of the library.
    pub fn get_info(&self) -> Result<TensorInfo> {
        let mut info = sys::splat_tensor_info::default();
        call!(splat_tensor_get_info(self.handle, &mut info))?;
        Ok(TensorInfo::from_raw(&info))
    }

    /// Measure a tensor of [`Dtype::F32`] on the device.
    /// # Errors
    /// `InvalidArgument` (struct or dtype), `InvalidState` (mapped), errors of the device.
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

/// A tensor's elements in host memory, a slice, row-major. Dropping it ends the mapping.
///
/// It cannot outlive the tensor:
///
/// ```compile_fail,E0597
/// # fn escape(device: &splat::Device) -> splat::Result<()> {
/// let mapping = {
///     let tensor = splat::Tensor::from_slice(device, &[2], &[1.0_f32, 2.0])?;
///     tensor.map::<f32>()?
/// };
/// println!("{:?}", mapping);
/// # Ok(())
/// # }
/// ```
#[must_use]
pub struct Mapping<'a, T: Element> {
    tensor: &'a Tensor,
    pointer: *mut T,
    length: usize,
}

impl<'a, T: Element> Mapping<'a, T> {
    fn of(tensor: &'a Tensor, pointer: *mut c_void, bytes: usize) -> Self {
        Mapping { tensor, pointer: pointer.cast(), length: bytes / std::mem::size_of::<T>() }
    }

    /// End the mapping and tell whether that worked.
    /// # Errors
    /// Errors of the device.
    pub fn unmap(self) -> Result<()> {
        let handle = self.tensor.handle;
        std::mem::forget(self);
        call!(splat_tensor_unmap(handle))
    }
}

impl<T: Element> std::ops::Deref for Mapping<'_, T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        // SAFETY: the library refuses other calls with a mapped tensor or its memory, which it keeps.
        unsafe { std::slice::from_raw_parts(self.pointer, self.length) }
    }
}

impl<T: Element + fmt::Debug> fmt::Debug for Mapping<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

impl<T: Element> Drop for Mapping<'_, T> {
    fn drop(&mut self) {
        // SAFETY: the tensor is alive and mapped. An error of the device shows in its next call.
        dropping(|| unsafe { sys::splat_tensor_unmap(self.tensor.handle) });
    }
}

/// A [`Mapping`] that can be written.
#[must_use]
pub struct MappingMut<'a, T: Element>(Mapping<'a, T>);

impl<T: Element> MappingMut<'_, T> {
    /// See [`Mapping::unmap`]; written values are the tensor's then.
    /// # Errors
    /// Errors of the device.
    pub fn unmap(self) -> Result<()> {
        self.0.unmap()
    }
}

impl<T: Element> std::ops::Deref for MappingMut<'_, T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<T: Element> std::ops::DerefMut for MappingMut<'_, T> {
    fn deref_mut(&mut self) -> &mut [T] {
        // SAFETY: as in Mapping::deref; this mapping is borrowed alone.
        unsafe { std::slice::from_raw_parts_mut(self.0.pointer, self.0.length) }
    }
}

impl<T: Element + fmt::Debug> fmt::Debug for MappingMut<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
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
        flags: if desc.exportable { sys::SPLAT_TENSOR_EXPORTABLE } else { 0 },
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
    array.iter_mut().zip(dims).for_each(|(place, &dim)| *place = dim);
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
