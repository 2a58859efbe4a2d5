//! Trainings as runs.

use super::ranks::{Group, Ranks};
use super::{Run, RunEvent};
use crate::dataset::Dataset;
use crate::device::Device;
use crate::error::{call, Result};
use crate::model::Model;
use crate::text::{c_optional, c_optional_path, pointer, Texts};
use crate::values::{LoadFlags, TrainerInfo, TrainingFlags};
use splat_sys as sys;
use std::panic::resume_unwind;
use std::path::Path;

/// What to train, with which data, in which folder.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrainingDesc<'a> {
    /// Resume or overwrite.
    pub flags: TrainingFlags,
    /// The folder of the run.
    pub folder: Option<&'a Path>,
    /// YAML or JSON; None: the defaults, or the configuration of the run that is resumed.
    pub config: Option<&'a str>,
    /// Changes to it, "key=value".
    pub values: &'a [&'a str],
    /// None: the split train of data.root.
    pub dataset: Option<&'a Dataset>,
    /// None: none; if `dataset` is None too, the split val of data.root where there is one.
    pub validation: Option<&'a Dataset>,
    /// File of weights to start from; None: opt.pretrained_ckpt, else random.
    pub init: Option<&'a Path>,
    /// How they are loaded.
    pub init_flags: LoadFlags,
}

/// A training as a run: an iterator of events, with the methods of [`Run`].
///
/// ```no_run
/// # fn main() -> splat::Result<()> {
/// use splat::{Device, Training, TrainingDesc};
/// let device = Device::create(&Default::default())?;
/// let desc = TrainingDesc { folder: Some("run".as_ref()), values: &["data.root=cars"], ..Default::default() };
/// for event in Training::open(&device, &desc)? {
///     if let Some(text) = event?.text {
///         println!("{text}");
///     }
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug, PartialEq, Eq)]
pub struct Training(Run, Option<Group>); // in this order they are dropped

impl std::ops::Deref for Training {
    type Target = Run;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl Iterator for Training {
    type Item = Result<RunEvent>;

    fn next(&mut self) -> Option<Self::Item> {
        let next = self.0.next();
        if let Some(panic) = self.1.as_ref().and_then(Group::panic) {
            resume_unwind(panic);
        }
        next
    }
}

impl Training {
    /// Open a session: check the configuration, the data and the weights; then make the folder, or
    /// lock that of the run.
    /// # Errors
    /// `InvalidArgument`, `InvalidState` (another session has the folder, or it holds
    /// something else), `NotFound`, `Format`, `ShapeMismatch`, `Io`, errors of the device.
    pub fn open(device: &Device, desc: &TrainingDesc<'_>) -> Result<Training> {
        Training::made(device, desc, std::ptr::null()).map(|run| Training(run, None))
    }

    /// The same as rank `rank` of `count`, a power of two, which train together, each on a device of its
    /// own: all open the training with equal data, configuration and `init`, and take its events. Rank 0
    /// has the folder.
    /// # Errors
    /// Those of [`Training::open`]; `InvalidArgument` for numbers that are no ranks; `Io` for what a call of
    /// `ranks` gives.
    /// # Panics
    /// Where a call of `ranks` does, here and in the calls of the training.
    pub fn open_with_ranks(
        device: &Device,
        desc: &TrainingDesc<'_>,
        (rank, count): (u32, u32),
        ranks: impl Ranks + 'static,
    ) -> Result<Training> {
        let group = Group::new(Box::new(ranks));
        let raw = group.raw(rank, count);
        let run = Training::made(device, desc, &raw);
        if let Some(panic) = group.panic() {
            drop(run);
            resume_unwind(panic);
        }
        run.map(|run| Training(run, Some(group)))
    }

    fn made(
        device: &Device,
        desc: &TrainingDesc<'_>,
        group: *const sys::splat_group,
    ) -> Result<Run> {
        let folder = c_optional_path("folder", desc.folder)?;
        let config = c_optional("config", desc.config)?;
        let values = Texts::new("values", desc.values)?;
        let init = c_optional_path("init", desc.init)?;
        let handle_of =
            |dataset: Option<&Dataset>| dataset.map_or(std::ptr::null_mut(), |d| d.handle);
        let raw = sys::splat_training_desc {
            flags: desc.flags.0,
            folder: pointer(&folder),
            config: pointer(&config),
            values: values.as_ptr(),
            value_count: values.len() as u64,
            dataset: handle_of(desc.dataset),
            validation: handle_of(desc.validation),
            init: pointer(&init),
            init_flags: desc.init_flags.0,
            group,
            ..Default::default()
        };
        Run::made(|handle| call!(splat_training_open(device.handle, &raw, handle)))
    }

    /// Facts of the latest step of this session, skipped or not.
    /// # Errors
    /// `InvalidState` before the first step.
    pub fn last_step(&self) -> Result<TrainerInfo> {
        let mut raw = sys::splat_trainer_info::default();
        call!(splat_training_last_step(self.0.handle, &mut raw))?;
        Ok(TrainerInfo::from_raw(&raw))
    }

    /// The network in training, as [`Trainer::model`](crate::Trainer::model).
    /// # Errors
    /// Another version of the library.
    pub fn model(&self) -> Result<Model> {
        let mut model = Model::made(|handle| call!(splat_training_model(self.0.handle, handle)))?;
        model.serial = self.0.serial.clone();
        Ok(model)
    }
}
