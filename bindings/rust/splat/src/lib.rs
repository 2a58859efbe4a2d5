//! libsplat for Rust: 3D Gaussians from pictures, drawn and trained on any Vulkan device.
//!
//! Names are those of the C API without their prefix: `splat_scene_load` is [`Scene::load`]. Every
//! call that can fail returns [`Result`]; [`Error`] has the library's code and sentence. Objects may
//! be dropped in any order, also while another thread computes: the library keeps what is needed.
//!
//! `use splat::prelude::*` names all types and [`Result`]; modules and functions have paths, such as
//! [`image::save`].
//!
//! An object that is thread-safe in C is `Send` and `Sync`, and threads share it by `Arc`; one whose
//! calls the caller synchronises is only `Send`. In a forked child, objects of a device that the parent
//! opened are refused.
//!
//! Features say where the library comes from: `system`, the default, from pkg-config, `bundled` from
//! sources in the package. Others bring conversions: `glam` ([`Camera`] and [`Similarity`] as its matrices),
//! `image` (its buffers from and to [`Image`] and [`ImageView`]), `ndarray` (arrays from and to these and
//! [`Tensor`]), `bytemuck` (`Pod` of both structs), `serde` (descriptions and infos; numbers and flags by
//! their names), `bitflags` (its trait `Flags`).
#![warn(missing_docs)]
#![deny(unsafe_op_in_unsafe_fn)]
// NulError has another path in Rust 1.64 and later.
#![allow(unknown_lints, clippy::incompatible_msrv)]

mod camera;
mod comparison;
pub mod config;
mod dataset;
mod device;
mod error;
mod evaluator;
pub mod image;
mod interop;
mod load;
pub mod log;
mod model;
mod module;
mod numbers;
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
#[rustfmt::skip]
mod values;
mod weights;

pub use splat_sys as sys;

mod types {
    pub use crate::camera::CameraBytes;
    pub use crate::comparison::{CompareDesc, Comparison, Score, ScoreSet};
    pub use crate::dataset::{Co3dDesc, Dataset, DatasetDesc, DatasetViews, SyntheticDesc, TokensDesc};
    pub use crate::device::{Canceller, Device, DeviceDesc};
    pub use crate::error::{Error, Result};
    pub use crate::evaluator::{EvaluatedViews, Evaluator, EvaluatorDesc};
    pub use crate::image::{Image, ImageView, ImageViewMut, Lpips};
    pub use crate::load::DecodeLimits;
    pub use crate::model::{Model, ModelDesc, ModelGradients, ModelInput};
    pub use crate::module::{Module, ModuleDesc};
    pub use crate::numbers::UnknownCode;
    pub use crate::op::{Op, OpDesc};
    pub use crate::optimizer::{Optimizer, OptimizerDesc, OptimizerGroup, OptimizerItem};
    pub use crate::picture::{Picture, PictureCut, PictureSource};
    pub use crate::predictor::{Prediction, Predictor, PredictorDesc};
    pub use crate::priors::{NormalsDesc, PlanesDesc, PriorMaps, PriorModel, PriorModelDesc};
    pub use crate::rasterizer::{Gaussians, Gradients, RasterState, Rasterizer};
    pub use crate::run::{
        Fit, FitDesc, Interrupter, Ranks, RanksResult, Run, RunEvent, Scoring, Training,
        TrainingDesc,
    };
    pub use crate::scene::mesh::{Mesh, MeshDesc, MeshMaps, MeshViewsDesc};
    pub use crate::scene::{Scene, SceneDesc};
    pub use crate::tables::{ExportDesc, ImportDesc, Progress};
    pub use crate::tensor::{Element, ExternalMemory, Mapping, MappingMut, Tensor, TensorDesc};
    pub use crate::trainer::{Batches, Trainer, TrainerBatch};
    pub use crate::values::*;
    pub use crate::weights::{NamedArray, Weights};
}

/// All types, without the modules, which would hide crates of the names `image`, `log` and `config`.
pub mod prelude {
    pub use crate::types::*;
}

pub use dataset::{co3d_prepare, path_name, synthetic_write, tokens_write};
pub use load::{build_info, check_library, set_decode_limits, version, version_string};
pub use op::op_list;
pub use picture::picture_cut;
pub use predictor::builtin_weights;
pub use priors::{normals_from_depth, picture_mask, planes_from_depth, prior_preset};
pub use scene::formats as scene_formats;
pub use scene::mesh::mesh_find_views;
pub use tables::import_tables;
pub use types::*;
