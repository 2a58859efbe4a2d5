//! Weights, operators, modules, models and the optimizer.

mod support;

use splat::{
    Code, LoadFlags, Model, ModelDesc, ModelFlags, ModelGradients, ModelInput, Module, ModuleDesc,
    ModuleFlags, NamedArray, Op, OpDesc, Optimizer, OptimizerDesc, OptimizerGroup, OptimizerItem,
    PortKind, Tensor, Weights, WeightsFlags, WeightsFormat,
};
use support::{device, Folder};

const TINY: &str = "model: {base_dim: 8, num_blocks: 1, channel_mult: [1, 2], \
                    attention_resolutions: [8]}\ndata: {training_resolution: 16}\n";

#[test]
fn weights_keep_their_numbers_in_files() {
    let folder = Folder::new("weights");
    let arrays = [
        NamedArray { name: "a.weight", values: &[1.0, 2.0, 3.0, 4.0], dims: &[2, 2] },
        NamedArray { name: "empty", values: &[], dims: &[0, 3] },
        NamedArray { name: "scalar", values: &[5.0], dims: &[] },
    ];
    let weights = Weights::from_arrays(&arrays).unwrap();
    let bytes = weights.save_memory(WeightsFormat::SAFETENSORS, WeightsFlags::default()).unwrap();
    weights.save(folder.join("a.safetensors"), WeightsFlags::default()).unwrap();
    assert_eq!(std::fs::read(folder.join("a.safetensors")).unwrap(), bytes);
    let copy = Weights::load(folder.join("a.safetensors"), WeightsFlags::COPY).unwrap();
    assert_eq!(copy.count().unwrap(), 3);
    let index = copy.find("a.weight").unwrap();
    let info = copy.get_info(index).unwrap();
    assert_eq!((info.name.as_str(), info.dtype.as_str()), ("a.weight", "float32"));
    assert_eq!(info.dims, [2, 2]);
    assert_eq!(copy.to_vec(index).unwrap(), [1.0, 2.0, 3.0, 4.0]);
    // SAFETY: the values were copied.
    assert_eq!(unsafe { copy.data(index) }.unwrap(), [1.0, 2.0, 3.0, 4.0]);
    // SAFETY: as above.
    assert!(unsafe { copy.data(copy.find("empty").unwrap()) }.unwrap().is_empty());
    assert!(copy.report().unwrap().contains("safetensors"));
    assert_eq!(copy.find("b").unwrap_err().code(), Code::NotFound);
    assert!(copy.read(index, &mut [0.0; 3]).is_err());
    assert!(copy.get_info(3).is_err());
    assert!(copy.fold(None, 1.0, Default::default()).is_err());
}

#[test]
fn bad_weights_are_refused() {
    let wrong = NamedArray { name: "a", values: &[1.0, 2.0], dims: &[3] };
    assert_eq!(Weights::from_arrays(&[wrong]).unwrap_err().code(), Code::ShapeMismatch);
    let fine = NamedArray { name: "a", values: &[1.0], dims: &[1] };
    assert_eq!(Weights::from_arrays(&[fine, fine]).unwrap_err().code(), Code::InvalidArgument);
    let deep = NamedArray { name: "a", values: &[1.0], dims: &[1; 9] };
    assert_eq!(Weights::from_arrays(&[deep]).unwrap_err().code(), Code::InvalidArgument);
    assert_eq!(Weights::load_memory(b"no weights").unwrap_err().code(), Code::Format);
    let missing = Weights::load("no.safetensors", WeightsFlags::default());
    assert_eq!(missing.unwrap_err().code(), Code::NotFound);
}

#[test]
fn operators_compute_and_differentiate() {
    let make = |values: &[f32]| Tensor::from_slice(device(), &[1, 4], values).unwrap();
    let (x, y) = (make(&[-1.0, 0.0, 2.0, -3.0]), make(&[0.0; 4]));
    let (grad_x, grad_y) = (make(&[0.0; 4]), make(&[1.0, 1.0, 5.0, 1.0]));
    let desc = OpDesc {
        type_name: "relu",
        inputs: &[Some(&x)],
        outputs: &[Some(&y)],
        grad_outputs: &[Some(&grad_y)],
        grad_inputs: &[Some(&grad_x)],
        ..Default::default()
    };
    let op = Op::create(device(), &desc).unwrap();
    assert_eq!(op.backward().unwrap_err().code(), Code::InvalidState);
    op.forward().unwrap();
    op.backward().unwrap();
    assert_eq!(y.to_vec::<f32>().unwrap(), [0.0, 0.0, 2.0, 0.0]);
    assert_eq!(grad_x.to_vec::<f32>().unwrap(), [0.0, 0.0, 5.0, 0.0]);
    let short = OpDesc { grad_inputs: &[None, None], ..desc };
    assert_eq!(Op::create(device(), &short).unwrap_err().code(), Code::ShapeMismatch);
    let unknown = OpDesc { type_name: "relux", ..desc };
    assert_eq!(Op::create(device(), &unknown).unwrap_err().code(), Code::InvalidArgument);
    let attributes = OpDesc { attributes: Some("{"), ..desc };
    assert!(Op::create(device(), &attributes).is_err());
    assert!(splat::op_list().unwrap().contains("\"relu\""));
}

fn linear(flags: ModuleFlags) -> Module {
    let desc = ModuleDesc {
        flags,
        type_name: "linear",
        ports: &[("x", &[2, 3]), ("weight", &[4, 3]), ("bias", &[4])],
        ..Default::default()
    };
    Module::create(device(), &desc).unwrap()
}

#[test]
fn rows_move_with_their_moments() {
    let means = Tensor::from_slice(device(), &[3, 2], &[0.0f32, 1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
    let grads = Tensor::from_slice(device(), &[3, 2], &[0.0f32; 6]).unwrap();
    let items = [OptimizerItem::Tensor { name: "set.means", parameter: &means, gradient: &grads }];
    let desc = OptimizerDesc { items: &items, ..Default::default() };
    let optimizer = Optimizer::create(device(), &desc).unwrap();
    optimizer.gather_rows("set.*", &[2, 0]).unwrap();
    assert_eq!(means.to_vec::<f32>().unwrap()[..4], [4.0, 5.0, 0.0, 1.0]);
    assert_eq!(optimizer.get_info().unwrap().elements, 4);
    assert!(optimizer.gather_rows("set.*", &[2]).is_err());
    assert!(optimizer.gather_rows("set.*", &[]).is_err());
}

#[test]
fn modules_learn_with_an_optimizer() {
    let module = linear(ModuleFlags::GRADIENTS);
    module.init(3).unwrap();
    module.write("x", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0]).unwrap();
    module.write("grad:y", &[1.0; 8]).unwrap();
    let items = [OptimizerItem::Module(Some("layer."), &module)];
    let groups = [OptimizerGroup { pattern: "*.bias", rate_factor: 0.5, ..Default::default() }];
    let desc = OptimizerDesc { items: &items, groups: &groups, rate: 0.1, ..Default::default() };
    let optimizer = Optimizer::create(device(), &desc).unwrap();
    let before = module.to_vec("bias").unwrap();
    optimizer.zero_gradients().unwrap();
    module.forward().unwrap();
    module.backward().unwrap();
    assert_eq!(module.to_vec("grad:bias").unwrap(), [2.0; 4]);
    let info = optimizer.step().unwrap();
    assert_eq!((info.step, info.was_skipped, info.parameters), (1, false, 2));
    let after = module.to_vec("bias").unwrap();
    assert!(before.iter().zip(&after).all(|(b, a)| (b - a - 0.05).abs() < 1e-6), "{after:?}");
    let state = optimizer.save().unwrap();
    optimizer.set_rate(0.2).unwrap();
    assert!(optimizer.set_rate(-1.0).is_err());
    optimizer.load(&state).unwrap();
    assert_eq!(optimizer.get_info().unwrap().rate, info.rate);
    let stored = optimizer.store().unwrap();
    assert!(stored.find("layer.weight").is_ok());
    assert!(optimizer.load(&stored).is_err());
    let idle = [OptimizerGroup { pattern: "nothing*", ..Default::default() }];
    assert!(Optimizer::create(device(), &OptimizerDesc { groups: &idle, ..desc }).is_err());
}

#[test]
fn bad_calls_of_modules_are_refused() {
    let module = linear(ModuleFlags::default());
    assert_eq!(module.write("x", &[0.0; 5]).unwrap_err().code(), Code::ShapeMismatch);
    assert_eq!(module.write("z", &[0.0; 6]).unwrap_err().code(), Code::NotFound);
    assert_eq!(module.to_vec("z").unwrap_err().code(), Code::NotFound);
    assert_eq!(module.backward().unwrap_err().code(), Code::InvalidState);
    let error = module.read("y", &mut [0.0; 8]).unwrap_err();
    assert_eq!(error.code(), Code::InvalidState, "{error}");
    let names: Vec<String> =
        module.ports(PortKind::PARAMETER).unwrap().into_iter().map(|port| port.name).collect();
    assert_eq!(names, ["weight", "bias"]);
    assert!(module.report().unwrap().contains("linear"));
    let item = [OptimizerItem::Module(None, &module)];
    let desc = OptimizerDesc { items: &item, ..Default::default() };
    assert!(Optimizer::create(device(), &desc).is_err());
    let ports: &[(&str, &[i64])] = &[("x", &[2, 3]), ("weight", &[4, 5])];
    let wrong = ModuleDesc { type_name: "linear", ports, ..Default::default() };
    assert_eq!(Module::create(device(), &wrong).unwrap_err().code(), Code::ShapeMismatch);
}

#[test]
fn models_predict_and_differentiate() {
    let desc = ModelDesc { flags: ModelFlags::GRADIENTS, config: Some(TINY), ..Default::default() };
    let model = Model::create(device(), &desc).unwrap();
    model.init(1).unwrap();
    let info = model.get_info().unwrap();
    assert_eq!((info.resolution, info.views, info.gaussians), (16, 1, 256));
    let images = vec![0.5; 3 * 16 * 16];
    let input = ModelInput { images: Some(&images), ..Default::default() };
    model.forward(&input).unwrap();
    let means = model.to_vec("means").unwrap();
    assert_eq!(means.len(), 3 * 256);
    let scene = model.scene(0).unwrap();
    assert_eq!(scene.get_info().unwrap().count, 256);
    let shared = model.tensor("means[0]").unwrap();
    assert_eq!((shared.dims(), shared.to_vec::<f32>().unwrap()), (&[256, 3][..], means));
    model.backward(&ModelGradients { means: Some(&vec![1.0; 768]), ..Default::default() }).unwrap();
    let parameter = model.ports(PortKind::PARAMETER).unwrap().remove(0).name;
    let gradient = model.tensor(&format!("grad:{parameter}")).unwrap();
    assert!(gradient.check().unwrap().nan_count == 0);
    model.zero_gradients().unwrap();
    let stored = model.store().unwrap();
    let second = Model::create(device(), &ModelDesc { config: Some(TINY), ..desc }).unwrap();
    second.load(&stored, LoadFlags::default()).unwrap();
    assert_eq!(second.to_vec(&parameter).unwrap(), model.to_vec(&parameter).unwrap());
    assert!(second.report().unwrap().contains("\"copied\""));
}

#[test]
fn bad_calls_of_models_are_refused() {
    let create = |config| Model::create(device(), &ModelDesc { config, ..Default::default() });
    let error = create(Some("model: {base_dmi: 8}")).unwrap_err();
    assert_eq!(error.code(), Code::InvalidArgument);
    assert!(error.message().contains("base_dim"), "{error}");
    let model = create(Some(TINY)).unwrap();
    let pass = |images| model.forward(&ModelInput { images, ..Default::default() });
    assert_eq!(pass(Some(&[0.0; 5][..])).unwrap_err().code(), Code::ShapeMismatch);
    assert!(pass(Some(&[][..])).unwrap_err().message().contains("images"));
    assert_eq!(pass(None).unwrap_err().code(), Code::InvalidArgument);
    assert_eq!(model.tensor("nothing").unwrap_err().code(), Code::NotFound);
    assert_eq!(model.to_vec("nothing").unwrap_err().code(), Code::NotFound);
    assert_eq!(model.scene(0).unwrap_err().code(), Code::InvalidState);
    assert_eq!(model.backward(&Default::default()).unwrap_err().code(), Code::InvalidState);
    let wrong = NamedArray { name: "a", values: &[1.0], dims: &[1] };
    let weights = Weights::from_arrays(&[wrong]).unwrap();
    assert!(model.load(&weights, LoadFlags::default()).is_err());
    assert!(model.export(splat::Export::ADAPTERS).is_err());
}
