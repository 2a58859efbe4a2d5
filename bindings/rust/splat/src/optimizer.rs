//! Adam over models, modules and tensors.

use crate::device::Device;
use crate::error::{call, Result};
use crate::model::Model;
use crate::module::Module;
use crate::object::{object, Serial};
use crate::tensor::Tensor;
use crate::text::{c_optional, c_text};
use crate::values::{OptimizerInfo, Schedule};
use crate::weights::Weights;
use splat_sys as sys;
use std::ffi::CString;

/// What to update.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OptimizerItem<'a> {
    /// The trainable parameters of a model with gradients, and a prefix of their names.
    Model(Option<&'a str>, &'a Model),
    /// The trainable parameters of a module with gradients, and a prefix of their names.
    Module(Option<&'a str>, &'a Module),
    /// One tensor.
    Tensor {
        /// Name of the tensor.
        name: &'a str,
        /// float32
        parameter: &'a Tensor,
        /// Same shape as `parameter`.
        gradient: &'a Tensor,
    },
}

/// Parameters with numbers of their own; 0: those of the desc. Of several groups that match a name,
/// the first has the parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OptimizerGroup<'a> {
    /// Matches names: '*' is any text, '?' one character.
    pub pattern: &'a str,
    /// Multiplies the desc's rate; 0: 1.
    pub rate_factor: f64,
    /// 0: the desc's.
    pub beta1: f64,
    /// 0: the desc's.
    pub beta2: f64,
    /// 0: the desc's.
    pub eps: f64,
}

/// What a new optimizer is like.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OptimizerDesc<'a> {
    /// What to update.
    pub items: &'a [OptimizerItem<'a>],
    /// Groups with rates of their own.
    pub groups: &'a [OptimizerGroup<'a>],
    /// 0: 5e-5
    pub rate: f64,
    /// 0: 0.9
    pub beta1: f64,
    /// 0: 0.999
    pub beta2: f64,
    /// 0: 1e-15
    pub eps: f64,
    /// 0: [`Schedule::CONSTANT`]
    pub schedule: Schedule,
    /// Steps in which the rate rises from zero, in any schedule.
    pub warmup_steps: u64,
    /// End of [`Schedule::COSINE`], more than warmup_steps; else 0.
    pub total_steps: u64,
    /// Step at which [`Schedule::STEP`] lowers the rate; else 0.
    pub step_at: u64,
    /// 0: no averages.
    pub ema_decay: f64,
    /// 0: every step.
    pub ema_every: u64,
    /// Up to this step the averages are copies.
    pub ema_after: u64,
}

object! {
    /// Adam (Kingma & Ba 2015) over parameters of models, modules and tensors.
    ///
    /// The caller synchronises calls on one optimizer: it can be sent to another thread but not
    /// shared. Its steps wait for calls of other threads on the models and modules that it updates.
    /// Tensors that it updates must not be read or written meanwhile, or the values are undefined.
    Optimizer, splat_optimizer, splat_optimizer_destroy, serial: Serial
}

// SAFETY: train.h: the caller synchronises calls on one optimizer and on what it updates. It is not
// Sync, and shares the locks of its models and modules; tensors are thread-safe.
unsafe impl Send for Optimizer {}

fn raw_item(
    item: &OptimizerItem<'_>,
    names: &mut Vec<CString>,
) -> Result<sys::splat_optimizer_item> {
    let mut raw = sys::splat_optimizer_item::default();
    let name = match *item {
        OptimizerItem::Model(name, model) => {
            raw.model = model.handle;
            name
        }
        OptimizerItem::Module(name, module) => {
            raw.module = module.handle;
            name
        }
        OptimizerItem::Tensor { name, parameter, gradient } => {
            raw.parameter = parameter.handle;
            raw.gradient = gradient.handle;
            Some(name)
        }
    };
    if let Some(name) = c_optional("name", name)? {
        raw.name = name.as_ptr();
        names.push(name);
    }
    Ok(raw)
}

impl Optimizer {
    /// Create an optimizer; its moments are zero. It keeps models, modules and tensors alive.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let device = Device::create(&Default::default())?;
    /// let parameter = Tensor::from_slice(&device, &[1], &[1.0_f32])?;
    /// let gradient = Tensor::from_slice(&device, &[1], &[1.0_f32])?;
    /// let item = OptimizerItem::Tensor { name: "x", parameter: &parameter, gradient: &gradient };
    /// let desc = OptimizerDesc { items: &[item], rate: 0.1, ..Default::default() };
    /// let optimizer = Optimizer::create(&device, &desc)?;
    /// optimizer.step()?;
    /// assert!((parameter.to_vec::<f32>()?[0] - 0.9).abs() < 1e-4);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (a field without effect, no parameters, two of one name, a group
    /// that has none), `InvalidState` (a model or module without gradients), `ShapeMismatch`.
    pub fn create(device: &Device, desc: &OptimizerDesc<'_>) -> Result<Optimizer> {
        let mut names = Vec::new();
        let items: Vec<sys::splat_optimizer_item> =
            desc.items.iter().map(|item| raw_item(item, &mut names)).collect::<Result<_>>()?;
        let patterns: Vec<CString> = desc
            .groups
            .iter()
            .map(|group| c_text("pattern", group.pattern))
            .collect::<Result<_>>()?;
        let groups: Vec<sys::splat_optimizer_group> = desc
            .groups
            .iter()
            .zip(&patterns)
            .map(|(group, pattern)| sys::splat_optimizer_group {
                pattern: pattern.as_ptr(),
                rate_factor: group.rate_factor,
                beta1: group.beta1,
                beta2: group.beta2,
                eps: group.eps,
            })
            .collect();
        let raw = sys::splat_optimizer_desc {
            items: items.as_ptr(),
            item_count: items.len() as u64,
            groups: groups.as_ptr(),
            group_count: groups.len() as u64,
            rate: desc.rate,
            beta1: desc.beta1,
            beta2: desc.beta2,
            eps: desc.eps,
            schedule: desc.schedule.0,
            warmup_steps: desc.warmup_steps,
            total_steps: desc.total_steps,
            step_at: desc.step_at,
            ema_decay: desc.ema_decay,
            ema_every: desc.ema_every,
            ema_after: desc.ema_after,
            ..Default::default()
        };
        let mut optimizer =
            Optimizer::made(|handle| call!(splat_optimizer_create(device.handle, &raw, handle)))?;
        let shared = desc.items.iter().filter_map(|item| match item {
            OptimizerItem::Model(_, model) => Some(&model.serial),
            OptimizerItem::Module(_, module) => Some(&module.serial),
            OptimizerItem::Tensor { .. } => None,
        });
        optimizer.serial = Serial::of(shared);
        Ok(optimizer)
    }

    /// Update the parameters from their gradients, which stay. If a gradient is not finite, nothing
    /// is updated, and `was_skipped` is true.
    /// # Errors
    /// `InvalidState` (a mapped tensor), errors of the device.
    pub fn step(&self) -> Result<OptimizerInfo> {
        self.serial.with(|| {
            let mut info = sys::splat_optimizer_info::default();
            call!(splat_optimizer_step(self.handle, &mut info))?;
            Ok(OptimizerInfo::from_raw(&info))
        })
    }

    /// Set all gradients to zero.
    /// # Errors
    /// `InvalidState` (a mapped tensor), errors of the device.
    pub fn zero_gradients(&self) -> Result<()> {
        self.serial.with(|| call!(splat_optimizer_zero_gradients(self.handle)))
    }

    /// Reorder, drop and add rows of the tensors whose names have a pattern, with their moments and
    /// averages: row i becomes row `rows[i]`; -1: a new row, as it lies in the tensor.
    /// # Errors
    /// `InvalidArgument`, `ShapeMismatch` (tensors with other numbers of rows), `Unsupported`
    /// (parameters of a model or module), `InvalidState` (a mapped tensor), `OutOfHostMemory`,
    /// errors of the device.
    pub fn gather_rows(&self, pattern: &str, rows: &[i64]) -> Result<()> {
        self.serial.with(|| {
            let pattern = c_text("pattern", pattern)?;
            call!(splat_optimizer_gather_rows(
                self.handle,
                pattern.as_ptr(),
                rows.as_ptr(),
                rows.len() as u64
            ))
        })
    }

    /// Replace the rate, which the schedule and the groups scale.
    /// # Errors
    /// `InvalidArgument` (rate < 0, not finite).
    pub fn set_rate(&self, rate: f64) -> Result<()> {
        call!(splat_optimizer_set_rate(self.handle, rate))
    }

    /// Describe the optimizer and its last step.
    /// # Errors
    /// Another version of the library.
    pub fn get_info(&self) -> Result<OptimizerInfo> {
        let mut info = sys::splat_optimizer_info::default();
        call!(splat_optimizer_get_info(self.handle, &mut info))?;
        Ok(OptimizerInfo::from_raw(&info))
    }

    /// Copy the averaged parameters, by name; without averages the parameters.
    /// # Errors
    /// Errors of the device.
    pub fn store(&self) -> Result<Weights> {
        self.serial
            .with(|| Weights::made(|weights| call!(splat_optimizer_store(self.handle, weights))))
    }

    /// Copy moments, averages, counters and rate. Parameters are not in it.
    /// # Errors
    /// Errors of the device.
    pub fn save(&self) -> Result<Weights> {
        self.serial.with(|| Weights::made(|state| call!(splat_optimizer_save(self.handle, state))))
    }

    /// Go on from such weights, bit-exactly. On an error the optimizer is unchanged.
    /// # Errors
    /// `InvalidArgument` (weights that are no state, or that of other parameters).
    pub fn load(&self, state: &Weights) -> Result<()> {
        self.serial.with(|| call!(splat_optimizer_load(self.handle, state.handle)))
    }
}
