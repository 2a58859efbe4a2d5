//! Scenes, cameras, the rasterizer and images.

mod support;

use splat::{
    image, prior_scores, Camera, Code, Convention, DepthFlags, DrawnFlags, FilterFlags, Gaussians,
    Gradients, Image, ImageFormat, ImageView, ImageViewMut, MaskFlags, NormalFlags, OrbitDesc,
    Output, RasterState, RasterizerDesc, RasterizerFlags, Scene, SceneDesc, SceneFileDesc,
    SceneFormat, SceneRenderDesc, Similarity, Tensor,
};
use support::{camera, device, rasterizer, scene, Folder, SIZE};

const PLY: SceneFormat = SceneFormat::PLY;

#[test]
fn scenes_keep_their_numbers_in_files() {
    let folder = Folder::new("scenes");
    let scene = scene(40);
    let bytes = scene.save_memory(&SceneFileDesc { format: PLY, ..Default::default() }).unwrap();
    scene.save(folder.join("a.ply"), &Default::default()).unwrap();
    assert_eq!(std::fs::read(folder.join("a.ply")).unwrap(), bytes);
    assert_eq!(Scene::peek(folder.join("a.ply"), &Default::default()).unwrap(), (40, 0));
    for copy in [
        Scene::load(folder.join("a.ply"), &Default::default()).unwrap(),
        Scene::load_memory(&bytes, &Default::default()).unwrap(),
    ] {
        for name in ["means", "log_scales", "rotations", "opacity_logits", "sh"] {
            assert_eq!(copy.to_vec(name).unwrap(), scene.to_vec(name).unwrap(), "{name}");
        }
        assert!(copy.load_report().unwrap().contains("\"count\""));
    }
    assert!(splat::scene_formats().unwrap().contains("\"id\""));
}

#[test]
fn scenes_change_as_told() {
    let first = scene(20);
    let info = first.get_info().unwrap();
    assert_eq!((info.count, info.sh_degree, info.non_finite), (20, 0, 0));
    let merged = Scene::merge(&[&first, &first]).unwrap();
    assert_eq!(merged.get_info().unwrap().count, 40);
    let doubled =
        Similarity { rotation: [1.0, 0.0, 0.0, 0.0], translation: [0.0, 1.0, 0.0], scale: 2.0 };
    merged.transform(&doubled).unwrap();
    let before = first.to_vec("means").unwrap();
    assert!((merged.to_vec("means").unwrap()[1] - (2.0 * before[1] + 1.0)).abs() < 1e-6);
    merged.crop([-9.0, -9.0, -9.0], [9.0, 1.0, 9.0]).unwrap();
    assert!(merged.get_info().unwrap().count < 40);
    merged.set_sh_degree(1).unwrap();
    let nearest: Vec<f64> =
        merged.to_vec("means").unwrap()[..3].iter().map(|&mean| mean.into()).collect();
    merged.crop_sphere([nearest[0], nearest[1], nearest[2]], 1e-6).unwrap();
    // The places repeat after 17 Gaussians: each copy of 20 has two at the first one.
    assert_eq!(merged.get_size().unwrap(), (4, 1));
    first.write("opacities", &[0.25; 20]).unwrap();
    first.filter(FilterFlags::FINITE | FilterFlags::SORT, 0.5).unwrap();
    assert_eq!(first.get_info().unwrap().count, 0);
    let empty = first.to_tensor("means", device());
    assert_eq!(empty.unwrap_err().code(), Code::InvalidState);
}

#[test]
fn bad_scenes_are_refused() {
    let short = SceneDesc { count: 3, means: Some(&[0.0; 8]), ..Default::default() };
    let error = Scene::create(&short).unwrap_err();
    assert_eq!(error.code(), Code::InvalidArgument);
    let empty = SceneDesc { count: 3, means: Some(&[]), ..Default::default() };
    assert!(Scene::create(&empty).unwrap_err().message().contains("means"));
    let told = SceneDesc { drawn_as: DrawnFlags::ANTIALIASED, ..Default::default() };
    assert_eq!(Scene::create(&told).unwrap().get_info().unwrap().drawn_as, DrawnFlags::ANTIALIASED);
    let degree = SceneDesc { sh_degree: 4, ..Default::default() };
    assert!(Scene::create(&degree).is_err());
    let scene = scene(4);
    let mut few = [7.0; 11];
    assert_eq!(scene.read("means", &mut few).unwrap_err().code(), Code::InvalidArgument);
    assert_eq!(few, [7.0; 11]);
    assert!(scene.read("colour", &mut few).is_err());
    assert!(scene.write("opacities", &[2.0; 4]).is_err());
    assert!(scene.write("me\0ans", &[2.0; 12]).is_err());
    let missing = Scene::load("no/such.ply", &Default::default()).unwrap_err();
    assert_eq!(missing.code(), Code::NotFound);
    assert!(missing.message().contains("no/such.ply"));
    let damaged = Scene::load_memory(b"ply\nformat", &Default::default()).unwrap_err();
    assert_eq!(damaged.code(), Code::Format);
    assert!(Scene::load_memory(&[], &Default::default()).is_err());
    assert_eq!(Scene::merge(&[]).unwrap().get_info().unwrap().count, 0);
}

#[test]
fn cameras_keep_their_poses_in_files() {
    let folder = Folder::new("cameras");
    let desc = OrbitDesc { width: 64, height: 48, ..Default::default() };
    let cameras = Camera::orbit(&scene(30), &desc, 5).unwrap();
    let path = Camera::path(&cameras, true, 10).unwrap();
    assert!(path.len() == 10 && path[3].fx == cameras[0].fx);
    assert!(Camera::path(&cameras[..1], false, 2).is_err());
    let names = ["a", "b", "c", "d", "e"];
    Camera::save(folder.join("transforms.json"), &cameras, &names).unwrap();
    let read = Camera::load(folder.join("transforms.json"), &Default::default()).unwrap();
    assert_eq!(read.len(), 5);
    for (one, other) in cameras.iter().zip(&read) {
        assert_eq!((one.width, one.fx), (other.width, other.fx));
        let difference = |i: usize| one.world_to_camera[i] - other.world_to_camera[i];
        assert!((0..16).all(|i| difference(i).abs() < 1e-12));
    }
    let bytes = Camera::save_memory(&cameras, &names).unwrap();
    let files = splat::CameraBytes { cameras: &bytes, images: None };
    assert_eq!(Camera::load_memory(files, &Default::default()).unwrap(), read);
    let report = Camera::load_memory_report(files, &Default::default()).unwrap();
    assert!(report.contains("\"e\""), "{report}");
    let mut turned = cameras[1];
    turned.from_opengl(&cameras[2].to_opengl().unwrap()).unwrap();
    assert!((turned.world_to_camera[0] - cameras[2].world_to_camera[0]).abs() < 1e-12);
    assert!(Camera::save_memory(&cameras, &names[..3]).is_err());
    assert!(Camera::from_fov(0, 1, 1.0).is_err());
    assert!(turned.look_at([0.0; 3], [0.0; 3], [0.0, 1.0, 0.0]).is_err());
    assert!(Camera::orbit(&scene(30), &desc, 0).unwrap().is_empty());
}

#[test]
fn a_scene_is_drawn() {
    let rasterizer = rasterizer(device(), RasterizerDesc::default());
    rasterizer.forward_scene(None, &scene(200), &[camera()], Some([1.0; 3])).unwrap();
    let rgb = rasterizer.to_vec(None, Output::RGB).unwrap();
    let pixels = SIZE[0] as usize * SIZE[1] as usize;
    assert_eq!(rgb.len(), 3 * pixels);
    assert!(rgb.iter().any(|&value| value < 0.5) && rgb.iter().any(|&value| value > 0.99));
    let mut bytes = vec![0_u8; 4 * pixels];
    let mut view = [ImageViewMut::new(&mut bytes, SIZE, 4).unwrap()];
    rasterizer.read_images(None, Output::RGB, 0, &mut view).unwrap();
    let expected = |i: usize| (255.0 * rgb[i].clamp(0.0, 1.0)).round() as u8;
    assert!((0..pixels).all(|p| (0..3).all(|c| bytes[4 * p + c] == expected(3 * p + c))));
    assert_eq!(rasterizer.get_info(None).unwrap().gaussians, 200);
    let alpha = Tensor::from_slice(device(), &[1, 32, 48], &vec![0.0_f32; pixels]).unwrap();
    rasterizer.output(None, Output::ALPHA, &alpha).unwrap();
    assert_eq!(alpha.to_vec::<f32>().unwrap(), rasterizer.to_vec(None, Output::ALPHA).unwrap());
}

#[test]
fn a_scene_is_drawn_in_one_call() {
    let (scene, mut small) = (scene(30), camera());
    (small.width, small.height, small.cx, small.cy) = (20, 24, 10.0, 12.0);
    let cameras = [camera(), small];
    let desc = SceneRenderDesc { background: [1.0, 0.5, 0.0], ..Default::default() };
    let images = scene.render::<f32>(Some(device()), &cameras, 3, &desc).unwrap();
    let rasterizer = rasterizer(device(), Default::default());
    rasterizer.forward_scene(None, &scene, &cameras[..1], Some(desc.background)).unwrap();
    let expected = rasterizer.to_vec(None, Output::RGB).unwrap();
    assert_eq!(images[0].pixels, expected);
    assert_eq!((images[1].width, images[1].height), (20, 24));
    let own = scene.render::<f32>(None, &cameras[..1], 3, &desc).unwrap();
    assert_eq!(own[0].pixels, expected);
    let wrong = scene.render::<u8>(Some(device()), &cameras, 2, &desc);
    assert_eq!(wrong.unwrap_err().code(), Code::ShapeMismatch);
    rasterizer.forward_scene(None, &scene, &[camera(); 4], None).unwrap(); // made without a number of views
    assert_eq!(rasterizer.get_info(None).unwrap().views, 4);
}

/// A scene's arrays on the device, in the order of `Gaussians`.
fn tensors_of(scene: &Scene) -> [Tensor; 5] {
    ["means", "scales", "rotations", "opacities", "sh"]
        .map(|name| scene.to_tensor(name, device()).unwrap())
}

fn gaussians_of([means, scales, rotations, opacities, sh]: &[Tensor; 5]) -> Gaussians<'_> {
    Gaussians {
        means: Some(means),
        scales: Some(scales),
        rotations: Some(rotations),
        opacities: Some(opacities),
        sh: Some(sh),
        ..Default::default()
    }
}

#[test]
fn gradients_come_back_for_each_state() {
    let scene = scene(50);
    let desc = RasterizerDesc { flags: RasterizerFlags::BACKWARD, ..Default::default() };
    let rasterizer = rasterizer(device(), desc);
    let tensors = tensors_of(&scene);
    let gaussians = gaussians_of(&tensors);
    let second = RasterState::create(&rasterizer).unwrap();
    rasterizer.forward(None, &gaussians, &[camera()], None).unwrap();
    rasterizer.forward(Some(&second), &gaussians, &[camera()], Some([1.0; 3])).unwrap();
    let ones = Tensor::from_slice(device(), &[1, 32, 48, 3], &vec![1.0_f32; 32 * 48 * 3]).unwrap();
    let out = Tensor::from_slice(device(), &[50], &[0.0_f32; 50]).unwrap();
    let gradients =
        Gradients { grad_rgb: Some(&ones), grad_opacities: Some(&out), ..Default::default() };
    let mut sums = Vec::new();
    for state in [None, Some(&second)] {
        rasterizer.backward(state, &gradients).unwrap();
        sums.push(out.to_vec::<f32>().unwrap().iter().sum::<f32>());
    }
    assert!(sums[0] > 0.0 && sums[1] < sums[0], "{sums:?}");
    let error = rasterizer
        .backward(None, &Gradients { grad_rgb: Some(&out), ..Default::default() })
        .unwrap_err();
    assert_eq!(error.code(), Code::ShapeMismatch);
    drop(rasterizer);
    drop(second);
}

#[test]
fn smaller_views_tiles_and_what_gaussians_add() {
    let scene = scene(50);
    let flags =
        RasterizerFlags::GRAD_INTRINSICS | RasterizerFlags::CONTRIBUTIONS | RasterizerFlags::IDS
            | RasterizerFlags::MEDIAN_DEPTH;
    let desc = RasterizerDesc { flags, convention: Convention::GSPLAT, ..Default::default() };
    let rasterizer = rasterizer(device(), desc);
    let tensors = tensors_of(&scene);
    let gaussians = Gaussians { active_tiles: Some(&[1, 1, 0, 1, 1, 1]), ..gaussians_of(&tensors) };
    rasterizer.forward(None, &gaussians, &[camera()], Some([1.0; 3])).unwrap();
    let alpha = rasterizer.to_vec(None, Output::ALPHA).unwrap();
    assert!(alpha.iter().enumerate().all(|(p, a)| p % 48 < 32 || p / 48 >= 16 || *a == 0.0));
    assert!(alpha.iter().any(|a| *a > 0.0));
    let ids = rasterizer.to_vec(None, Output::IDS).unwrap();
    assert!(ids.iter().zip(&alpha).all(|(id, a)| (*id >= 0.0) == (*a > 0.0)));
    let median = rasterizer.to_vec(None, Output::MEDIAN_DEPTH).unwrap();
    assert!(median.iter().zip(&alpha).all(|(z, a)| (*z > 0.0) == (*a > 0.0)));
    let ones = Tensor::from_slice(device(), &[1, 32, 48, 3], &vec![1.0_f32; 32 * 48 * 3]).unwrap();
    let intrinsics = Tensor::from_slice(device(), &[1, 4], &[0.0_f32; 4]).unwrap();
    let contributions = Tensor::from_slice(device(), &[50, 2], &[0.0_f32; 100]).unwrap();
    let gradients = Gradients {
        grad_rgb: Some(&ones),
        grad_intrinsics: Some(&intrinsics),
        contributions: Some(&contributions),
        ..Default::default()
    };
    rasterizer.backward(None, &gradients).unwrap();
    assert!(intrinsics.to_vec::<f32>().unwrap().iter().all(|g| *g != 0.0));
    let sums = contributions.to_vec::<f32>().unwrap();
    let weights: f32 = sums.iter().step_by(2).sum();
    assert!((weights - alpha.iter().sum::<f32>()).abs() < 1e-3 * weights, "{weights}");
    let small = Camera { width: 20, height: 20, ..camera() };
    rasterizer.forward_scene(None, &scene, &[small], Some([1.0; 3])).unwrap();
    assert_eq!(rasterizer.to_vec(None, Output::RGB).unwrap()[3 * 20], 0.0);
}

#[test]
fn views_see_ranges() {
    let scene = scene(50);
    let desc =
        RasterizerDesc { flags: RasterizerFlags::IDS, items: 80, views: 3, ..Default::default() };
    let rasterizer = rasterizer(device(), desc);
    let draw = |gaussians: &Gaussians<'_>| {
        rasterizer.forward(None, gaussians, &[camera(), camera(), camera()], Some([1.0; 3]))
    };
    let of = |view_ranges| Gaussians { scene: Some(&scene), view_ranges, ..Default::default() };
    draw(&of(Some(&[20, 30, 0, 20, 20, 30]))).unwrap();
    assert_eq!(rasterizer.get_info(None).unwrap().items, 80);
    assert_eq!(rasterizer.to_vec(None, Output::MEANS2D).unwrap().len(), 160);
    let ids = rasterizer.to_vec(None, Output::IDS).unwrap();
    let (first, rest) = ids.split_at(32 * 48);
    let (second, third) = rest.split_at(32 * 48);
    assert!(
        first.iter().all(|id| *id == -1.0 || *id >= 20.0) && first.iter().any(|id| *id >= 20.0)
    );
    assert!(second.iter().all(|id| *id < 20.0));
    assert_eq!(first, third);
    let error = draw(&of(Some(&[0, 20, 31, 20, 0, 0]))).unwrap_err().to_string();
    assert!(error.contains("view 1 sees Gaussians 31 to 51, but there are 50"), "{error}");
    assert_eq!(draw(&of(Some(&[0, 20]))).unwrap_err().code(), Code::InvalidArgument);
}

#[test]
fn bad_calls_of_the_rasterizer_are_refused() {
    let one = RasterizerDesc { views: 1, ..Default::default() };
    let rasterizer = rasterizer(device(), one);
    let other = support::rasterizer(device(), RasterizerDesc::default());
    let state = RasterState::create(&other).unwrap();
    let scene = scene(10);
    let draw = |state, cameras: &[Camera]| rasterizer.forward_scene(state, &scene, cameras, None);
    let error = rasterizer.read(None, Output::RGB, &mut vec![0.0; 3 * 48 * 32]).unwrap_err();
    assert_eq!(error.code(), Code::InvalidState, "{error}");
    assert_eq!(draw(Some(&state), &[camera()]).unwrap_err().code(), Code::InvalidArgument);
    assert!(draw(None, &[camera(), camera()]).is_err());
    assert!(draw(None, &[Camera::from_fov(20, 40, 1.0).unwrap()]).is_err());
    assert!(draw(None, &[Camera::default()]).is_err());
    draw(None, &[camera()]).unwrap();
    let mut few = [3.0; 5];
    assert!(rasterizer.read(None, Output::RGB, &mut few).is_err());
    assert!(rasterizer.to_vec(None, Output(99)).is_err());
    assert!(rasterizer.to_vec(None, Output::DEPTH).is_err());
    assert!(rasterizer.backward(None, &Gradients::default()).is_err());
    let mut short = vec![0_u8; 12];
    let mut view = [ImageViewMut::new(&mut short, SIZE, 3).unwrap()];
    let error = rasterizer.read_images(None, Output::RGB, 0, &mut view).unwrap_err();
    assert_eq!(error.code(), Code::InvalidArgument);
    assert!(rasterizer.forward_scene(None, &scene, &[camera()], Some([f32::NAN; 3])).is_err());
    let desc = RasterizerDesc { sh_degree: 9, ..Default::default() };
    assert!(splat::Rasterizer::create(device(), &desc).is_err());
    assert_eq!(few, [3.0; 5]);
}

#[test]
fn images_keep_their_pixels_in_files() {
    let folder = Folder::new("images");
    let mut picture = Image::<u8>::new([5, 4], 3).unwrap();
    picture.pixels.iter_mut().enumerate().for_each(|(i, pixel)| *pixel = (i * 4) as u8);
    image::save(folder.join("a.png"), picture.view().unwrap()).unwrap();
    let (read, info) = Image::<u8>::load(folder.join("a.png"), 0).unwrap();
    assert_eq!((&read, info.bits), (&picture, 8));
    let bytes = image::save_memory(picture.view().unwrap(), ImageFormat::PNG).unwrap();
    assert_eq!(Image::<u8>::load_memory(&bytes, 3).unwrap().0, picture);
    let (alpha, _) = Image::<f32>::load_memory(&bytes, 4).unwrap();
    assert_eq!((alpha.pixels[3], alpha.pixels[5]), (1.0, 16.0 / 255.0));
    let planes: Vec<u8> =
        (0..3).flat_map(|c| picture.pixels.iter().skip(c).step_by(3)).copied().collect();
    let view = ImageView::new(&planes, [5, 4], 3).unwrap().strides(5, 1, 20);
    assert_eq!(image::save_memory(view, ImageFormat::PNG).unwrap(), bytes);
    let frames = [picture.view().unwrap(), picture.view().unwrap()];
    image::save_animation(folder.join("a.gif"), &frames, 40).unwrap();
    let gif = image::save_animation_memory(&frames, 40, ImageFormat::GIF).unwrap();
    assert_eq!(std::fs::read(folder.join("a.gif")).unwrap(), gif);
}

#[test]
fn bad_images_are_refused() {
    let pixels = [0_u8; 11];
    assert!(ImageView::new::<u8>(&[], [1, 1], 1).is_err());
    let short = ImageView::new(&pixels, [2, 2], 3).unwrap();
    assert_eq!(
        image::save_memory(short, ImageFormat::PNG).unwrap_err().code(),
        Code::InvalidArgument
    );
    let beyond = ImageView::new(&pixels, [2, 2], 1).unwrap().strides(u64::MAX, 1, 1);
    assert!(image::save_memory(beyond, ImageFormat::PNG).is_err());
    let fine = ImageView::new(&pixels, [2, 2], 1).unwrap();
    assert_eq!(image::save("no/such/a.png", fine).unwrap_err().code(), Code::NotFound);
    assert_eq!(image::save("a.bmp", fine).unwrap_err().code(), Code::Unsupported);
    assert!(image::save_animation("a.gif", &[], 10).is_err());
    assert_eq!(Image::<u8>::load("no.png", 0).unwrap_err().code(), Code::NotFound);
    assert_eq!(Image::<u8>::load_memory(b"GIF89a", 0).unwrap_err().code(), Code::Format);
    let half = [0.5_f32; 12];
    let gray = ImageView::new(&half, [2, 2], 3).unwrap();
    let same = image::compare(gray, gray).unwrap();
    assert_eq!((same.psnr, same.squared_error), (f64::INFINITY, 0.0));
    let refused = |other: ImageView| image::compare(gray, other).unwrap_err().code();
    let smaller = ImageView::new(&half, [2, 1], 3).unwrap();
    assert_eq!(refused(smaller), Code::ShapeMismatch);
    let short = ImageView::new(&half[1..], [2, 2], 3).unwrap();
    assert_eq!(refused(short), Code::InvalidArgument);
    let broken = [f32::NAN; 12];
    let broken = ImageView::new(&broken, [2, 2], 3).unwrap();
    assert_eq!(refused(broken), Code::InvalidArgument);
}

#[test]
fn priors_are_judged() {
    let map = |samples: &'static [f32], channels| {
        let width = samples.len() as u32 / channels;
        ImageView::new(samples, [width, 1], channels).unwrap()
    };
    let truth = map(&[1.0, 2.0, 3.0, 0.0], 1);
    let prediction = map(&[2.0, 4.0, 6.0, 9.0], 1);
    let depth = |mask, flags| prior_scores::compare_depth(prediction, truth, mask, flags).unwrap();
    assert_eq!(depth(None, Default::default()).pixels, 3);
    assert!((depth(None, Default::default()).scale - 0.5).abs() < 1e-12);
    assert_eq!(depth(None, DepthFlags::AS_PUBLISHED).pixels, 4);
    let mask = Some(map(&[1.0, 1.0, 0.0, 0.0], 1));
    assert_eq!(depth(mask, Default::default()).pixels, 2);
    let (x, z) = (map(&[1.0, 0.0, 0.0], 3), map(&[0.0, 0.0, 1.0], 3));
    let normals = prior_scores::compare_normals(x, z, None, NormalFlags::VECTORS).unwrap();
    assert!((normals.median - 90.0).abs() < 1e-9);
    let plane = map(&[0.0, 0.0, -1.0, 2.0], 4);
    let planes = prior_scores::compare_planes(plane, plane, NormalFlags::VECTORS, 0.05, 10.0);
    assert_eq!(planes.unwrap().recall, 1.0);
    let masks = prior_scores::compare_masks(x, x, MaskFlags::ALPHA_HALF);
    assert_eq!(masks.unwrap_err().code(), Code::ShapeMismatch);
    let folder = Folder::new("mesh");
    let path = folder.join("square.obj");
    std::fs::write(&path, "v 0 0 2\nv 1 0 2\nv 1 1 2\nv 0 1 2\nf 1 2 3 4\n").unwrap();
    let points = prior_scores::mesh_points(&path, 50, 7).unwrap();
    assert_eq!((points.len(), points[2]), (150, 2.0));
    let mut camera = camera();
    camera.width = 4;
    camera.height = 1;
    assert_eq!(prior_scores::depth_points(truth, &camera).unwrap().len(), 9);
    let scores = scene(20).compare_points(&points, 1e9, 0.0).unwrap();
    assert_eq!((scores.gaussians, scores.f_score), (20, 1.0));
}
