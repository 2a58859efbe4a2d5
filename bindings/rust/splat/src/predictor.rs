//! Networks with weights that turn pictures of an object into a scene.

use crate::dataset::Dataset;
use crate::device::Device;
use crate::error::{call, Result};
use crate::object::{object, Serial};
use crate::picture::{Picture, RawPictures};
use crate::scene::Scene;
use crate::text::{c_optional, c_optional_path, count, pointer, text, zeros};
use crate::values::{Camera, Convention, PictureInfo, PredictorInfo};
use crate::weights::Weights;
use splat_sys as sys;
use std::path::{Path, PathBuf};

/// Weights and configuration of a predictor. The default is the built-in weights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PredictorDesc<'a> {
    /// A file of weights.
    pub weights_path: Option<&'a Path>,
    /// Used instead of reading the file, whose path then only names them.
    pub weights: Option<&'a Weights>,
    /// Text, JSON or YAML; None: the file beside the weights.
    pub config: Option<&'a str>,
    /// A file of low-rank adapters, which are folded in.
    pub adapters_path: Option<&'a Path>,
    /// Low-rank adapters in memory, in place of the file.
    pub adapters: Option<&'a Weights>,
    /// 0: lora_alpha of their metadata, else of the configuration.
    pub adapters_alpha: f64,
    /// 0, or 2 to 64: predictions from so many drawn views are joined, as those of F3D-Gaus from 8.
    pub aggregate: u32,
    /// How these views are drawn.
    pub convention: Convention,
}

/// Facts of a prediction.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Prediction {
    /// Cameras of the views, relative to the first.
    pub cameras: Vec<Camera>,
    /// What became of each picture; none for an object of a data set.
    pub pictures: Vec<PictureInfo>,
    /// What the network saw, `[views,channels,R,R]`.
    pub inputs: Vec<f32>,
    /// Gaussians of the scene.
    pub gaussians: u64,
    /// Left out: numbers of theirs are not finite.
    pub not_finite: u64,
    /// Left out: opacity below 1 / 255, which no image of 8 bits shows.
    pub faint: u64,
    /// To read and cut out the pictures.
    pub read_ms: f64,
    /// To run the network and read its Gaussians.
    pub network_ms: f64,
}

object! {
    /// A network with weights that turns pictures of an object into a scene.
    ///
    /// ```no_run
    /// # fn main() -> splat::Result<()> {
    /// use splat::{Device, Picture, Predictor};
    /// let device = Device::create(&Default::default())?;
    /// let predictor = Predictor::create(&device, &Default::default())?;
    /// let scene = predictor.predict(&[Picture::file("photo.png")])?;
    /// scene.save("scene.ply", &Default::default())?;
    /// # Ok(())
    /// # }
    /// ```
    Predictor, splat_predictor, splat_predictor_destroy, evaluators: Serial
}

// SAFETY: predict.h: a predictor is thread-safe. Its evaluators are synchronised by `evaluators`.
unsafe impl Send for Predictor {}
// SAFETY: predict.h: a predictor is thread-safe.
unsafe impl Sync for Predictor {}

/// Where a prediction writes its facts.
struct Room {
    raw: sys::splat_prediction,
    cameras: Vec<Camera>,
    pictures: Vec<sys::splat_picture_info>,
    inputs: Vec<f32>,
}

impl Room {
    fn new(views: u32, pictures: u32, inputs: [usize; 4]) -> Result<Self> {
        let mut room = Room {
            raw: sys::splat_prediction::default(),
            cameras: zeros("cameras", &[views as usize])?,
            pictures: zeros("pictures", &[pictures as usize])?,
            inputs: zeros("inputs", &inputs)?,
        };
        room.raw.camera_capacity = views;
        room.raw.cameras = room.cameras.as_mut_ptr().cast();
        if pictures != 0 {
            room.raw.picture_capacity = pictures;
            room.raw.pictures = room.pictures.as_mut_ptr();
        }
        if !room.inputs.is_empty() {
            room.raw.input_capacity = room.inputs.len() as u64;
            room.raw.inputs = room.inputs.as_mut_ptr();
        }
        Ok(room)
    }

    fn facts(mut self) -> Prediction {
        self.cameras.truncate(self.raw.camera_count as usize);
        self.pictures.truncate(self.raw.picture_count as usize);
        Prediction {
            cameras: self.cameras,
            pictures: self.pictures.iter().map(PictureInfo::from_raw).collect(),
            inputs: self.inputs,
            gaussians: self.raw.gaussians,
            not_finite: self.raw.not_finite,
            faint: self.raw.faint,
            read_ms: self.raw.read_ms,
            network_ms: self.raw.network_ms,
        }
    }
}

impl Predictor {
    /// Create a predictor.
    /// # Errors
    /// `NotFound` (a file, or the configuration beside it), `ShapeMismatch` or `Format`
    /// (weights that do not fit the configuration), and as [`Model::create`](crate::Model::create).
    pub fn create(device: &Device, desc: &PredictorDesc<'_>) -> Result<Predictor> {
        let weights_path = c_optional_path("weights_path", desc.weights_path)?;
        let config = c_optional("config", desc.config)?;
        let adapters_path = c_optional_path("adapters_path", desc.adapters_path)?;
        let handle_of =
            |weights: Option<&Weights>| weights.map_or(std::ptr::null_mut(), |w| w.handle);
        let raw = sys::splat_predictor_desc {
            weights_path: pointer(&weights_path),
            weights: handle_of(desc.weights),
            config: pointer(&config),
            adapters_path: pointer(&adapters_path),
            adapters: handle_of(desc.adapters),
            adapters_alpha: desc.adapters_alpha,
            aggregate: desc.aggregate,
            convention: desc.convention.0,
            ..Default::default()
        };
        Predictor::made(|handle| call!(splat_predictor_create(device.handle, &raw, handle)))
    }

    /// Describe what it takes and gives.
    /// # Errors
    /// Another version of the library.
    pub fn get_info(&self) -> Result<PredictorInfo> {
        let mut info = sys::splat_predictor_info::default();
        call!(splat_predictor_get_info(self.handle, &mut info))?;
        Ok(PredictorInfo::from_raw(&info))
    }

    /// JSON: weights, warnings, category, metadata, what was loaded, configuration.
    /// # Errors
    /// Another version of the library.
    pub fn report(&self) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_predictor_report(self.handle, buffer, capacity, needed)
        })
    }

    /// Predict a scene in the frame of the first picture's camera, which looks along z from the
    /// origin. As many pictures as the network has views.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let device = Device::create(&Default::default())?;
    /// let predictor = Predictor::create(&device, &PredictorDesc::default())?;
    /// let mut pixels = vec![255_u8; 64 * 64 * 3];
    /// pixels[64 * 64..][..64 * 64].fill(90);
    /// let picture = Picture::pixels(ImageView::new(&pixels, [64, 64], 3)?);
    /// assert!(predictor.predict(&[picture])?.get_info()?.count > 0);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (another count; a map, focal length, pose or array that the
    /// network needs and a picture lacks, or the other way round), errors of files and the device.
    pub fn predict(&self, pictures: &[Picture<'_>]) -> Result<Scene> {
        let pictures = RawPictures::new(pictures)?;
        let length = count("pictures", pictures.list.len())?;
        let (list, none) = (pictures.list.as_ptr(), std::ptr::null_mut());
        Scene::made(|handle| {
            call!(splat_predictor_predict(self.handle, list, length, handle, none))
        })
    }

    /// The same with facts. `inputs`: also what the network saw.
    /// # Errors
    /// `InvalidArgument` (another count), `InvalidState` (the network's output is not finite: the
    /// weights overflow), `OutOfHostMemory`, errors of the device.
    pub fn predict_with_facts(
        &self,
        pictures: &[Picture<'_>],
        inputs: bool,
    ) -> Result<(Scene, Prediction)> {
        let pictures = RawPictures::new(pictures)?;
        let length = count("pictures", pictures.list.len())?;
        let mut room = Room::new(length, length, self.inputs(inputs)?)?;
        let (list, facts) = (pictures.list.as_ptr(), &mut room.raw);
        let scene = Scene::made(|handle| {
            call!(splat_predictor_predict(self.handle, list, length, handle, facts))
        })?;
        Ok((scene, room.facts()))
    }

    /// The same for an object of a data set that was opened with the predictor's resolution and
    /// background. The network sees the first of `views`; the cameras are those of all.
    /// # Errors
    /// `InvalidArgument` (another count), `InvalidState` (the network's output is not finite: the
    /// weights overflow), `NotFound` (missing maps or a missing file), `Io`, `Format` (a file that
    /// cannot be read, a damaged one), `OutOfHostMemory`, errors of the device.
    pub fn predict_object(
        &self,
        dataset: &Dataset,
        object: u32,
        views: &[u32],
        inputs: bool,
    ) -> Result<(Scene, Prediction)> {
        let length = count("views", views.len())?;
        let mut room = Room::new(length, 0, self.inputs(inputs)?)?;
        let (data, facts) = (dataset.handle, &mut room.raw);
        let scene = Scene::made(|handle| {
            call!(splat_predictor_predict_object(
                self.handle,
                data,
                object,
                views.as_ptr(),
                length,
                handle,
                facts
            ))
        })?;
        Ok((scene, room.facts()))
    }

    /// Views, channels, height and width of what the network sees.
    fn inputs(&self, wanted: bool) -> Result<[usize; 4]> {
        if !wanted {
            return Ok([0; 4]);
        }
        let info = self.get_info()?;
        let sizes = [info.views, info.channels, info.resolution, info.resolution];
        Ok(sizes.map(|size| size as usize))
    }
}

impl Prediction {
    /// The facts as JSON, with sentences for warnings.
    /// # Errors
    /// Another version of the library.
    pub fn report(&self) -> Result<String> {
        let mut pictures: Vec<sys::splat_picture_info> = self
            .pictures
            .iter()
            .map(|picture| sys::splat_picture_info {
                width: picture.width,
                height: picture.height,
                found: picture.found.0,
                warnings: picture.warnings.0,
                square: picture.square,
                focal: picture.focal,
                fov_degrees: picture.fov_degrees,
            })
            .collect();
        let raw = sys::splat_prediction {
            pictures: pictures.as_mut_ptr(),
            picture_capacity: count("pictures", pictures.len())?,
            picture_count: pictures.len() as u32,
            gaussians: self.gaussians,
            not_finite: self.not_finite,
            faint: self.faint,
            read_ms: self.read_ms,
            network_ms: self.network_ms,
            ..Default::default()
        };
        // SAFETY: the structs and the buffer live through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_prediction_report(&raw, buffer, capacity, needed)
        })
    }
}

/// The path of weights that come with the library. `name`: "cars64" or None.
///
/// ```
/// assert!(splat::builtin_weights(Some("cars64"))?.ends_with("weights.safetensors"));
/// # Ok::<(), splat::Error>(())
/// ```
/// # Errors
/// `NotFound`, listing the names.
pub fn builtin_weights(name: Option<&str>) -> Result<PathBuf> {
    let name = c_optional("name", name)?;
    // SAFETY: name and buffer live through the call.
    text(|buffer, capacity, needed| unsafe {
        sys::splat_builtin_weights(pointer(&name), buffer, capacity, needed)
    })
    .map(PathBuf::from)
}
