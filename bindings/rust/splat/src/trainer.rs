//! Networks in training, and batches for them.

use crate::dataset::Dataset;
use crate::device::Device;
use crate::error::{call, Result};
use crate::values::Code;
use crate::model::Model;
use crate::object::{object, Serial};
use crate::text::{array, bytes, c_optional, c_path, pointer, text};
use crate::values::{Camera, TrainerInfo};
use crate::weights::Weights;
use splat_sys as sys;
use std::path::Path;

/// B = opt.batch_size objects with V = data.input_images input and T = opt.imgs_per_obj target
/// images; poses are relative to the object's first input image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrainerBatch<'a> {
    /// `[B*V,channels,R,R]`
    pub images: Option<&'a [f32]>,
    /// `[B*V,4,4]` row vectors
    pub view_to_world: Option<&'a [f32]>,
    /// `[B*V,4]` w x y z
    pub quaternions: Option<&'a [f32]>,
    /// `[B*V,2]` pixels; None unless data.fov is 0
    pub focals: Option<&'a [f32]>,
    /// `[B*V,length]` of a custom embedding
    pub embedding: Option<&'a [f32]>,
    /// `[B*V,token_dim,tokens]`
    pub tokens: Option<&'a [f32]>,
    /// `[B*V,5,R,R]`; None unless opt.lambda_plane is above 0
    pub planes: Option<&'a [f32]>,
    /// `[B*T,3,R,R]`
    pub targets: Option<&'a [f32]>,
    /// B*T, of R x R pixels
    pub cameras: Option<&'a [Camera]>,
    /// Channels per input image, checked against the configuration; 0: not checked.
    pub channels: u32,
    /// B, checked against the configuration; 0: not checked.
    pub objects: u32,
}

/// A slice of the library's, or none.
///
/// # Safety
/// `pointer` is NULL or has `count` values that live as long as 'a.
unsafe fn slice<'a, T>(pointer: *const T, count: u64) -> Option<&'a [T]> {
    if pointer.is_null() {
        None
    } else {
        // SAFETY: by the caller.
        Some(unsafe { std::slice::from_raw_parts(pointer, count as usize) })
    }
}

impl<'a> TrainerBatch<'a> {
    /// # Safety
    /// The arrays of `raw` live as long as 'a.
    unsafe fn from_raw(raw: &sys::splat_trainer_batch) -> Self {
        // SAFETY: by the caller; Camera has the layout of C.
        unsafe {
            TrainerBatch {
                images: slice(raw.images, raw.images_count),
                view_to_world: slice(raw.view_to_world, raw.view_to_world_count),
                quaternions: slice(raw.quaternions, raw.quaternions_count),
                focals: slice(raw.focals, raw.focals_count),
                embedding: slice(raw.embedding, raw.embedding_count),
                tokens: slice(raw.tokens, raw.tokens_count),
                planes: slice(raw.planes, raw.planes_count),
                targets: slice(raw.targets, raw.targets_count),
                cameras: slice(raw.cameras.cast(), raw.cameras_count),
                channels: raw.channels,
                objects: raw.objects,
            }
        }
    }

    fn to_raw(self) -> Result<sys::splat_trainer_batch> {
        let (images, images_count) = array("images", self.images)?;
        let (view_to_world, view_to_world_count) = array("view_to_world", self.view_to_world)?;
        let (quaternions, quaternions_count) = array("quaternions", self.quaternions)?;
        let (focals, focals_count) = array("focals", self.focals)?;
        let (embedding, embedding_count) = array("embedding", self.embedding)?;
        let (tokens, tokens_count) = array("tokens", self.tokens)?;
        let (planes, planes_count) = array("planes", self.planes)?;
        let (targets, targets_count) = array("targets", self.targets)?;
        let (cameras, cameras_count) = array("cameras", self.cameras)?;
        Ok(sys::splat_trainer_batch {
            images,
            images_count,
            view_to_world,
            view_to_world_count,
            quaternions,
            quaternions_count,
            focals,
            focals_count,
            embedding,
            embedding_count,
            tokens,
            tokens_count,
            targets,
            targets_count,
            cameras: cameras.cast(),
            cameras_count,
            channels: self.channels,
            objects: self.objects,
            planes,
            planes_count,
            ..Default::default()
        })
    }
}

object! {
    /// A network in training: parameters, Adam's moments, averaged weights, and the rasterizer that
    /// draws its Gaussians.
    ///
    /// The caller synchronises calls on one trainer: it can be sent to another thread but not
    /// shared. Calls on its [`Trainer::model`] wait for its own.
    Trainer, splat_trainer, splat_trainer_destroy, serial: Serial
}

// SAFETY: train.h: the caller synchronises calls on one trainer. It is not Sync, and its models
// share `serial`.
unsafe impl Send for Trainer {}

impl Trainer {
    /// Create a trainer; the parameters of its network are zero. `config`: from
    /// [`config::merge`](crate::config::merge); None: the defaults.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let device = Device::create(&Default::default())?;
    /// # let config = "model: {base_dim: 8, num_blocks: 1, channel_mult: [1, 2], attention_resolutions: [8]}\n\
    /// #               data: {training_resolution: 16}\n";
    /// let trainer = Trainer::create(&device, Some(config))?;
    /// trainer.model()?.init(1)?;
    /// let state = trainer.save_memory()?;
    /// trainer.resume_memory(&state)?;
    /// assert!(trainer.store()?.count()? > 0);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (an unknown key, with the nearest known one), `Unsupported`,
    /// `OutOfHostMemory`, errors of the device.
    pub fn create(device: &Device, config: Option<&str>) -> Result<Trainer> {
        let config = c_optional("config", config)?;
        let raw = sys::splat_trainer_desc { config: pointer(&config), ..Default::default() };
        Trainer::made(|handle| call!(splat_trainer_create(device.handle, &raw, handle)))
    }

    /// The network in training, to initialise, load, store and read it. It keeps the trainer's
    /// memory alive.
    /// # Errors
    /// Another version of the library.
    pub fn model(&self) -> Result<Model> {
        let mut model = Model::made(|handle| call!(splat_trainer_model(self.handle, handle)))?;
        model.serial = self.serial.clone();
        Ok(model)
    }

    /// Do one update. On an error there is none.
    /// # Errors
    /// `ShapeMismatch` (channels, objects, a count, a picture), `InvalidArgument`, `InvalidState`
    /// (a tensor of the model is mapped), `OutOfHostMemory`, errors of the device.
    pub fn step(&self, batch: &TrainerBatch<'_>) -> Result<TrainerInfo> {
        let raw = batch.to_raw()?;
        let mut info = sys::splat_trainer_info::default();
        self.serial.with(|| {
            call!(splat_trainer_step(self.handle, &raw, &mut info))?;
            Ok(TrainerInfo::from_raw(&info))
        })
    }

    /// Do one update; what it did is not read from the device, until [`Trainer::read`].
    /// # Errors
    /// Those of [`Trainer::step`].
    pub fn step_unread(&self, batch: &TrainerBatch<'_>) -> Result<()> {
        let raw = batch.to_raw()?;
        self.serial.with(|| call!(splat_trainer_step(self.handle, &raw, std::ptr::null_mut())))
    }

    /// What the steps of [`Trainer::step_unread`] did, oldest first, each once.
    /// # Errors
    /// Errors of the device.
    pub fn read(&self) -> Result<Vec<TrainerInfo>> {
        self.serial.with(|| {
            let mut count = 0;
            match call!(splat_trainer_read(self.handle, std::ptr::null_mut(), 0, &mut count)) {
                Err(error) if error.code() != Code::Incomplete => return Err(error),
                _ => {}
            }
            let mut infos = Vec::new();
            infos.resize_with(count, sys::splat_trainer_info::default);
            if count > 0 {
                call!(splat_trainer_read(self.handle, infos.as_mut_ptr(), count, &mut count))?;
            }
            Ok(infos.iter().map(TrainerInfo::from_raw).collect())
        })
    }

    /// JSON: step, attempts, steps unread and skipped, parameters, trainable, configuration.
    /// # Errors
    /// Another version of the library.
    pub fn report(&self) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_trainer_report(self.handle, buffer, capacity, needed)
        })
    }

    /// Store the averaged weights as a state dict, or the current ones if there are none.
    /// # Errors
    /// Errors of the device.
    pub fn store(&self) -> Result<Weights> {
        self.serial
            .with(|| Weights::made(|weights| call!(splat_trainer_store(self.handle, weights))))
    }

    /// Save everything that the next step depends on in a .safetensors file, whole or not at all.
    /// # Errors
    /// `NotFound`, `Io` (cannot be written), errors of the device.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = c_path("path", path.as_ref())?;
        self.serial.with(|| call!(splat_trainer_save(self.handle, path.as_ptr())))
    }

    /// The same bytes.
    /// # Errors
    /// `NotFound`, `Io` (cannot be written), errors of the device.
    pub fn save_memory(&self) -> Result<Vec<u8>> {
        self.serial.with(|| {
            // SAFETY: the buffer lives through the call.
            bytes(|buffer, capacity, needed| unsafe {
                sys::splat_trainer_save_memory(self.handle, buffer, capacity, needed)
            })
        })
    }

    /// Resume from such a file, bit-exactly. On an error the trainer is unchanged.
    /// # Errors
    /// `InvalidArgument` (a file of another network or optimiser), `NotFound`, `Io`, `Format`
    /// (damaged (it has a checksum), or not such a file).
    pub fn resume(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = c_path("path", path.as_ref())?;
        self.serial.with(|| call!(splat_trainer_resume(self.handle, path.as_ptr())))
    }

    /// Resume from the bytes of such a file.
    /// # Errors
    /// `InvalidArgument` (a file of another network or optimiser), `NotFound`, `Io`, `Format`
    /// (damaged (it has a checksum), or not such a file).
    pub fn resume_memory(&self, data: &[u8]) -> Result<()> {
        self.serial.with(|| {
            call!(splat_trainer_resume_memory(self.handle, data.as_ptr().cast(), data.len()))
        })
    }
}

object! {
    /// The batches of a training: which objects and views a step sees, read ahead of time by a
    /// thread of the library.
    Batches, splat_batches, splat_batches_destroy
}

// SAFETY: train.h: the caller synchronises calls on one object. It is not Sync.
unsafe impl Send for Batches {}

impl Batches {
    /// Begin with a data set, opened at data.training_resolution, with the maps and background of
    /// the configuration. `config`: that of the trainer.
    /// # Errors
    /// `InvalidArgument` (config, a data set opened otherwise), `Format` (an object has too few
    /// views), `OutOfHostMemory`.
    pub fn create(dataset: &Dataset, config: Option<&str>, seed: u64) -> Result<Batches> {
        let config = c_optional("config", config)?;
        Batches::made(|handle| {
            call!(splat_batches_create(dataset.handle, pointer(&config), seed, handle))
        })
    }

    /// Get the batch of a step for [`Trainer::step`]. It lives until the next call:
    ///
    /// ```compile_fail,E0499
    /// # fn two(mut batches: splat::Batches) -> splat::Result<()> {
    /// let first = batches.next(0)?;
    /// let second = batches.next(1)?;
    /// println!("{:?} {:?}", first.images, second.images);
    /// # Ok(())
    /// # }
    /// ```
    /// # Errors
    /// As [`Dataset::read`]; the next call tries again.
    pub fn next(&mut self, step: u64) -> Result<TrainerBatch<'_>> {
        let mut raw = sys::splat_trainer_batch::default();
        call!(splat_batches_next(self.handle, step, &mut raw))?;
        // SAFETY: the arrays live until the next call, which borrows self alone.
        Ok(unsafe { TrainerBatch::from_raw(&raw) })
    }
}
