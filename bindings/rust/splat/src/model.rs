//! Networks from images to Gaussians.

use crate::device::Device;
use crate::error::{call, Error, Result};
use crate::image::ImageView;
use crate::object::{object, Serial};
use crate::scene::Scene;
use crate::tensor::{elements, Tensor};
use crate::text::{array, c_optional, c_text, count, items, pointer, text, zeros};
use crate::values::{
    Code, Export, LoadFlags, ModelFlags, ModelInfo, PassFlags, Port, PortKind, Precision,
};
use crate::weights::Weights;
use splat_sys as sys;

/// What a new model is like. The default is the cars model.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModelDesc<'a> {
    /// Gradients, dropout, memory.
    pub flags: ModelFlags,
    /// Text, JSON or YAML; None: the cars model.
    pub config: Option<&'a str>,
    /// Objects per batch; 0: 1.
    pub objects: u32,
    /// 0: [`Precision::BALANCED`].
    pub precision: Precision,
}

/// What a pass reads. N = objects * views images of R x R pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModelInput<'a> {
    /// [`PassFlags::TENSORS`]: take what the model's tensors hold.
    pub flags: PassFlags,
    /// Seed of dropout, used with `step`.
    pub seed: u64,
    /// The optimiser's step.
    pub step: u32,
    /// Channels per image, checked against the configuration; 0: not checked.
    pub channels: u32,
    /// In the arrays, checked against the model's; 0: not checked.
    pub objects: u32,
    /// N images or a multiple, whose channels follow each other, instead of `images`.
    pub pictures: &'a [ImageView<'a>],
    /// `[N,channels,R,R]`: RGB 0 to 1, depth, normal, mask, planes, origin distance
    pub images: Option<&'a [f32]>,
    /// `[N,4,4]` row vectors: p_world = p_view M; None: the identity
    pub view_to_world: Option<&'a [f32]>,
    /// `[N,4]` w x y z of that rotation; None with view_to_world
    pub quaternions: Option<&'a [f32]>,
    /// `[N,2]` pixels; None unless the configuration's fov is 0
    pub focals: Option<&'a [f32]>,
    /// `[N,length]` of a custom embedding
    pub embedding: Option<&'a [f32]>,
    /// `[N,token_dim,tokens]`
    pub tokens: Option<&'a [f32]>,
}

/// Gradients of a loss with respect to outputs, in their shapes; None: zeros.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModelGradients<'a> {
    /// [`PassFlags::TENSORS`]: take what the model's tensors hold.
    pub flags: PassFlags,
    /// `[objects,M,3]`
    pub means: Option<&'a [f32]>,
    /// `[objects,M,1]`
    pub opacities: Option<&'a [f32]>,
    /// `[objects,M,3]`
    pub scales: Option<&'a [f32]>,
    /// `[objects,M,4]`
    pub rotations: Option<&'a [f32]>,
    /// `[objects,M,K,3]`
    pub sh: Option<&'a [f32]>,
}

object! {
    /// A network from images to Gaussians, with its parameters on a device.
    ///
    /// The caller synchronises calls on one model: it can be sent to another thread but not shared.
    /// What shares its network (a trainer, a training, an optimizer) may be on another thread: their
    /// calls wait for each other.
    ///
    /// ```compile_fail,E0277
    /// fn shared<T: Sync>() {}
    /// shared::<splat::Model>();
    /// ```
    Model, splat_model, splat_model_destroy, serial: Serial
}

// SAFETY: model.h: the caller synchronises calls on one model. It is not Sync, and other handles of
// the same network share `serial`.
unsafe impl Send for Model {}

impl Model {
    /// Create a model; its parameters are zero.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let device = Device::create(&Default::default())?;
    /// # let config = "model: {base_dim: 8, num_blocks: 1, channel_mult: [1, 2], attention_resolutions: [8]}\n\
    /// #               data: {training_resolution: 16}\n";
    /// let desc = ModelDesc { config: Some(config), ..Default::default() };
    /// let model = Model::create(&device, &desc)?;
    /// model.init(1)?;
    /// let input = ModelInput { images: Some(&[0.5; 3 * 16 * 16]), ..Default::default() };
    /// model.forward(&input)?;
    /// assert_eq!(model.scene(0)?.get_info()?.count, 16 * 16);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (an unknown key of the configuration, a value outside its range),
    /// `Unsupported`, and out of memory.
    pub fn create(device: &Device, desc: &ModelDesc<'_>) -> Result<Model> {
        let config = c_optional("config", desc.config)?;
        let raw = sys::splat_model_desc {
            flags: desc.flags.0,
            config: pointer(&config),
            objects: desc.objects,
            precision: desc.precision.0,
            ..Default::default()
        };
        Model::made(|handle| call!(splat_model_create(device.handle, &raw, handle)))
    }

    /// Initialise the parameters at random, as the published code does.
    /// # Errors
    /// Errors of the device.
    pub fn init(&self, seed: u64) -> Result<()> {
        self.serial.with(|| call!(splat_model_init(self.handle, seed)))
    }

    /// Load the parameters of a state dict, all or none.
    /// # Errors
    /// `ShapeMismatch`, naming the tensor, `InvalidArgument` (a missing tensor, and without
    /// [`LoadFlags::GRAFT`] one that the model lacks), `InvalidState`.
    pub fn load(&self, weights: &Weights, flags: LoadFlags) -> Result<()> {
        self.serial.with(|| call!(splat_model_load(self.handle, weights.handle, flags.0)))
    }

    /// Store the model as a state dict.
    /// # Errors
    /// Errors of the device.
    pub fn store(&self) -> Result<Weights> {
        self.serial.with(|| Weights::made(|weights| call!(splat_model_store(self.handle, weights))))
    }

    /// Export the parameters in another form.
    /// # Errors
    /// `InvalidState` (a model without adapters).
    pub fn export(&self, what: Export) -> Result<Weights> {
        self.serial.with(|| {
            Weights::made(|weights| call!(splat_model_export(self.handle, what.0, weights)))
        })
    }

    /// JSON: sizes, ledger, ports, parameters, what was loaded, configuration.
    /// # Errors
    /// Another version of the library.
    pub fn report(&self) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_model_report(self.handle, buffer, capacity, needed)
        })
    }

    /// Describe the model and its latest pass.
    /// # Errors
    /// Another version of the library.
    pub fn get_info(&self) -> Result<ModelInfo> {
        let mut info = sys::splat_model_info::default();
        call!(splat_model_get_info(self.handle, &mut info))?;
        Ok(ModelInfo::from_raw(&info))
    }

    /// List the inputs, outputs or parameters.
    /// # Errors
    /// `InvalidArgument` (kind).
    pub fn ports(&self, kind: PortKind) -> Result<Vec<Port>> {
        self.serial.with(|| {
            // SAFETY: the ports live through the call.
            let raw = items(|ports, capacity, count| unsafe {
                sys::splat_model_ports(self.handle, kind.0, ports, capacity, count)
            })?;
            Ok(raw.iter().map(Port::from_raw).collect())
        })
    }

    /// Get a tensor that shares the model's memory, by name: an input, an output, a parameter,
    /// "grad:" and a name, or "means\[1\]" for the part of object 1.
    /// # Errors
    /// `NotFound`, `InvalidState` (no such gradient is computed), `Unsupported`.
    pub fn tensor(&self, name: &str) -> Result<Tensor> {
        let name = c_text("name", name)?;
        self.serial.with(|| {
            Tensor::wrap(|handle| call!(splat_model_tensor(self.handle, name.as_ptr(), handle)))
        })
    }

    /// Run the network. Arrays are read before the call returns.
    /// # Errors
    /// `ShapeMismatch`, `InvalidArgument`, `InvalidState` (a tensor of the model is
    /// mapped), in each case with the last pass unchanged; errors of the device.
    pub fn forward(&self, input: &ModelInput<'_>) -> Result<()> {
        let pictures: Vec<sys::splat_image> =
            input.pictures.iter().map(|picture| picture.to_raw()).collect();
        let (images, images_count) = array("images", input.images)?;
        let (view_to_world, view_to_world_count) = array("view_to_world", input.view_to_world)?;
        let (quaternions, quaternions_count) = array("quaternions", input.quaternions)?;
        let (focals, focals_count) = array("focals", input.focals)?;
        let (embedding, embedding_count) = array("embedding", input.embedding)?;
        let (tokens, tokens_count) = array("tokens", input.tokens)?;
        let none = pictures.is_empty();
        let raw = sys::splat_model_input {
            flags: input.flags.0,
            seed: input.seed,
            step: input.step,
            channels: input.channels,
            objects: input.objects,
            picture_count: count("pictures", pictures.len())?,
            pictures: if none { std::ptr::null() } else { pictures.as_ptr() },
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
            ..Default::default()
        };
        self.serial.with(|| call!(splat_model_forward(self.handle, &raw)))
    }

    /// Copy a tensor of [`Model::tensor`] into `values`, which has at least its numbers.
    /// # Errors
    /// `InvalidArgument` (a slice that is too short), `NotFound` (no such name), `InvalidState`
    /// (before the first pass, no gradient, a tensor of the model is mapped), errors of the device.
    pub fn read(&self, name: &str, values: &mut [f32]) -> Result<()> {
        let name = c_text("name", name)?;
        let bytes = std::mem::size_of_val(values);
        self.serial.with(|| {
            call!(splat_model_read(self.handle, name.as_ptr(), values.as_mut_ptr(), bytes))
        })
    }

    /// Copy a tensor of [`Model::ports`], or the gradient of one, into a new vector.
    /// # Errors
    /// `NotFound`, and as [`Model::read`].
    pub fn to_vec(&self, name: &str) -> Result<Vec<f32>> {
        let base = name.strip_prefix("grad:").unwrap_or(name);
        for kind in [PortKind::OUTPUT, PortKind::INPUT, PortKind::PARAMETER] {
            if let Some(port) = self.ports(kind)?.iter().find(|port| port.name == base) {
                let mut values = zeros(name, &[elements(&port.dims)])?;
                self.read(name, &mut values)?;
                return Ok(values);
            }
        }
        Err(Error::new(
            Code::NotFound,
            format!("the model has no tensor '{name}'; Model::ports lists them"),
        ))
    }

    /// Set a parameter, by the name of the state dict. `values`: exactly its numbers.
    /// # Errors
    /// `InvalidArgument` (a value that is not finite), `NotFound` (no such parameter),
    /// `ShapeMismatch` (bytes), `OutOfHostMemory`, errors of the device.
    pub fn write(&self, name: &str, values: &[f32]) -> Result<()> {
        let name = c_text("name", name)?;
        let bytes = std::mem::size_of_val(values);
        self.serial
            .with(|| call!(splat_model_write(self.handle, name.as_ptr(), values.as_ptr(), bytes)))
    }

    /// Copy the Gaussians of one object into a new scene.
    /// # Errors
    /// `InvalidArgument` (a slice that is too short), `NotFound` (no such name), `InvalidState`
    /// (before the first pass, no gradient, a tensor of the model is mapped), errors of the device.
    pub fn scene(&self, object: u32) -> Result<Scene> {
        self.serial
            .with(|| Scene::made(|handle| call!(splat_model_scene(self.handle, object, handle))))
    }

    /// Add the gradients of a loss to the gradients of parameters; once after each forward pass.
    /// # Errors
    /// `InvalidState` without [`ModelFlags::GRADIENTS`] or a pass, or after inputs or
    /// parameters have changed; `ShapeMismatch`, errors of the device.
    pub fn backward(&self, gradients: &ModelGradients<'_>) -> Result<()> {
        let (means, means_count) = array("means", gradients.means)?;
        let (opacities, opacities_count) = array("opacities", gradients.opacities)?;
        let (scales, scales_count) = array("scales", gradients.scales)?;
        let (rotations, rotations_count) = array("rotations", gradients.rotations)?;
        let (sh, sh_count) = array("sh", gradients.sh)?;
        let raw = sys::splat_model_gradients {
            flags: gradients.flags.0,
            means,
            means_count,
            opacities,
            opacities_count,
            scales,
            scales_count,
            rotations,
            rotations_count,
            sh,
            sh_count,
            ..Default::default()
        };
        self.serial.with(|| call!(splat_model_backward(self.handle, &raw)))
    }

    /// Set the gradients of all parameters to zero.
    /// # Errors
    /// Errors of the device.
    pub fn zero_gradients(&self) -> Result<()> {
        self.serial.with(|| call!(splat_model_zero_gradients(self.handle)))
    }
}
