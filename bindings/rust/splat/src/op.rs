//! Single differentiable operators.

use crate::device::Device;
use crate::error::{call, Result};
use crate::object::object;
use crate::rasterizer::handle;
use crate::tensor::Tensor;
use crate::text::{c_optional, c_text, count, pointer, text};
use crate::values::{Code, OpFlags};
use crate::Error;
use splat_sys as sys;

/// An operator on given tensors, which are [`Dtype::F32`](crate::Dtype::F32). Optional ones are
/// None.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OpDesc<'a> {
    /// Accumulate or overwrite gradients of parameters.
    pub flags: OpFlags,
    /// A name of [`op_list`].
    pub type_name: &'a str,
    /// JSON object; None: defaults.
    pub attributes: Option<&'a str>,
    /// In the operator's order.
    pub inputs: &'a [Option<&'a Tensor>],
    /// In the operator's order.
    pub outputs: &'a [Option<&'a Tensor>],
    /// Empty for an operator without backward; else as many as outputs.
    pub grad_outputs: &'a [Option<&'a Tensor>],
    /// Empty, or as many as inputs; gradients of None are not computed.
    pub grad_inputs: &'a [Option<&'a Tensor>],
}

object! {
    /// A single differentiable operator, as the network uses it.
    Op, splat_op, splat_op_destroy
}

// SAFETY: model.h: an operator is thread-safe.
unsafe impl Send for Op {}
// SAFETY: model.h: an operator is thread-safe.
unsafe impl Sync for Op {}

fn handles(tensors: &[Option<&Tensor>]) -> Vec<sys::splat_tensor> {
    tensors.iter().map(|&tensor| handle(tensor)).collect()
}

/// The tensors of gradients.
/// # Errors
/// Another number of them than of what they belong to.
fn gradients(
    name: &str,
    tensors: &[Option<&Tensor>],
    expected: usize,
) -> Result<Vec<sys::splat_tensor>> {
    if tensors.is_empty() || tensors.len() == expected {
        return Ok(handles(tensors));
    }
    Err(Error::new(
        Code::ShapeMismatch,
        format!("{name}: {} tensors, expected {expected} or none", tensors.len()),
    ))
}

impl Op {
    /// Record an operator on the given tensors, whose contents may change between runs.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let device = Device::create(&Default::default())?;
    /// let tensor = |values: &[f32]| Tensor::from_slice(&device, &[1, 2], values);
    /// let (x, y) = (tensor(&[-1.0, 2.0])?, tensor(&[0.0; 2])?);
    /// let desc = OpDesc {
    ///     type_name: "relu",
    ///     inputs: &[Some(&x)],
    ///     outputs: &[Some(&y)],
    ///     ..Default::default()
    /// };
    /// Op::create(&device, &desc)?.forward()?;
    /// assert_eq!(y.to_vec::<f32>()?, [0.0, 2.0]);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (type, attribute, count), `ShapeMismatch`, naming the tensor,
    /// `Unsupported`, and out of memory.
    pub fn create(device: &Device, desc: &OpDesc<'_>) -> Result<Op> {
        let type_name = c_text("type_name", desc.type_name)?;
        let attributes = c_optional("attributes", desc.attributes)?;
        let (inputs, outputs) = (handles(desc.inputs), handles(desc.outputs));
        let grad_outputs = gradients("grad_outputs", desc.grad_outputs, outputs.len())?;
        let grad_inputs = gradients("grad_inputs", desc.grad_inputs, inputs.len())?;
        let list = |tensors: &[sys::splat_tensor]| match tensors {
            [] => std::ptr::null(),
            tensors => tensors.as_ptr(),
        };
        let raw = sys::splat_op_desc {
            flags: desc.flags.0,
            type_: type_name.as_ptr(),
            attributes: pointer(&attributes),
            input_count: count("inputs", inputs.len())?,
            output_count: count("outputs", outputs.len())?,
            inputs: inputs.as_ptr(),
            outputs: outputs.as_ptr(),
            grad_outputs: list(&grad_outputs),
            grad_inputs: list(&grad_inputs),
            ..Default::default()
        };
        Op::made(|handle| call!(splat_op_create(device.handle, &raw, handle)))
    }

    /// Compute the outputs from the inputs.
    /// # Errors
    /// `InvalidState` (a tensor is mapped), errors of the device.
    pub fn forward(&self) -> Result<()> {
        call!(splat_op_forward(self.handle))
    }

    /// Compute the gradients of sum(grad_outputs * outputs) with respect to the requested inputs.
    /// # Errors
    /// `InvalidState` before the first forward or without grad_outputs.
    pub fn backward(&self) -> Result<()> {
        call!(splat_op_backward(self.handle))
    }
}

/// JSON array of all operators: names, inputs, outputs, attributes, equations.
/// # Errors
/// Another version of the library.
pub fn op_list() -> Result<String> {
    // SAFETY: the buffer lives through the call.
    text(|buffer, capacity, needed| unsafe { sys::splat_op_list(buffer, capacity, needed) })
}
