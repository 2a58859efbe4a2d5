//! Scores of networks on data sets.

use crate::dataset::Dataset;
use crate::error::{call, Result};
use crate::image::Lpips;
use crate::object::{object, Serial};
use crate::predictor::Predictor;
use crate::text::{array, array_mut, c_optional, c_optional_path, c_path, pointer, text};
use crate::values::{Camera, EvaluationSummary, EvaluatorInfo, ObjectScores};
use splat_sys as sys;
use std::path::Path;

/// What is scored, and on which data.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EvaluatorDesc<'a> {
    /// What is scored; None: images of the caller.
    pub predictor: Option<&'a Predictor>,
    /// Opened with the predictor's resolution, background and maps; None: `data_path`.
    pub dataset: Option<&'a Dataset>,
    /// A folder, opened as the predictor's configuration says; both None: its data.root.
    pub data_path: Option<&'a Path>,
    /// Split of that folder; None: test.
    pub split: Option<&'a str>,
    /// A name for what draws the images of [`Evaluator::score_images`].
    pub method: Option<&'a str>,
    /// Made for the images' resolution; None: LPIPS is NaN.
    pub lpips: Option<&'a Lpips>,
    /// Numbers of the conditioning views of each object; None: by the protocol.
    pub conditioning: Option<&'a [u32]>,
    /// Conditioning views without a predictor; 0: 1.
    pub inputs: u32,
    /// Novel views per object, evenly spread; 0: all.
    pub novel_views: u32,
    /// Only this many, the first in order; 0: all.
    pub objects: u32,
}

/// Where [`Evaluator::read`] writes the views of an object that are scored, conditioning ones
/// first: n = inputs + novel. None is not read.
#[derive(Debug, Default, PartialEq)]
pub struct EvaluatedViews<'a> {
    /// `[n]` in the data set
    pub numbers: Option<&'a mut [u32]>,
    /// `[n]` in the frame of the first view
    pub cameras: Option<&'a mut [Camera]>,
    /// `[n,3,R,R]` targets
    pub images: Option<&'a mut [f32]>,
    /// `[n,3,R,R]` by the latest [`Evaluator::score`], of this object
    pub drawn: Option<&'a mut [f32]>,
}

object! {
    /// The published protocol of Splatter Image: each object is predicted from its conditioning
    /// views and drawn in all its views, which are scored by PSNR, SSIM and LPIPS.
    ///
    /// The caller synchronises calls on the evaluators of one predictor: an evaluator can be sent
    /// to another thread but not shared, and waits for the others of its predictor.
    Evaluator, splat_evaluator, splat_evaluator_destroy, serial: Serial
}

// SAFETY: evaluate.h: the caller synchronises calls on the evaluators of one predictor. It is not
// Sync, and those of one predictor, and its LPIPS, share `serial`.
unsafe impl Send for Evaluator {}

impl Evaluator {
    /// Create an evaluator.
    /// # Errors
    /// `InvalidArgument` (no data, a data set and a path, no method without a predictor,
    /// another number of conditioning views), `ShapeMismatch` (LPIPS of another size), and as
    /// [`Dataset::open`].
    pub fn create(desc: &EvaluatorDesc<'_>) -> Result<Evaluator> {
        let data_path = c_optional_path("data_path", desc.data_path)?;
        let split = c_optional("split", desc.split)?;
        let method = c_optional("method", desc.method)?;
        let (conditioning, conditioning_count) = array("conditioning", desc.conditioning)?;
        let raw = sys::splat_evaluator_desc {
            predictor: desc.predictor.map_or(std::ptr::null_mut(), |predictor| predictor.handle),
            dataset: desc.dataset.map_or(std::ptr::null_mut(), |dataset| dataset.handle),
            data_path: pointer(&data_path),
            split: pointer(&split),
            method: pointer(&method),
            lpips: desc.lpips.map_or(std::ptr::null_mut(), |lpips| lpips.handle),
            conditioning,
            conditioning_count,
            inputs: desc.inputs,
            novel_views: desc.novel_views,
            objects: desc.objects,
            ..Default::default()
        };
        let predictor = desc.predictor.map(|predictor| &predictor.evaluators);
        let lpips = desc.lpips.map(|lpips| &lpips.serial);
        let serial = Serial::of(predictor.into_iter().chain(lpips));
        serial.with(|| {
            let mut evaluator =
                Evaluator::made(|handle| call!(splat_evaluator_create(&raw, handle)))?;
            evaluator.serial = serial.clone();
            Ok(evaluator)
        })
    }

    /// Describe the evaluator.
    /// # Errors
    /// Another version of the library.
    pub fn get_info(&self) -> Result<EvaluatorInfo> {
        let mut info = sys::splat_evaluator_info::default();
        call!(splat_evaluator_get_info(self.handle, &mut info))?;
        Ok(EvaluatorInfo::from_raw(&info))
    }

    /// Predict an object, draw its views and score them. Scoring one again replaces its scores.
    /// # Errors
    /// `InvalidArgument` (no such object), `InvalidState` (the evaluator scores images of
    /// the caller), `Format` (no novel views), errors of files and the device.
    pub fn score(&self, object: u32) -> Result<ObjectScores> {
        self.serial.with(|| {
            let mut scores = sys::splat_object_scores::default();
            call!(splat_evaluator_score(self.handle, object, &mut scores))?;
            Ok(ObjectScores::from_raw(&scores))
        })
    }

    /// Score images `[n,3,R,R]` that the caller made, of the views that [`Evaluator::read`] gives.
    /// # Errors
    /// `InvalidArgument` (no such object), `ShapeMismatch` (count), `InvalidState` (the evaluator
    /// scores images of the caller), `Format` (a file that cannot be read, a damaged one),
    /// `NotFound` (missing maps or a missing file), `Io`, `OutOfHostMemory`, errors of the device.
    pub fn score_images(&self, object: u32, images: &[f32]) -> Result<ObjectScores> {
        self.serial.with(|| {
            let mut scores = sys::splat_object_scores::default();
            let (pointer, length) = (images.as_ptr(), images.len() as u64);
            call!(splat_evaluator_score_images(self.handle, object, pointer, length, &mut scores))?;
            Ok(ObjectScores::from_raw(&scores))
        })
    }

    /// Read the views of an object; returns the numbers of conditioning and novel ones. With all of
    /// `views` None, no file is read.
    /// # Errors
    /// `InvalidArgument` (a slice that is too short), `InvalidState` (`drawn` of another
    /// object than the latest), and as [`Dataset::read`]; on an error nothing is written.
    pub fn read(&self, object: u32, views: &mut EvaluatedViews<'_>) -> Result<(u32, u32)> {
        let (numbers, number_count) = array_mut("numbers", views.numbers.as_deref_mut())?;
        let (cameras, camera_count) = array_mut("cameras", views.cameras.as_deref_mut())?;
        let (images, image_count) = array_mut("images", views.images.as_deref_mut())?;
        let (drawn, drawn_count) = array_mut("drawn", views.drawn.as_deref_mut())?;
        let mut raw = sys::splat_evaluated_views {
            numbers,
            number_count,
            cameras: cameras.cast(),
            camera_count,
            images,
            image_count,
            drawn,
            drawn_count,
            ..Default::default()
        };
        self.serial.with(|| {
            call!(splat_evaluator_read(self.handle, object, &mut raw))?;
            Ok((raw.inputs, raw.novel))
        })
    }

    /// Sum up the objects scored so far.
    /// # Errors
    /// Another version of the library.
    pub fn summary(&self) -> Result<EvaluationSummary> {
        self.serial.with(|| {
            let mut summary = sys::splat_evaluation_summary::default();
            call!(splat_evaluator_summary(self.handle, &mut summary))?;
            Ok(EvaluationSummary::from_raw(&summary))
        })
    }

    /// The summary as JSON, the content of results.json.
    /// # Errors
    /// Another version of the library.
    pub fn report(&self) -> Result<String> {
        self.serial.with(|| {
            // SAFETY: the buffer lives through the call.
            text(|buffer, capacity, needed| unsafe {
                sys::splat_evaluator_report(self.handle, buffer, capacity, needed)
            })
        })
    }

    /// Write results.json, per_object.csv, per_image.csv, scores.txt and objects.json to a folder, which is made
    /// where missing.
    /// # Errors
    /// `Io` (the folder or a file cannot be written).
    pub fn save(&self, folder: impl AsRef<Path>) -> Result<()> {
        let folder = c_path("folder", folder.as_ref())?;
        self.serial.with(|| call!(splat_evaluator_save(self.handle, folder.as_ptr())))
    }

    /// Take over the scores in a folder of [`Evaluator::save`], by the objects' names.
    /// # Errors
    /// `InvalidArgument` (other weights, data or objects), `NotFound`, `Format`, `Io`.
    pub fn load(&self, folder: impl AsRef<Path>) -> Result<()> {
        let folder = c_path("folder", folder.as_ref())?;
        self.serial.with(|| call!(splat_evaluator_load(self.handle, folder.as_ptr())))
    }
}
