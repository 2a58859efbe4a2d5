//! The eleven cases of bindings/smoke/README.md in Rust. One argument: the folder of the data.

use splat::{
    normals_from_depth, picture_mask, prior_scores, sys, Camera, Code, Dataset, DatasetDesc,
    DatasetViews, Device, ExportDesc, Gaussians, Gradients, ImageView, ImageViewMut, MapFilter,
    NormalsDesc, OrbitDesc, Output, Picture, Predictor, RasterState, Rasterizer, RasterizerDesc,
    RasterizerFlags, Result, RunEventKind, Scene, SceneDesc, SceneFileDesc, SceneFormat, Tensor,
    Training, TrainingDesc, TrainingFlags,
};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

const GAUSSIANS: usize = 1000;
const SIZE: [u32; 2] = [144, 96];
const PIXELS: usize = 144 * 96;
const WHITE: Option<[f32; 3]> = Some([1.0; 3]);

fn fnv(bytes: impl IntoIterator<Item = u8>) -> String {
    let mix = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(1099511628211);
    format!("{:016x}", bytes.into_iter().fold(14695981039346656037, mix))
}

fn floats(values: &[f32]) -> String {
    fnv(values.iter().flat_map(|value| value.to_le_bytes()))
}

fn quoted(text: &str) -> String {
    let mut quoted = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            '\0'..='\u{1f}' => quoted += &format!("\\u{:04x}", u32::from(c)),
            _ => quoted.push(c),
        }
    }
    quoted + "\""
}

/// 1000 Gaussians of degree 1, exact in float32.
fn scene() -> Result<Scene> {
    let mut state = 1_u32;
    let mut draw = |divisor: f32| {
        state = state.wrapping_mul(1664525).wrapping_add(1013904223);
        ((state >> 24) as f32 - 128.0) / divisor
    };
    let (mut means, mut log_scales, mut rotations) = (Vec::new(), Vec::new(), Vec::new());
    let (mut opacity_logits, mut sh) = (Vec::new(), Vec::new());
    for _ in 0..GAUSSIANS {
        means.extend((0..3).map(|_| draw(128.0)));
        log_scales.extend((0..3).map(|_| -4.0 - draw(128.0)));
        rotations.push(1.0);
        rotations.extend((0..3).map(|_| draw(256.0)));
        opacity_logits.push(draw(32.0));
        sh.extend((0..12).map(|_| draw(128.0)));
    }
    Scene::create(&SceneDesc {
        count: GAUSSIANS as u64,
        sh_degree: 1,
        means: Some(&means),
        log_scales: Some(&log_scales),
        rotations: Some(&rotations),
        opacity_logits: Some(&opacity_logits),
        sh: Some(&sh),
        ..Default::default()
    })
}

fn cameras(scene: &Scene) -> Result<Vec<Camera>> {
    let [width, height] = SIZE;
    let desc = OrbitDesc {
        width,
        height,
        elevation: 0.5,
        ..Default::default()
    };
    Camera::orbit(scene, &desc, 2)
}

fn rasterizer(device: &Device) -> Result<Rasterizer> {
    let desc = RasterizerDesc {
        flags: RasterizerFlags::BACKWARD,
        gaussians: GAUSSIANS as u32,
        views: 2,
        width: SIZE[0],
        height: SIZE[1],
        sh_degree: 1,
        ..Default::default()
    };
    Rasterizer::create(device, &desc)
}

/// RGBA of 80 x 64 pixels: a disc.
fn picture() -> Vec<u8> {
    let pixel = |i: i32| {
        let (x, y) = (i % 80, i / 80);
        let inside = (2 * x - 79).pow(2) + (2 * y - 63).pow(2) < 2304;
        [
            (5 * x) as u8,
            (7 * y) as u8,
            (x * y) as u8,
            if inside { 255 } else { 0 },
        ]
    };
    (0..80 * 64).flat_map(pixel).collect()
}

fn ply(scene: &Scene) -> Result<String> {
    let desc = SceneFileDesc {
        format: SceneFormat::PLY,
        ..Default::default()
    };
    Ok(fnv(scene.save_memory(&desc)?))
}

fn render(device: &Device) -> Result<()> {
    let (scene, rasterizer) = (scene()?, rasterizer(device)?);
    rasterizer.forward_scene(None, &scene, &cameras(&scene)?, WHITE)?;
    let rgb = rasterizer.to_vec(None, Output::RGB)?;
    let mut rgba = vec![0_u8; 4 * PIXELS];
    let view = ImageViewMut::new(&mut rgba, SIZE, 4)?;
    rasterizer.read_images(None, Output::RGB, 1, &mut [view])?;
    println!(
        r#"{{"case":"render","rgb":"{}","rgba":"{}"}}"#,
        floats(&rgb),
        fnv(rgba)
    );
    Ok(())
}

fn gradient(device: &Device) -> Result<()> {
    let (scene, rasterizer) = (scene()?, rasterizer(device)?);
    let tensor = |name: &str| scene.to_tensor(name, device);
    let (means, scales, rotations) = (tensor("means")?, tensor("scales")?, tensor("rotations")?);
    let (opacities, sh) = (tensor("opacities")?, tensor("sh")?);
    let gaussians = Gaussians {
        means: Some(&means),
        scales: Some(&scales),
        rotations: Some(&rotations),
        opacities: Some(&opacities),
        sh: Some(&sh),
        ..Default::default()
    };
    rasterizer.forward(None, &gaussians, &cameras(&scene)?, WHITE)?;
    let ones = vec![1.0_f32; 2 * 3 * PIXELS];
    let grad_rgb = Tensor::from_slice(device, &[2, 96, 144, 3], &ones)?;
    let grad_means = Tensor::from_slice(device, &[1000, 3], &[0.0_f32; 3 * GAUSSIANS])?;
    let grad_opacities = Tensor::from_slice(device, &[1000], &[0.0_f32; GAUSSIANS])?;
    let gradients = Gradients {
        grad_rgb: Some(&grad_rgb),
        grad_means: Some(&grad_means),
        grad_opacities: Some(&grad_opacities),
        ..Default::default()
    };
    rasterizer.backward(None, &gradients)?;
    let (means, opacities) = (grad_means.to_vec()?, grad_opacities.to_vec()?);
    let (means, opacities) = (floats(&means), floats(&opacities));
    println!(r#"{{"case":"gradient","means":"{means}","opacities":"{opacities}"}}"#);
    Ok(())
}

fn predict(predictor: &Predictor, pictures: &[Picture<'_>]) -> Result<()> {
    let (scene, facts) = predictor.predict_with_facts(pictures, false)?;
    println!(
        r#"{{"case":"predict","gaussians":{},"ply":"{}","found":{}}}"#,
        facts.gaussians,
        ply(&scene)?,
        facts.pictures[0].found.0
    );
    Ok(())
}

fn doubles(values: &[f64]) -> String {
    fnv(values.iter().flat_map(|value| value.to_le_bytes()))
}

fn judge(scene: &Scene) -> Result<()> {
    const SIZE: [u32; 2] = [48, 48];
    let map = |a: usize, b: usize, c: usize| -> Vec<f32> {
        let place = |i: usize| (i % 48, i / 48);
        (0..48 * 48)
            .map(|i| {
                let (x, y) = place(i);
                ((a * x * y + b * x + c * y) % 64 + 1) as f32 / 64.0
            })
            .collect()
    };
    let (p, g) = (map(3, 1, 2), map(1, 3, 5));
    let join = |third: &dyn Fn(f32, f32) -> f32, first: &[f32], second: &[f32]| -> Vec<f32> {
        let pairs = first.iter().zip(second);
        pairs.flat_map(|(a, b)| [*a, *b, third(*a, *b)]).collect()
    };
    let (predicted, truth) = (join(&|_, _| 1.0, &p, &g), join(&|_, _| 1.0, &g, &p));
    let points = join(&|a, b| a - b, &p, &g);
    let (a, b) = (ImageView::new(&p, SIZE, 1)?, ImageView::new(&g, SIZE, 1)?);
    let depth = prior_scores::compare_depth(a, b, None, Default::default())?;
    let normal = prior_scores::compare_normals(
        ImageView::new(&predicted, SIZE, 3)?,
        ImageView::new(&truth, SIZE, 3)?,
        None,
        Default::default(),
    )?;
    let mask = prior_scores::compare_masks(a, b, Default::default())?;
    let fidelity = prior_scores::compare_fidelity(a, b, Default::default())?;
    let mut edges = vec![0_f32; 48 * 48];
    prior_scores::filter_map(b, MapFilter::CANNY, ImageViewMut::new(&mut edges, SIZE, 1)?)?;
    let s = scene.compare_points(&points, 0.25, 0.0)?;
    let [d0, d1, d2] = depth.within;
    let [n0, n1, n2] = normal.within;
    println!(
        r#"{{"case":"judge","depth":"{}","normal":"{}","mask":"{}","fidelity":"{}","edges":"{}","points":"{}"}}"#,
        doubles(&[
            depth.abs_rel,
            depth.rmse,
            depth.si_rmse,
            d0,
            d1,
            d2,
            depth.scale,
            depth.shift
        ]),
        doubles(&[normal.mean, normal.median, normal.rmse, n0, n1, n2]),
        doubles(&[mask.mae, mask.iou, mask.precision, mask.recall, mask.f_beta]),
        doubles(&[fidelity.vif]),
        floats(&edges),
        doubles(&[
            s.accuracy,
            s.completeness,
            s.chamfer,
            s.chamfer_squared,
            s.precision,
            s.recall,
            s.f_score
        ])
    );
    Ok(())
}

fn maps(pixels: &[u8]) -> Result<()> {
    let mut mask = vec![0_u8; 80 * 64];
    let picture = ImageView::new(pixels, [80, 64], 4)?;
    let found = picture_mask(picture, ImageViewMut::new(&mut mask, [80, 64], 1)?)?;
    let p: Vec<f32> = (0..48 * 48)
        .map(|i| {
            let (x, y) = (i % 48, i / 48);
            ((3 * x * y + x + 2 * y) % 64 + 1) as f32 / 64.0
        })
        .collect();
    let mut normals = vec![0_f32; 48 * 48 * 3];
    let desc = NormalsDesc {
        focal: [48.0; 2],
        distances: [1.0, 2.0],
        ..Default::default()
    };
    normals_from_depth(
        ImageView::new(&p, [48, 48], 1)?,
        &desc,
        ImageViewMut::new(&mut normals, [48, 48], 3)?,
    )?;
    println!(
        r#"{{"case":"maps","found":{},"mask":"{}","normal":"{}"}}"#,
        found.0,
        fnv(mask),
        floats(&normals)
    );
    Ok(())
}

fn data(folder: &str) -> Result<()> {
    let store = format!("{folder}/store_rust");
    let open = |path: &str| {
        Dataset::open(&DatasetDesc {
            path: Some(path.as_ref()),
            ..Default::default()
        })
    };
    let dataset = open(folder)?;
    for shard in [1, 0] {
        let part = ExportDesc {
            path: Some(store.as_ref()),
            layout: Some("store"),
            shards: 2,
            shard,
            ..Default::default()
        };
        dataset.export(&part, None)?;
    }
    let mut images = vec![0_f32; 4 * 3 * 16 * 16];
    let mut views = DatasetViews {
        images: Some(&mut images),
        ..Default::default()
    };
    open(&store)?.read(1, &[0, 1, 2, 3], &mut views)?;
    println!(
        r#"{{"case":"data","objects":2,"rgb":"{}"}}"#,
        floats(&images)
    );
    Ok(())
}

fn errors() {
    let error = Device::describe(9999).expect_err("there is a device 9999");
    let (code, message) = (error.code(), quoted(error.message()));
    println!(
        r#"{{"case":"error","code":{},"name":"{}","message":{message}}}"#,
        code.to_raw(),
        code.c_name()
    );
    let mut scene = std::ptr::null_mut();
    // SAFETY: the structs live through the calls; the library refuses a destroyed handle.
    let code = unsafe {
        sys::splat_scene_create(&sys::splat_scene_desc::default(), &mut scene);
        sys::splat_scene_destroy(scene);
        sys::splat_scene_get_info(scene, &mut sys::splat_scene_info::default())
    };
    let name = Code::from_raw(code).c_name();
    println!(r#"{{"case":"handle","code":{code},"name":"{name}"}}"#);
}

/// The kind of the last event of a training that another thread interrupts.
fn interrupted(device: &Device, folder: &str) -> Result<RunEventKind> {
    let config = std::fs::read_to_string(format!("{folder}/config.json")).expect("config.json");
    let (run, root) = (
        format!("{folder}/run_rust"),
        format!("data.root='{folder}'"),
    );
    let desc = TrainingDesc {
        flags: TrainingFlags::OVERWRITE,
        folder: Some(run.as_ref()),
        config: Some(&config),
        values: &[&root],
        ..Default::default()
    };
    let mut training = Training::open(device, &desc)?;
    let interrupter = training.interrupter();
    let (mut asked, mut last) = (false, RunEventKind::default());
    for event in training.by_ref() {
        last = event?.kind;
        if last == RunEventKind::STEP && !asked {
            asked = true;
            let thread = thread::spawn(move || interrupter.interrupt());
            thread.join().expect("the thread panicked")?;
        }
    }
    Ok(last)
}

fn cancel(
    device: &Device,
    predictor: &Predictor,
    pictures: &[Picture<'_>],
    folder: &str,
) -> Result<()> {
    let event = interrupted(device, folder)?;
    let done = AtomicBool::new(false);
    let error = thread::scope(|scope| {
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) && device.cancel().is_ok() {
                thread::sleep(Duration::from_millis(1));
            }
        });
        let error = std::iter::repeat_with(|| predictor.predict(pictures).err())
            .flatten()
            .next();
        done.store(true, Ordering::Relaxed);
        error
    });
    let code = error.expect("a call was cancelled").code();
    println!(
        r#"{{"case":"cancel","event":{},"code":{},"name":"{}"}}"#,
        event.0,
        code.to_raw(),
        code.c_name()
    );
    Ok(())
}

/// Objects are dropped while another thread computes.
fn busy(pictures: &[Picture<'_>]) -> Result<()> {
    let device = Device::create(&Default::default())?;
    let predictor = Predictor::create(&device, &Default::default())?;
    let square = |_| Tensor::from_slice(&device, &[64, 64], &[0.0_f32; 4096]);
    let tensors = (0..8).map(square).collect::<Result<Vec<Tensor>>>()?;
    let (drawn, rasterizer) = (scene()?, rasterizer(&device)?);
    rasterizer.forward_scene(None, &drawn, &cameras(&drawn)?, WHITE)?;
    let last = thread::scope(|scope| {
        let worker = scope.spawn(|| -> Result<Scene> {
            (0..3).try_for_each(|_| predictor.predict(pictures).map(drop))?;
            predictor.predict(pictures)
        });
        drop(device);
        drop(tensors);
        drop(drawn);
        drop(rasterizer);
        worker.join().expect("the thread panicked")
    })?;
    println!(r#"{{"case":"busy","ply":"{}","result":"ok"}}"#, ply(&last)?);
    Ok(())
}

/// Objects of a device are dropped in mixed order, after the device or before; returns the live
/// bytes of its memory, or 0 without it.
fn dropped(pictures: &[Picture<'_>], device_first: bool) -> Result<u64> {
    let mut device = Some(Device::create(&Default::default())?);
    let open = device.as_ref().expect("just opened");
    let tensor = Tensor::from_slice(open, &[64, 64], &[0.0_f32; 4096])?;
    let rasterizer = rasterizer(open)?;
    let state = RasterState::create(&rasterizer)?;
    let scene = scene()?;
    rasterizer.forward_scene(Some(&state), &scene, &cameras(&scene)?, WHITE)?;
    let predictor = Predictor::create(open, &Default::default())?;
    drop(predictor.predict(pictures)?);
    if device_first {
        drop(device.take());
        tensor.write(&[1.0_f32; 4096], None)?;
    }
    drop(rasterizer);
    drop(predictor);
    drop(tensor);
    drop(scene);
    drop(state);
    device.map_or(Ok(0), |device| Ok(device.get_memory()?.live_bytes))
}

fn run(folder: &str) -> Result<()> {
    splat::check_library()?;
    println!(
        r#"{{"case":"version","version":"{}","layout":"ok"}}"#,
        splat::version_string()
    );
    let names = splat::prior_preset(None)?;
    println!(
        r#"{{"case":"presets","bytes":{},"names":"{}"}}"#,
        names.len(),
        fnv(names.bytes())
    );
    let device = Device::create(&Default::default())?;
    println!(
        r#"{{"case":"device","kind":{}}}"#,
        device.get_info()?.kind.0
    );
    render(&device)?;
    gradient(&device)?;
    let pixels = picture();
    let pictures = [Picture::pixels(ImageView::new(&pixels, [80, 64], 4)?)];
    let predictor = Predictor::create(&device, &Default::default())?;
    predict(&predictor, &pictures)?;
    judge(&scene()?)?;
    maps(&pixels)?;
    data(folder)?;
    errors();
    cancel(&device, &predictor, &pictures, folder)?;
    busy(&pictures)?;
    let live_bytes = dropped(&pictures, false)?;
    dropped(&pictures, true)?;
    println!(r#"{{"case":"order","live_bytes":{live_bytes},"result":"ok"}}"#);
    Ok(())
}

fn main() {
    let folder = std::env::args().nth(1).unwrap_or_else(|| {
        eprintln!("usage: smoke FOLDER (see bindings/smoke/README.md)");
        std::process::exit(2);
    });
    if let Err(error) = run(&folder) {
        eprintln!("smoke: {error}");
        std::process::exit(1);
    }
}
