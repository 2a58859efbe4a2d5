//! What a call costs in Rust; README.md describes the three measurements. Argument: a scene.

use splat::{
    Camera, Device, OrbitDesc, Output, Rasterizer, RasterizerDesc, Result, Scene, Tensor,
    TensorDesc,
};
use std::time::Instant;

const ROUNDS: usize = 40;
const CALLS: usize = 10_000;
const SIDE: usize = 1024;
const SIZE: [u32; 2] = [144, 240];

/// `"NAME":[shortest, median]` of the rounds in ms, times a factor, after two that do not count.
fn measure(name: &str, factor: f64, mut call: impl FnMut(usize) -> Result<()>) -> Result<String> {
    call(0)?;
    call(1)?;
    let mut times = Vec::new();
    for round in 0..ROUNDS {
        let start = Instant::now();
        call(round)?;
        times.push(start.elapsed().as_secs_f64() * 1e3 * factor);
    }
    times.sort_by(f64::total_cmp);
    Ok(format!(
        r#","{}":[{:.3},{:.3}]"#,
        name,
        times[0],
        times[ROUNDS / 2]
    ))
}

fn main() -> Result<()> {
    let path = std::env::args().nth(1).expect("usage: bench SCENE");
    let device = Device::create(&Default::default())?;
    let desc = TensorDesc {
        dims: vec![SIDE as i64; 2],
        ..Default::default()
    };
    let tensor = Tensor::create(&device, &desc)?;
    let scene = Scene::load(path, &Default::default())?;
    let [width, height] = SIZE;
    let orbit = OrbitDesc {
        width,
        height,
        ..Default::default()
    };
    let cameras = Camera::orbit(&scene, &orbit, 2)?;
    let desc = RasterizerDesc {
        gaussians: scene.get_info()?.count as u32,
        width,
        height,
        ..Default::default()
    };
    let rasterizer = Rasterizer::create(&device, &desc)?;
    let mut numbers = vec![0_f32; SIDE * SIDE];
    let mut pixels = vec![0_f32; (width * height * 3) as usize];
    let get = measure("getter_ns", 1e6 / CALLS as f64, |_| {
        (0..CALLS).try_for_each(|_| tensor.get_info().map(|info| assert!(info.elements > 0)))
    })?;
    let read = measure("read_ms", 1.0, |_| tensor.read(&mut numbers, None))?;
    let render = measure("render_ms", 1.0, |round| {
        // the cameras take turns: an unchanged view is not drawn again
        let camera = &cameras[round % 2..round % 2 + 1];
        rasterizer.forward_scene(None, &scene, camera, None)?;
        rasterizer.read(None, Output::RGB, &mut pixels)
    })?;
    println!(r#"{{"language":"Rust"{}{}{}}}"#, get, read, render);
    Ok(())
}
