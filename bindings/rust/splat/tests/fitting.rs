//! Fits of photographs.

mod support;

use splat::{
    Camera, Code, Fit, FitCameras, FitDesc, FitFlags, OrbitDesc, RunEvent, RunEventKind, Scoring,
};
use std::path::PathBuf;
use support::{device, scene, Folder};

/// Eight small photographs of a scene.
fn photos(folder: &Folder) -> PathBuf {
    let (path, scene) = (folder.join("photos"), scene(50));
    std::fs::create_dir(&path).unwrap();
    let desc = OrbitDesc { width: 40, height: 30, ..Default::default() };
    let cameras = Camera::orbit(&scene, &desc, 8).unwrap();
    let names: Vec<_> = (0..8).map(|index| format!("{index}.png")).collect();
    let images = scene.render::<u8>(Some(device()), &cameras, 3, &Default::default()).unwrap();
    for (image, name) in images.iter().zip(&names) {
        splat::image::save(path.join(name), image.view().unwrap()).unwrap();
    }
    let names: Vec<_> = names.iter().map(String::as_str).collect();
    Camera::save(path.join("transforms.json"), &cameras, &names).unwrap();
    path
}

#[test]
fn a_fit_lowers_its_loss_and_resumes() {
    let folder = Folder::new("fit");
    let (data, run) = (photos(&folder), folder.join("run"));
    let desc = FitDesc {
        folder: Some(&run),
        data: Some(&data),
        steps: 60,
        max_gaussians: 500,
        sh_bands: 2,
        ..Default::default()
    };
    let mut fit = Fit::open(device(), &desc).unwrap();
    let mut events = Vec::new();
    while events.last().map_or(true, |event: &RunEvent| event.step < 25) {
        events.push(fit.next().unwrap().unwrap());
    }
    let resume = FitDesc { folder: Some(&run), flags: FitFlags::RESUME, ..Default::default() };
    assert_eq!(Fit::open(device(), &resume).unwrap_err().code(), Code::InvalidState);
    fit.interrupt().unwrap();
    assert_eq!(fit.by_ref().last().unwrap().unwrap().kind, RunEventKind::INTERRUPTED);
    let before = fit.scene().unwrap().to_vec("means").unwrap();
    drop(fit);

    let mut fit = Fit::open(device(), &resume).unwrap();
    assert_eq!(fit.scene().unwrap().to_vec("means").unwrap(), before);
    events.extend(fit.by_ref().map(Result::unwrap));
    assert_eq!(events.last().unwrap().kind, RunEventKind::DONE);
    let of = |kind, name: &str| -> Vec<f64> {
        events.iter().filter(|event| event.kind == kind).map(|event| event.numbers[name]).collect()
    };
    let (losses, scores) = (of(RunEventKind::STEP, "l1"), of(RunEventKind::VALIDATION, "val_psnr"));
    let sum = |part: &[f64]| part.iter().sum::<f64>();
    assert!(losses.len() == 60 && sum(&losses[53..]) < 0.9 * sum(&losses[..7]), "{losses:?}");
    assert!(scores.last().unwrap() > &(scores[0] + 1.0), "{scores:?}");
    let made = fit.scene().unwrap();
    let photos = FitDesc { data: Some(&data), ..Default::default() };
    let scored: Vec<_> =
        Scoring::open(device(), &photos, &made, 0.1).unwrap().map(Result::unwrap).collect();
    let means = scored.iter().find(|event| event.kind == RunEventKind::VALIDATION).unwrap();
    assert!((means.numbers["val_psnr"] - scores.last().unwrap()).abs() < 1e-3, "{means:?}");
    assert!(means.numbers.contains_key("inner_ssim"));
    let error = Scoring::open(device(), &photos, &made, 0.5).unwrap_err();
    assert!(error.message().contains("border is 0.5"), "{error}");
    let info = made.get_info().unwrap();
    assert!(info.count > 0 && info.count <= 500 && info.sh_degree == 1, "{info:?}");
}

#[test]
fn bad_fits_are_refused() {
    let folder = Folder::new("bad_fits");
    let (data, run) = (photos(&folder), folder.join("run"));
    let good = FitDesc { folder: Some(&run), data: Some(&data), ..Default::default() };
    let refused = |desc: FitDesc<'_>, code: Code, words: &str| {
        let error = Fit::open(device(), &desc).unwrap_err();
        assert!(error.code() == code && error.message().contains(words), "{error}");
    };
    refused(FitDesc { data: None, ..good }, Code::InvalidArgument, "data");
    refused(FitDesc { steps: 1, seconds: 2.0, ..good }, Code::InvalidArgument, "seconds is 2");
    refused(FitDesc { sh_bands: 5, ..good }, Code::InvalidArgument, "sh_bands is 5");
    refused(FitDesc { cameras: FitCameras(7), ..good }, Code::InvalidArgument, "a FitCameras");
    let all = FitDesc { flags: FitFlags::ALL_PHOTOS, test_every: 4, ..good };
    refused(all, Code::InvalidArgument, "with FitFlags::ALL_PHOTOS");
    refused(FitDesc { cameras: FitCameras::COLMAP, ..good }, Code::NotFound, "colmap");
    refused(FitDesc { masks: Some("none".as_ref()), ..good }, Code::NotFound, "none");
    refused(FitDesc { data: Some("a\0".as_ref()), ..good }, Code::InvalidArgument, "data");
    assert!(!run.exists());
}
