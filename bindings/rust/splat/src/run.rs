//! Runs: tasks with their folder, as iterators of events, such as a training or a fit.

mod ranks;
mod training;

use crate::device::Device;
use crate::error::{call, Result};
use crate::object::{object, Serial};
use crate::scene::Scene;
use crate::text::{c_optional_path, optional, pointer, text, Texts};
use crate::values::{FitCameras, FitFlags, RunEventKind};
use splat_sys as sys;
use std::collections::BTreeMap;
use std::path::Path;

pub use ranks::{Ranks, RanksResult};
pub use training::{Training, TrainingDesc};

/// What one piece of work did.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct RunEvent {
    /// What it was.
    pub kind: RunEventKind,
    /// The line of log.txt.
    pub text: Option<String>,
    /// The text warns.
    pub warning: bool,
    /// A step updated what is learned.
    pub updated: bool,
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
    /// Since the first step of this session.
    pub seconds: f64,
    /// Steps per second.
    pub steps_per_second: f64,
    /// By their names in metrics.jsonl, such as "loss", "psnr" and "val_psnr".
    pub numbers: BTreeMap<String, f64>,
    /// Name of the validated piece.
    pub name: Option<String>,
    /// Number of the validated piece.
    pub piece: u32,
    /// Pieces of the validation.
    pub pieces: u32,
    /// Views of the piece, the input views first.
    pub views: u32,
    /// Input views of them.
    pub inputs: u32,
    /// Pixels of an image.
    pub width: u32,
    /// Pixels of an image.
    pub height: u32,
    /// Drawn, `[views,3,height,width]`.
    pub images: Vec<f32>,
    /// Targets of `images`.
    pub truths: Vec<f32>,
}

impl RunEvent {
    /// True if the run ended with it.
    #[must_use]
    pub fn is_end(&self) -> bool {
        self.kind >= RunEventKind::DONE
    }

    /// # Safety
    /// Pointers of `raw` are alive.
    unsafe fn from_raw(raw: &sys::splat_run_event) -> Self {
        /// # Safety
        /// `count` elements, or NULL.
        unsafe fn slice<'a, T>(pointer: *const T, count: u64) -> &'a [T] {
            if pointer.is_null() {
                return &[];
            }
            // SAFETY: by the caller.
            unsafe { std::slice::from_raw_parts(pointer, count as usize) }
        }
        // SAFETY: by the caller.
        let (numbers, images, truths) = unsafe {
            (
                slice(raw.numbers, raw.number_count),
                slice(raw.images, raw.image_count),
                slice(raw.truths, raw.image_count),
            )
        };
        RunEvent {
            kind: RunEventKind(raw.kind),
            text: optional(raw.text),
            warning: raw.warning != 0,
            updated: raw.updated != 0,
            logged: raw.logged != 0,
            step: raw.step,
            attempts: raw.attempts,
            iterations: raw.iterations,
            skipped: raw.skipped,
            peak_bytes: raw.peak_bytes,
            seconds: raw.seconds,
            steps_per_second: raw.steps_per_second,
            numbers: numbers
                .iter()
                .filter_map(|number| Some((optional(number.name)?, number.value)))
                .collect(),
            name: optional(raw.name),
            piece: raw.piece,
            pieces: raw.pieces,
            views: raw.views,
            inputs: raw.inputs,
            width: raw.width,
            height: raw.height,
            images: images.to_vec(),
            truths: truths.to_vec(),
        }
    }
}

object! {
    /// A task with its folder, one piece of work per item: steps, validations, saved states. The
    /// iterator ends after the event that ends the run. After an error the next item tries the
    /// same piece again. [`Training`](crate::Training) and [`Fit`](crate::Fit) open one.
    Run, splat_run, splat_run_destroy, serial: Serial, ended: bool
}

// SAFETY: run.h: the caller synchronises calls on one run. It is not Sync, and its models share
// `serial`.
unsafe impl Send for Run {}

impl Run {
    /// End the run: the next item saves the state and has [`RunEventKind::INTERRUPTED`].
    /// # Errors
    /// Another version of the library.
    pub fn interrupt(&self) -> Result<()> {
        self.interrupter().interrupt()
    }

    /// What interrupts this run from other threads and from handlers of signals.
    #[must_use]
    pub fn interrupter(&self) -> Interrupter {
        Interrupter { handle: self.handle }
    }

    /// JSON: folder, step, iterations, skipped, loss, val_psnr, best_val_psnr, peak_bytes.
    /// # Errors
    /// Another version of the library.
    pub fn report(&self) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_run_report(self.handle, buffer, capacity, needed)
        })
    }

    fn work(&mut self) -> Result<RunEvent> {
        self.serial.with(|| {
            let mut raw = sys::splat_run_event::default();
            call!(splat_run_next(self.handle, &mut raw))?;
            // SAFETY: the pointers live until the next splat_run_next or splat_run_destroy.
            let event = unsafe { RunEvent::from_raw(&raw) };
            self.ended = event.is_end();
            Ok(event)
        })
    }
}

impl Iterator for Run {
    type Item = Result<RunEvent>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            None
        } else {
            Some(self.work())
        }
    }
}

/// Interrupts a run from anywhere. It does not keep the run open: once that is dropped,
/// [`Interrupter::interrupt`] returns `InvalidHandle`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Interrupter {
    handle: sys::splat_run,
}

// SAFETY: run.h: any thread may call splat_run_interrupt. A handle is a number that is used once, so
// that of a dropped run is refused.
unsafe impl Send for Interrupter {}
// SAFETY: as above.
unsafe impl Sync for Interrupter {}

impl Interrupter {
    /// See [`Run::interrupt`].
    /// # Errors
    /// Another version of the library.
    pub fn interrupt(&self) -> Result<()> {
        // A signal handler may be here: no messages are delivered.
        crate::load::loaded()?;
        // SAFETY: a handle is a number that is used once.
        crate::error::check(unsafe { sys::splat_run_interrupt(self.handle) })
    }
}

/// What a task has of the [`Run`] inside it.
macro_rules! deref_to_run {
    ($task:ident) => {
        impl std::ops::Deref for $task {
            type Target = Run;

            fn deref(&self) -> &Self::Target {
                &self.0
            }
        }

        impl Iterator for $task {
            type Item = Result<RunEvent>;

            fn next(&mut self) -> Option<Self::Item> {
                self.0.next()
            }
        }
    };
}
/// What to fit, and how long.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FitDesc<'a> {
    /// Resume or overwrite, fit all photographs, white background.
    pub flags: FitFlags,
    /// The folder of the run.
    pub folder: Option<&'a Path>,
    /// Folder of photographs and cameras; None with [`FitFlags::RESUME`]: the run's.
    pub data: Option<&'a Path>,
    /// Folder of masks, named like the photographs, 0 leaves out; None: none.
    pub masks: Option<&'a Path>,
    /// 0: as many as `seconds` take.
    pub steps: u64,
    /// About how long to optimise on this device; 0: 60. Either this or `steps`.
    pub seconds: f64,
    /// Chooses the first Gaussians and the order of the photographs.
    pub seed: u64,
    /// 0: by the length of the fit.
    pub max_gaussians: u32,
    /// Bands of spherical harmonics, degree + 1: 1 to 4; 0: 4.
    pub sh_bands: u32,
    /// Sides of the photographs are divided by it; 0: 1.
    pub downscale: u32,
    /// Each so many photographs by name, with the first, are held out; 0: 8.
    pub test_every: u32,
    /// Which file of cameras to read.
    pub cameras: FitCameras,
    /// Folder of depth maps, named like the photographs; None: none.
    pub depth: Option<&'a Path>,
    /// Folder of maps of normals, named like the photographs; None: none.
    pub normals: Option<&'a Path>,
    /// "points" of the data, "depth", "random", or a file of a scene; None: "points".
    pub init: Option<&'a Path>,
    /// Most bytes on the device; 0: what it has.
    pub memory_bytes: u64,
    /// More options, "NAME=VALUE", by the names of a run's config.json.
    pub values: &'a [&'a str],
}

/// A fit of Gaussians to posed photographs as a run: an iterator of events, with the methods of [`Run`].
/// Fits of equal photographs, steps and seeds have equal bits.
///
/// ```no_run
/// # fn main() -> splat::Result<()> {
/// use splat::{Device, Fit, FitDesc};
/// let device = Device::create(&Default::default())?;
/// let desc = FitDesc { folder: Some("run".as_ref()), data: Some("photos".as_ref()), ..Default::default() };
/// let mut fit = Fit::open(&device, &desc)?;
/// for event in fit.by_ref() {
///     if let Some(text) = event?.text {
///         println!("{text}");
///     }
/// }
/// fit.scene()?.save("scene.ply", &Default::default())?;
/// # Ok(())
/// # }
/// ```
///
/// Numbers of its events are, of a step, "psnr" of its photograph, "gaussians", "l1", "ssim" and
/// milliseconds such as "raster_ms"; of photographs held out, "val_psnr" and "val_ssim".
#[derive(Debug, PartialEq, Eq)]
pub struct Fit(Run);

deref_to_run!(Fit);

impl Fit {
    /// Open a session: read the photographs, place the first Gaussians, and without `steps` measure how
    /// many take `seconds`; then make the folder, or lock that of the run.
    /// # Errors
    /// `InvalidArgument`, `InvalidState` (another session has the folder, or it holds
    /// something else), `NotFound`, `Format`, `Unsupported`, `ShapeMismatch`, `Io`, errors of the device.
    pub fn open(device: &Device, desc: &FitDesc<'_>) -> Result<Fit> {
        let folder = c_optional_path("folder", desc.folder)?;
        let data = c_optional_path("data", desc.data)?;
        let masks = c_optional_path("masks", desc.masks)?;
        let depth = c_optional_path("depth", desc.depth)?;
        let normals = c_optional_path("normals", desc.normals)?;
        let init = c_optional_path("init", desc.init)?;
        let values = Texts::new("values", desc.values)?;
        let raw = sys::splat_fit_desc {
            flags: desc.flags.0,
            folder: pointer(&folder),
            data: pointer(&data),
            masks: pointer(&masks),
            steps: desc.steps,
            seconds: desc.seconds,
            seed: desc.seed,
            max_gaussians: desc.max_gaussians,
            sh_bands: desc.sh_bands,
            downscale: desc.downscale,
            test_every: desc.test_every,
            cameras: desc.cameras.0,
            depth: pointer(&depth),
            normals: pointer(&normals),
            init: pointer(&init),
            memory_bytes: desc.memory_bytes,
            values: values.as_ptr(),
            value_count: values.len() as u64,
            ..Default::default()
        };
        Run::made(|handle| call!(splat_fit_open(device.handle, &raw, handle))).map(Fit)
    }

    /// A copy of the Gaussians as they are, in the frame and units of the cameras.
    /// # Errors
    /// `OutOfHostMemory`, `Timeout`, `DeviceLost`.
    pub fn scene(&self) -> Result<Scene> {
        Scene::made(|handle| call!(splat_fit_scene(self.0.handle, handle)))
    }
}

/// The scores of any scene on the photographs that a fit holds out, as a run without a folder: events of
/// each photograph with "val_psnr" and "val_ssim", then [`RunEventKind::VALIDATION`] with their means.
#[derive(Debug, PartialEq, Eq)]
pub struct Scoring(Run);

deref_to_run!(Scoring);

impl Scoring {
    /// `scene` lies in the frame and units of the cameras. Of `desc` are read data, masks, downscale,
    /// `test_every`, cameras and the flags of photographs and background. With a `border` above 0 there are
    /// also "inner_psnr" and "inner_ssim", without this share of width and height on each side.
    /// # Errors
    /// `InvalidArgument`, `NotFound`, `Format`, `Unsupported`, `ShapeMismatch`, errors of the device.
    pub fn open(
        device: &Device,
        desc: &FitDesc<'_>,
        scene: &Scene,
        border: f64,
    ) -> Result<Scoring> {
        let data = c_optional_path("data", desc.data)?;
        let masks = c_optional_path("masks", desc.masks)?;
        let raw = sys::splat_fit_desc {
            flags: desc.flags.0,
            data: pointer(&data),
            masks: pointer(&masks),
            downscale: desc.downscale,
            test_every: desc.test_every,
            cameras: desc.cameras.0,
            ..Default::default()
        };
        Run::made(|handle| {
            call!(splat_fit_score(device.handle, &raw, scene.handle, border, handle))
        })
        .map(Scoring)
    }
}
