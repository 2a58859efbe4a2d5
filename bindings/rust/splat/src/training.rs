//! Trainings as runs.

use crate::dataset::Dataset;
use crate::device::Device;
use crate::error::{call, Result};
use crate::model::Model;
use crate::run::{Run, RunEvent};
use crate::text::{c_optional, pointer, Texts};
use crate::values::{LoadFlags, TrainerInfo, TrainingFlags};
use splat_sys as sys;

/// What to train, with which data, in which folder.
#[derive(Clone, Copy, Debug, Default)]
pub struct TrainingDesc<'a> {
    /// Resume or overwrite.
    pub flags: TrainingFlags,
    /// The folder of the run.
    pub folder: &'a str,
    /// YAML or JSON; None: the defaults, or the configuration of the run that is resumed.
    pub config: Option<&'a str>,
    /// Changes to it, "key=value".
    pub values: &'a [&'a str],
    /// None: the split train of data.root.
    pub dataset: Option<&'a Dataset>,
    /// None: none; if `dataset` is None too, the split val of data.root where there is one.
    pub validation: Option<&'a Dataset>,
    /// File of weights to start from; None: opt.pretrained_ckpt, else random.
    pub init: Option<&'a str>,
    /// How they are loaded.
    pub init_flags: LoadFlags,
}

/// A training as a run: an iterator of events, with the methods of [`Run`].
///
/// ```no_run
/// # fn main() -> splat::Result<()> {
/// use splat::{Device, Training, TrainingDesc};
/// let device = Device::create(&Default::default())?;
/// let desc = TrainingDesc { folder: "run", values: &["data.root=cars"], ..Default::default() };
/// for event in Training::open(&device, &desc)? {
///     if let Some(text) = event?.text {
///         println!("{text}");
///     }
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Training(Run);

impl std::ops::Deref for Training {
    type Target = Run;

    fn deref(&self) -> &Run {
        &self.0
    }
}

impl Iterator for Training {
    type Item = Result<RunEvent>;

    fn next(&mut self) -> Option<Self::Item> {
        self.0.next()
    }
}

impl Training {
    /// Open a session: check the configuration, the data and the weights; then make the folder, or
    /// lock that of the run.
    ///
    /// Errors: `InvalidArgument`, `InvalidState` (another session has the folder, or it holds
    /// something else), `NotFound`, `Format`, `ShapeMismatch`, `Io`, errors of the device.
    pub fn open(device: &Device, desc: &TrainingDesc<'_>) -> Result<Training> {
        let folder = c_optional("folder", Some(desc.folder))?;
        let config = c_optional("config", desc.config)?;
        let values = Texts::new("values", desc.values)?;
        let init = c_optional("init", desc.init)?;
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
            ..Default::default()
        };
        Run::made(|handle| call!(splat_training_open(device.handle, &raw, handle))).map(Training)
    }

    /// Facts of the latest step of this session, skipped or not.
    ///
    /// Errors: `InvalidState` before the first step.
    pub fn last_step(&self) -> Result<TrainerInfo> {
        let mut raw = sys::splat_trainer_info::default();
        call!(splat_training_last_step(self.0.handle, &mut raw))?;
        Ok(TrainerInfo::from_raw(&raw))
    }

    /// The network in training, as [`Trainer::model`](crate::Trainer::model).
    pub fn model(&self) -> Result<Model> {
        let mut model = Model::made(|handle| call!(splat_training_model(self.0.handle, handle)))?;
        model.serial = self.0.serial.clone();
        Ok(model)
    }
}
