//! What several test programs need. Each uses a part.
#![allow(dead_code)]

use splat::{
    Camera, Device, Model, ModelDesc, ModelFlags, Optimizer, OptimizerDesc, OptimizerItem,
    Rasterizer, RasterizerDesc, Scene, SceneDesc, SyntheticDesc,
};
use std::path::{Path, PathBuf};
use std::sync::Once;

/// Width and height of the test images.
pub const SIZE: [u32; 2] = [48, 32];

/// A device that all tests of a program share, and that is open when it exits.
pub fn device() -> &'static Device {
    static START: Once = Once::new();
    static mut DEVICE: Option<&'static Device> = None;
    // SAFETY: written once, before any read.
    unsafe {
        START.call_once(|| {
            DEVICE = Some(Box::leak(Box::new(Device::create(&Default::default()).unwrap())));
        });
        DEVICE.unwrap()
    }
}

/// A network with gradients, and an optimizer of its parameters.
pub fn model_and_optimizer(device: &Device, config: &str) -> (Model, Optimizer) {
    let desc =
        ModelDesc { flags: ModelFlags::GRADIENTS, config: Some(config), ..Default::default() };
    let model = Model::create(device, &desc).unwrap();
    let items = [OptimizerItem::Model(None, &model)];
    let desc = OptimizerDesc { items: &items, ..Default::default() };
    let optimizer = Optimizer::create(device, &desc).unwrap();
    (model, optimizer)
}

/// A grid of opaque Gaussians of different colours around the origin.
pub fn scene(count: usize) -> Scene {
    let spread = |i: usize, step: usize| ((i * step) % 17) as f32 / 16.0 - 0.5;
    let means: Vec<f32> =
        (0..count).flat_map(|i| [spread(i, 3), spread(i, 5), spread(i, 7)]).collect();
    let log_scales = vec![-2.5; 3 * count];
    let opacity_logits = vec![2.0; count];
    let sh: Vec<f32> = means.iter().map(|mean| 2.0 * mean).collect();
    Scene::create(&SceneDesc {
        count: count as u64,
        means: Some(&means),
        log_scales: Some(&log_scales),
        opacity_logits: Some(&opacity_logits),
        sh: Some(&sh),
        ..Default::default()
    })
    .unwrap()
}

/// A camera that sees the scene from the front.
pub fn camera() -> Camera {
    let mut camera = Camera::from_fov(SIZE[0], SIZE[1], 0.9).unwrap();
    camera.look_at([0.0, 0.0, -2.0], [0.0; 3], [0.0, -1.0, 0.0]).unwrap();
    camera
}

/// A rasterizer for the scene and the camera.
pub fn rasterizer(device: &Device, desc: RasterizerDesc) -> Rasterizer {
    let desc = RasterizerDesc { gaussians: 1000, width: SIZE[0], height: SIZE[1], ..desc };
    Rasterizer::create(device, &desc).unwrap()
}

/// An empty folder, removed when dropped.
pub struct Folder(PathBuf);

impl Folder {
    /// `name` differs among the tests of all programs.
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("splat_rust_{name}_{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    pub fn join(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub fn text(&self, name: &str) -> String {
        self.join(name).to_str().unwrap().to_owned()
    }
}

impl AsRef<Path> for Folder {
    fn as_ref(&self) -> &Path {
        &self.0
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).ok();
    }
}

/// Writes so many cars, as a data set of 16 x 16 pixels below the folder.
pub fn cars(folder: &Folder, objects: u32) -> PathBuf {
    let path = folder.join("data");
    let desc = SyntheticDesc {
        path: Some(&path),
        seed: 1,
        resolution: 16,
        train_views: 4,
        train_objects: objects,
        ..Default::default()
    };
    (0..objects).for_each(|index| splat::synthetic_write(&desc, index).unwrap());
    path
}
