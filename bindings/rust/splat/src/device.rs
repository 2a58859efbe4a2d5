//! Devices.

use crate::error::{call, Result};
use crate::object::object;
use crate::text::{c_optional_path, pointer, text};
use crate::values::{DeviceFlags, DeviceInfo, DeviceKind, DeviceSelect, Kernels, MemoryInfo};
use splat_sys as sys;
use std::path::PathBuf;

/// How to open a device. The default opens the best one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct DeviceDesc {
    /// Validation, profiling.
    pub flags: DeviceFlags,
    /// By what the device is chosen.
    pub select: DeviceSelect,
    /// For [`DeviceSelect::BY_INDEX`].
    pub index: u32,
    /// For [`DeviceSelect::BY_KIND`].
    pub kind: DeviceKind,
    /// Which shaders it runs.
    pub kernels: Kernels,
    /// For [`DeviceSelect::BY_UUID`].
    pub uuid: [u8; 16],
    /// Budget; 0: the device's heap, on CPU devices 3/4 of physical memory.
    pub max_device_bytes: u64,
    /// Longest wait for one piece of work; 0: 60 s.
    pub timeout_ns: u64,
    /// Longest time of a piece of work, by the times of those before; 0: 0.1 s, on CPU devices 0.25 s.
    pub max_submit_ns: u64,
    /// Pipeline cache; None: in the user's cache folder; empty: none.
    pub cache_folder: Option<PathBuf>,
}

object! {
    /// An open Vulkan device. Calls that use it run one after the other. It closes with the last of
    /// its objects. Several owners share it by `Arc`.
    ///
    /// ```
    /// # fn main() -> splat::Result<()> {
    /// let device = splat::Device::create(&splat::DeviceDesc::default())?;
    /// println!("{}", device.get_info()?.name);
    /// # Ok(())
    /// # }
    /// ```
    Device, splat_device, splat_device_destroy
}

// SAFETY: core.h: a device is thread-safe.
unsafe impl Send for Device {}
// SAFETY: core.h: a device is thread-safe.
unsafe impl Sync for Device {}

impl Device {
    /// Open a device.
    /// # Errors
    /// `InvalidArgument`, `NoDevice` (the message lists the devices), `Unsupported` (a
    /// feature that the device lacks), and out of memory.
    pub fn create(desc: &DeviceDesc) -> Result<Device> {
        let cache_folder = c_optional_path("cache_folder", desc.cache_folder.as_deref())?;
        let raw = sys::splat_device_desc {
            flags: desc.flags.0,
            select: desc.select.0,
            index: desc.index,
            kind: desc.kind.0,
            kernels: desc.kernels.0,
            uuid: desc.uuid,
            max_device_bytes: desc.max_device_bytes,
            timeout_ns: desc.timeout_ns,
            max_submit_ns: desc.max_submit_ns,
            cache_folder: pointer(&cache_folder),
            ..Default::default()
        };
        Device::made(|handle| call!(splat_device_create(&raw, handle)))
    }

    /// Count the Vulkan devices of this machine, usable or not.
    /// # Errors
    /// `NoDevice` (the Vulkan loader is missing or has no driver at all), `InvalidState`.
    pub fn count() -> Result<u32> {
        let mut count = 0;
        call!(splat_device_count(&mut count))?;
        Ok(count)
    }

    /// Describe device `index` without opening it.
    ///
    /// ```
    /// use splat::prelude::*;
    /// for index in 0..Device::count()? {
    ///     println!("{}", Device::describe(index)?.name);
    /// }
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (index >= count), `NoDevice`, `InvalidState`.
    pub fn describe(index: u32) -> Result<DeviceInfo> {
        let mut info = sys::splat_device_info::default();
        call!(splat_device_describe(index, &mut info))?;
        Ok(DeviceInfo::from_raw(&info))
    }

    /// Cancel the calls that run on this device or wait for it now: each returns
    /// [`Code::Cancelled`](crate::Code::Cancelled). Later calls are not affected.
    /// # Errors
    /// As [`Canceller::cancel`].
    pub fn cancel(&self) -> Result<()> {
        self.canceller().cancel()
    }

    /// What cancels calls from other threads and from handlers of signals.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let device = Device::create(&Default::default())?;
    /// let canceller = device.canceller();
    /// std::thread::spawn(move || canceller.cancel()).join().unwrap()?;
    /// # Ok::<(), splat::Error>(())
    /// ```
    #[must_use]
    pub fn canceller(&self) -> Canceller {
        Canceller { handle: self.handle }
    }

    /// Describe the device.
    /// # Errors
    /// Another version of the library.
    pub fn get_info(&self) -> Result<DeviceInfo> {
        let mut info = sys::splat_device_info::default();
        call!(splat_device_get_info(self.handle, &mut info))?;
        Ok(DeviceInfo::from_raw(&info))
    }

    /// Report device memory, in bytes.
    /// # Errors
    /// Another version of the library.
    pub fn get_memory(&self) -> Result<MemoryInfo> {
        let mut info = sys::splat_memory_info::default();
        call!(splat_device_get_memory(self.handle, &mut info))?;
        Ok(MemoryInfo::from_raw(&info))
    }

    /// JSON: the time of every kind of dispatch, on a device with [`DeviceFlags::PROFILE`].
    /// # Errors
    /// `InvalidState` (the device was created without `DeviceFlags::PROFILE`).
    pub fn profile_json(&self) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_device_profile_json(self.handle, buffer, capacity, needed)
        })
    }

    /// The same as a table for people.
    /// # Errors
    /// `InvalidState` (the device was created without `DeviceFlags::PROFILE`).
    pub fn profile_table(&self) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_device_profile_table(self.handle, buffer, capacity, needed)
        })
    }

    /// Forget the times measured so far.
    /// # Errors
    /// `InvalidState` (the device was created without `DeviceFlags::PROFILE`).
    pub fn profile_reset(&self) -> Result<()> {
        call!(splat_device_profile_reset(self.handle))
    }
}

/// Cancels calls on a device from anywhere. It does not keep the device open: once the device is
/// dropped, [`Canceller::cancel`] returns `InvalidHandle`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Canceller {
    handle: sys::splat_device,
}

// SAFETY: core.h: splat_device_cancel may be called from any thread. A handle is a number that is
// used once, so that of a dropped device is refused.
unsafe impl Send for Canceller {}
// SAFETY: as above.
unsafe impl Sync for Canceller {}

impl Canceller {
    /// See [`Device::cancel`].
    /// # Errors
    /// As [`Canceller::cancel`].
    pub fn cancel(&self) -> Result<()> {
        // A signal handler may be here: no messages are delivered.
        crate::load::loaded()?;
        // SAFETY: a handle is a number that is used once.
        crate::error::check(unsafe { sys::splat_device_cancel(self.handle) })
    }
}
