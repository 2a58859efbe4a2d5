//! libsplat for Rust: 3D Gaussians from pictures, drawn and trained on any Vulkan device.
//!
//! Names are those of the C API without their prefix: `splat_scene_load` is [`Scene::load`]. Every
//! call that can fail returns [`Result`]; [`Error`] has the library's code and sentence. Objects may
//! be dropped in any order, also while another thread computes: the library keeps what is needed.
//!
//! An object that is thread-safe in C is `Send` and `Sync`; one whose calls the caller synchronises
//! is only `Send`. In a forked child, objects of a device that the parent opened are refused.
#![warn(missing_docs)]
#![deny(unsafe_op_in_unsafe_fn)]

mod camera;
mod comparison;
pub mod config;
mod dataset;
mod device;
mod error;
mod evaluator;
pub mod image;
mod load;
pub mod log;
mod model;
mod module;
mod object;
mod op;
mod optimizer;
mod picture;
mod predictor;
pub mod prior_scores;
mod priors;
mod rasterizer;
mod run;
mod scene;
mod tables;
mod tensor;
mod text;
mod trainer;
mod training;
#[rustfmt::skip]
mod values;
mod weights;

pub use splat_sys as sys;

pub use camera::CameraBytes;
pub use comparison::{CompareDesc, Comparison, Score, ScoreSet};
pub use dataset::{
    co3d_prepare, path_name, synthetic_write, Co3dDesc, Dataset, DatasetDesc, DatasetViews,
    SyntheticDesc,
};
pub use device::{Canceller, Device, DeviceDesc};
pub use error::{Error, Result};
pub use evaluator::{EvaluatedViews, Evaluator, EvaluatorDesc};
pub use image::{Image, ImageView, ImageViewMut, Lpips};
pub use load::{
    build_info, check_library, set_decode_limits, version, version_string, DecodeLimits,
};
pub use model::{Model, ModelDesc, ModelGradients, ModelInput};
pub use module::{Module, ModuleDesc};
pub use op::{op_list, Op, OpDesc};
pub use optimizer::{Optimizer, OptimizerDesc, OptimizerGroup, OptimizerItem};
pub use picture::{picture_cut, Picture, PictureCut, PictureSource};
pub use predictor::{builtin_weights, Prediction, Predictor, PredictorDesc};
pub use priors::{
    normals_from_depth, picture_mask, prior_preset, NormalsDesc, PriorMaps, PriorModel,
    PriorModelDesc,
};
pub use rasterizer::{Gaussians, Gradients, RasterState, Rasterizer};
pub use run::{Interrupter, Run, RunEvent};
pub use scene::{formats as scene_formats, Scene, SceneDesc};
pub use tables::{import_tables, ExportDesc, ImportDesc, Progress};
pub use tensor::{Element, Mapping, Tensor, TensorDesc};
pub use trainer::{Batches, Trainer, TrainerBatch};
pub use training::{Training, TrainingDesc};
pub use values::*;
pub use weights::{NamedArray, Weights};
