//! Trainings with their folder, as iterators of events.

use crate::dataset::Dataset;
use crate::device::Device;
use crate::error::{call, Result};
use crate::model::Model;
use crate::object::{object, Serial};
use crate::text::{c_optional, optional, pointer, text, Texts};
use crate::values::{LoadFlags, TrainerInfo, TrainingEventKind, TrainingFlags};
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

/// What one piece of work did.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct TrainingEvent {
    /// What it was.
    pub kind: TrainingEventKind,
    /// The line of log.txt.
    pub text: Option<String>,
    /// The text warns.
    pub warning: bool,
    /// metrics.jsonl got a line of the step.
    pub logged: bool,
    /// Updates done.
    pub step: u64,
    /// Steps that ran, including skipped ones.
    pub attempts: u64,
    /// Updates of the whole run.
    pub iterations: u64,
    /// Attempts that updated nothing.
    pub skipped: u64,
    /// Most device memory so far.
    pub peak_bytes: u64,
    /// Facts of a step.
    pub info: Option<TrainerInfo>,
    /// dB, of the step's targets.
    pub psnr: f64,
    /// Over the latest steps.
    pub averaged_loss: f64,
    /// Since the first step of this session.
    pub seconds: f64,
    /// Steps per second.
    pub steps_per_second: f64,
    /// Name of the validated object.
    pub name: Option<String>,
    /// Number of the validated object.
    pub object: u32,
    /// Objects in the validation.
    pub objects: u32,
    /// Views of the object, the input views first; in a validation: all novel views.
    pub views: u32,
    /// Input views of them.
    pub inputs: u32,
    /// Pixels of an image.
    pub side: u32,
    /// Drawn, `[views,3,side,side]`.
    pub images: Vec<f32>,
    /// Targets of `images`.
    pub truths: Vec<f32>,
    /// dB; NaN without novel views.
    pub novel_psnr: f64,
    /// NaN without novel views.
    pub novel_ssim: f64,
    /// dB, mean over input views.
    pub conditioning_psnr: f64,
    /// Mean over input views.
    pub conditioning_ssim: f64,
    /// Best validation with as many objects and views.
    pub best_psnr: f64,
}

impl TrainingEvent {
    /// True if the run ended with it.
    pub fn is_end(&self) -> bool {
        self.kind >= TrainingEventKind::DONE
    }

    /// # Safety
    /// Pointers of `raw` are alive.
    unsafe fn from_raw(raw: &sys::splat_training_event) -> Self {
        let numbers = |pointer: *const f32| {
            if pointer.is_null() {
                Vec::new()
            } else {
                // SAFETY: by the caller.
                unsafe { std::slice::from_raw_parts(pointer, raw.image_count as usize) }.to_vec()
            }
        };
        TrainingEvent {
            kind: TrainingEventKind(raw.kind),
            text: optional(raw.text),
            warning: raw.warning != 0,
            logged: raw.logged != 0,
            step: raw.step,
            attempts: raw.attempts,
            iterations: raw.iterations,
            skipped: raw.skipped,
            peak_bytes: raw.peak_bytes,
            // SAFETY: by the caller.
            info: unsafe { raw.info.as_ref() }.map(TrainerInfo::from_raw),
            psnr: raw.psnr,
            averaged_loss: raw.averaged_loss,
            seconds: raw.seconds,
            steps_per_second: raw.steps_per_second,
            name: optional(raw.name),
            object: raw.object,
            objects: raw.objects,
            views: raw.views,
            inputs: raw.inputs,
            side: raw.side,
            images: numbers(raw.images),
            truths: numbers(raw.truths),
            novel_psnr: raw.novel_psnr,
            novel_ssim: raw.novel_ssim,
            conditioning_psnr: raw.conditioning_psnr,
            conditioning_ssim: raw.conditioning_ssim,
            best_psnr: raw.best_psnr,
        }
    }
}

object! {
    /// A training with its folder, one piece of work per item: steps, validations, saved states.
    /// The iterator ends after the event that ends the run. After an error the next item tries the
    /// same piece again.
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
    Training, splat_training, splat_training_destroy, serial: Serial, ended: bool
}

// SAFETY: train.h: the caller synchronises calls on one session. It is not Sync, and its models
// share `serial`.
unsafe impl Send for Training {}

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
        let mut handle = std::ptr::null_mut();
        call!(splat_training_open(device.handle, &raw, &mut handle))?;
        Ok(Training {
            handle,
            serial: Serial::new(),
            ended: false,
        })
    }

    /// End the session: the next item saves the state and has [`TrainingEventKind::INTERRUPTED`].
    pub fn interrupt(&self) -> Result<()> {
        self.interrupter().interrupt()
    }

    /// What interrupts this session from other threads and from handlers of signals.
    pub fn interrupter(&self) -> Interrupter {
        Interrupter {
            handle: self.handle,
        }
    }

    /// JSON: folder, step, iterations, skipped, loss, val_psnr, best_val_psnr, peak_bytes.
    pub fn report(&self) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_training_report(self.handle, buffer, capacity, needed)
        })
    }

    /// The network in training, as [`Trainer::model`](crate::Trainer::model).
    pub fn model(&self) -> Result<Model> {
        let mut handle = std::ptr::null_mut();
        call!(splat_training_model(self.handle, &mut handle))?;
        Ok(Model {
            handle,
            serial: self.serial.clone(),
        })
    }

    fn work(&mut self) -> Result<TrainingEvent> {
        let _lock = self.serial.lock();
        let mut raw = sys::splat_training_event::default();
        call!(splat_training_next(self.handle, &mut raw))?;
        // SAFETY: the pointers live until the next call on the session.
        let event = unsafe { TrainingEvent::from_raw(&raw) };
        self.ended = event.is_end();
        Ok(event)
    }
}

impl Iterator for Training {
    type Item = Result<TrainingEvent>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            None
        } else {
            Some(self.work())
        }
    }
}

/// Interrupts a training from anywhere. It does not keep the session open: once that is dropped,
/// [`Interrupter::interrupt`] returns `InvalidHandle`.
#[derive(Clone, Copy, Debug)]
pub struct Interrupter {
    handle: sys::splat_training,
}

// SAFETY: train.h: any thread may call splat_training_interrupt. A handle is a number that is used
// once, so that of a dropped session is refused.
unsafe impl Send for Interrupter {}
// SAFETY: as above.
unsafe impl Sync for Interrupter {}

impl Interrupter {
    /// See [`Training::interrupt`].
    pub fn interrupt(&self) -> Result<()> {
        call!(splat_training_interrupt(self.handle))
    }
}
