//! Parts of networks with their parameters.

use crate::device::Device;
use crate::error::{call, Error, Result};
use crate::object::{object, Serial};
use crate::tensor::{eight, elements};
use crate::text::{c_optional, c_text, count, items, pointer, text, zeros};
use crate::values::{Code, ModuleFlags, Port, PortKind, Precision};
use splat_sys as sys;
use std::ffi::CString;

/// What a new module is like.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModuleDesc<'a> {
    /// Gradients, dropout.
    pub flags: ModuleFlags,
    /// A name of [`op_list`](crate::op_list), or "residual_block".
    pub type_name: &'a str,
    /// JSON object; None: defaults.
    pub attributes: Option<&'a str>,
    /// Names and shapes of inputs and parameters.
    pub ports: &'a [(&'a str, &'a [i64])],
    /// Only for "residual_block".
    pub precision: Precision,
}

object! {
    /// One operator or one block of the network with its parameters.
    ///
    /// The caller synchronises calls on one module: it can be sent to another thread but not
    /// shared. Steps of an optimizer on another thread wait for its calls.
    Module, splat_module, splat_module_destroy, serial: Serial
}

// SAFETY: model.h: the caller synchronises calls on one module. It is not Sync, and optimizers of it
// share `serial`.
unsafe impl Send for Module {}

impl Module {
    /// Create a module; its parameters, inputs and gradients of outputs are zero.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let device = Device::create(&Default::default())?;
    /// let desc = ModuleDesc {
    ///     type_name: "linear",
    ///     ports: &[("x", &[1, 2]), ("weight", &[1, 2])],
    ///     ..Default::default()
    /// };
    /// let module = Module::create(&device, &desc)?;
    /// module.write("x", &[2.0, 3.0])?;
    /// module.write("weight", &[1.0, 10.0])?;
    /// module.forward()?;
    /// assert_eq!(module.to_vec("y")?, [32.0]);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (a port or attribute that the type does not have),
    /// `ShapeMismatch` (a port that is missing or does not fit), `Unsupported`, out of memory.
    pub fn create(device: &Device, desc: &ModuleDesc<'_>) -> Result<Module> {
        let type_name = c_text("type_name", desc.type_name)?;
        let attributes = c_optional("attributes", desc.attributes)?;
        let names: Vec<CString> =
            desc.ports.iter().map(|(name, _)| c_text("ports", name)).collect::<Result<_>>()?;
        let ports: Vec<sys::splat_port> = desc
            .ports
            .iter()
            .zip(&names)
            .map(|((_, dims), name)| sys::splat_port {
                name: name.as_ptr(),
                rank: dims.len() as u32,
                flags: 0,
                dims: eight(dims),
            })
            .collect();
        let raw = sys::splat_module_desc {
            flags: desc.flags.0,
            type_: type_name.as_ptr(),
            attributes: pointer(&attributes),
            ports: ports.as_ptr(),
            port_count: count("ports", ports.len())?,
            precision: desc.precision.0,
            ..Default::default()
        };
        Module::made(|handle| call!(splat_module_create(device.handle, &raw, handle)))
    }

    /// Initialise the parameters.
    /// # Errors
    /// Errors of the device.
    pub fn init(&self, seed: u64) -> Result<()> {
        self.serial.with(|| call!(splat_module_init(self.handle, seed)))
    }

    /// JSON: type, inputs, outputs, parameters, bytes.
    /// # Errors
    /// Another version of the library.
    pub fn report(&self) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_module_report(self.handle, buffer, capacity, needed)
        })
    }

    /// List the inputs, outputs or parameters.
    /// # Errors
    /// Another version of the library.
    pub fn ports(&self, kind: PortKind) -> Result<Vec<Port>> {
        self.serial.with(|| {
            // SAFETY: the ports live through the call.
            let raw = items(|ports, capacity, count| unsafe {
                sys::splat_module_ports(self.handle, kind.0, ports, capacity, count)
            })?;
            Ok(raw.iter().map(Port::from_raw).collect())
        })
    }

    /// Write an input, a parameter, or the gradient of the loss with respect to an output
    /// ("grad:y"). `values`: exactly its numbers, row-major.
    /// # Errors
    /// `NotFound`, `ShapeMismatch`, `InvalidArgument` (not finite), `InvalidState`.
    pub fn write(&self, name: &str, values: &[f32]) -> Result<()> {
        let name = c_text("name", name)?;
        let bytes = std::mem::size_of_val(values);
        self.serial
            .with(|| call!(splat_module_write(self.handle, name.as_ptr(), values.as_ptr(), bytes)))
    }

    /// Read what [`Module::write`] writes, an output ("y"), or a gradient ("grad:weight",
    /// "grad:x"). `values`: exactly its numbers, row-major.
    /// # Errors
    /// `InvalidState` (the module computes no such gradient), `ShapeMismatch` (bytes),
    /// `InvalidArgument` (a value that is not finite, except in an input without gradient),
    /// `NotFound` (no such name), `OutOfHostMemory`, errors of the device.
    pub fn read(&self, name: &str, values: &mut [f32]) -> Result<()> {
        let name = c_text("name", name)?;
        let bytes = std::mem::size_of_val(values);
        self.serial.with(|| {
            call!(splat_module_read(self.handle, name.as_ptr(), values.as_mut_ptr(), bytes))
        })
    }

    /// The same into a new vector.
    /// # Errors
    /// `NotFound`, and as [`Module::read`].
    pub fn to_vec(&self, name: &str) -> Result<Vec<f32>> {
        let base = name.strip_prefix("grad:").unwrap_or(name);
        for kind in [PortKind::OUTPUT, PortKind::INPUT, PortKind::PARAMETER] {
            if let Some(port) = self.ports(kind)?.iter().find(|port| port.name == base) {
                let mut values = zeros(name, &[elements(&port.dims)])?;
                self.read(name, &mut values)?;
                return Ok(values);
            }
        }
        Err(Error::new(
            Code::NotFound,
            format!("the module has no tensor '{name}'; Module::ports lists them"),
        ))
    }

    /// Compute the outputs.
    /// # Errors
    /// `OutOfHostMemory`, errors of the device.
    pub fn forward(&self) -> Result<()> {
        self.serial.with(|| call!(splat_module_forward(self.handle)))
    }

    /// Add to the gradients of parameters and overwrite those of inputs; once after each forward
    /// pass.
    /// # Errors
    /// `InvalidState`, `OutOfHostMemory`, errors of the device.
    pub fn backward(&self) -> Result<()> {
        self.serial.with(|| call!(splat_module_backward(self.handle)))
    }

    /// Set the gradients of parameters to zero.
    /// # Errors
    /// `OutOfHostMemory`, errors of the device.
    pub fn zero_gradients(&self) -> Result<()> {
        self.serial.with(|| call!(splat_module_zero_gradients(self.handle)))
    }
}
