//! Predictors, evaluators and comparisons.

mod support;

use splat::{
    Code, CompareDesc, Comparison, Dataset, DatasetDesc, EvaluatedViews, Evaluator, EvaluatorDesc,
    Found, Image, ImageView, ImageViewMut, Lpips, Picture, PictureCut, PictureFlags, PictureSource,
    Predictor, PredictorDesc, Score, ScoreSet, SyntheticDesc, Weights, WeightsFlags,
};
use std::path::PathBuf;
use support::{device, Folder};

fn disc() -> Image<u8> {
    let mut picture = Image::<u8>::new([80, 64], 4).unwrap();
    for (i, pixel) in picture.pixels.chunks_mut(4).enumerate() {
        let (x, y) = ((i % 80) as i32, (i / 80) as i32);
        let inside = (2 * x - 79).pow(2) + (2 * y - 63).pow(2) < 2304;
        pixel.copy_from_slice(&[(5 * x) as u8, (7 * y) as u8, 90, if inside { 255 } else { 0 }]);
    }
    picture
}

#[test]
fn a_picture_becomes_a_scene() {
    let folder = Folder::new("predict");
    let predictor = Predictor::create(device(), &Default::default()).unwrap();
    let info = predictor.get_info().unwrap();
    assert_eq!((info.views, info.resolution, info.depth), (1, 64, false));
    let picture = disc();
    let pictures = [Picture::pixels(picture.view().unwrap())];
    let (scene, facts) = predictor.predict_with_facts(&pictures, true).unwrap();
    assert_eq!(facts.pictures[0].found, Found::BY_ALPHA);
    assert_eq!((facts.cameras.len(), facts.inputs.len()), (1, 3 * 64 * 64));
    assert_eq!(facts.gaussians, scene.get_info().unwrap().count);
    assert!(facts.report().unwrap().contains("\"alpha\""));
    assert!(predictor.report().unwrap().contains("config"));
    let path = folder.join("photo.png");
    splat::image::save(&path, picture.view().unwrap()).unwrap();
    let from_file = predictor.predict(&[Picture::file(&path)]).unwrap();
    assert_eq!(from_file.to_vec("means").unwrap(), scene.to_vec("means").unwrap());
}

#[test]
fn bad_pictures_are_refused() {
    let predictor = Predictor::create(device(), &Default::default()).unwrap();
    let predict = |pictures: &[Picture<'_>]| predictor.predict(pictures).unwrap_err();
    assert_eq!(predict(&[]).code(), Code::InvalidArgument);
    assert_eq!(predict(&[Picture::default()]).code(), Code::InvalidArgument);
    let missing = predict(&[Picture::file("no.png")]);
    assert_eq!(missing.code(), Code::NotFound);
    let short = ImageView::new(&[0_u8; 10], [4, 4], 3).unwrap();
    assert_eq!(predict(&[Picture::pixels(short)]).code(), Code::InvalidArgument);
    let picture = disc();
    let image = PictureSource::Pixels(picture.view().unwrap());
    let map = Picture { image, depth: image, ..Default::default() };
    assert!(!predict(&[map]).message().is_empty());
    let missing =
        PredictorDesc { weights_path: Some("no.safetensors".as_ref()), ..Default::default() };
    assert_eq!(Predictor::create(device(), &missing).unwrap_err().code(), Code::NotFound);
    assert!(splat::builtin_weights(Some("other")).unwrap_err().message().contains("cars64"));
    assert!(splat::builtin_weights(None).unwrap().to_str().unwrap().contains("cars64"));
}

#[test]
fn a_picture_is_cut_out() {
    let picture = disc();
    let source = Picture::pixels(picture.view().unwrap());
    let (mut image, mut mask) = (vec![0.0_f32; 3 * 32 * 32], vec![0_u8; 32 * 32]);
    let mut out = PictureCut {
        resolution: 32,
        image: Some(ImageViewMut::new(&mut image, [32, 32], 3).unwrap()),
        mask: Some(ImageViewMut::new(&mut mask, [32, 32], 1).unwrap()),
        ..Default::default()
    };
    let info = splat::picture_cut(&source, &mut out).unwrap();
    assert_eq!((info.width, info.height, info.found), (80, 64, Found::BY_ALPHA));
    assert!(mask.contains(&255) && mask.contains(&0));
    let whole = Picture { flags: PictureFlags::WHOLE, ..source };
    let mut short = vec![0_u8; 5];
    let mut out = PictureCut {
        resolution: 32,
        mask: Some(ImageViewMut::new(&mut short, [32, 32], 1).unwrap()),
        ..Default::default()
    };
    assert!(splat::picture_cut(&whole, &mut out).is_err());
    assert_eq!(short, [0; 5]);
}

/// A data set of two test objects with four views.
fn data(folder: &Folder) -> PathBuf {
    let path = folder.join("data");
    let desc = SyntheticDesc {
        path: Some(&path),
        resolution: 64,
        test_views: 4,
        test_objects: 2,
        ..Default::default()
    };
    (0..2).for_each(|index| splat::synthetic_write(&desc, index).unwrap());
    path
}

#[test]
fn a_predictor_is_scored() {
    let folder = Folder::new("evaluate");
    let path = data(&folder);
    let predictor = Predictor::create(device(), &Default::default()).unwrap();
    let desc =
        EvaluatorDesc { predictor: Some(&predictor), data_path: Some(&path), ..Default::default() };
    let evaluator = Evaluator::create(&desc).unwrap();
    assert_eq!(evaluator.get_info().unwrap().objects, 2);
    let scores = evaluator.score(0).unwrap();
    assert!(scores.novel.psnr > 5.0 && !scores.name.is_empty(), "{scores:?}");
    let (inputs, novel) = evaluator.read(0, &mut EvaluatedViews::default()).unwrap();
    let views = (inputs + novel) as usize;
    let (mut numbers, mut drawn) = (vec![0; views], vec![0.0; views * 3 * 64 * 64]);
    let mut all = EvaluatedViews {
        numbers: Some(&mut numbers),
        drawn: Some(&mut drawn),
        ..Default::default()
    };
    evaluator.read(0, &mut all).unwrap();
    let mut short = EvaluatedViews { numbers: Some(&mut numbers[1..]), ..Default::default() };
    assert_eq!(evaluator.read(0, &mut short).unwrap_err().code(), Code::InvalidArgument);
    assert_eq!(evaluator.score(2).unwrap_err().code(), Code::InvalidArgument);
    assert_eq!(evaluator.score_images(0, &drawn[1..]).unwrap_err().code(), Code::ShapeMismatch);
    let again = evaluator.score_images(0, &drawn).unwrap();
    assert!((again.novel.psnr - scores.novel.psnr).abs() < 1e-6);
    evaluator.score(1).unwrap();
    assert_eq!(evaluator.summary().unwrap().objects, 2);
    evaluator.save(folder.join("eval")).unwrap();
    assert!(evaluator.report().unwrap().contains("\"schema\": 1"));
    evaluator.load(folder.join("eval")).unwrap();
    assert_eq!(evaluator.summary().unwrap().objects, 2);
    let missing = evaluator.load(folder.join("nowhere")).unwrap_err();
    assert_eq!(missing.code(), Code::NotFound);
    let set = folder.join("eval");
    let same = Comparison::of_scores(
        ScoreSet::Path(&set),
        ScoreSet::Path(&set),
        &CompareDesc { resamples: 100, bootstraps: 100, ..Default::default() },
    );
    assert_eq!(same.unwrap().metric(0).unwrap().difference, 0.0);
    assert!(Evaluator::create(&EvaluatorDesc::default()).is_err());
}

#[test]
fn an_object_of_a_data_set_becomes_a_scene() {
    let folder = Folder::new("predict_object");
    let path = data(&folder);
    let predictor = Predictor::create(device(), &Default::default()).unwrap();
    let desc = DatasetDesc {
        path: Some(&path),
        split: Some("test"),
        resolution: 64,
        background: predictor.get_info().unwrap().background,
        ..Default::default()
    };
    let dataset = Dataset::open(&desc).unwrap();
    let predict = |object| predictor.predict_object(&dataset, object, &[0, 2], true);
    let (scene, facts) = predict(0).unwrap();
    assert_eq!((facts.cameras.len(), facts.pictures.len()), (2, 0));
    assert_eq!(facts.inputs.len(), 3 * 64 * 64);
    assert!(scene.get_info().unwrap().count > 0);
    assert_eq!(predict(2).unwrap_err().code(), Code::InvalidArgument);
}

#[test]
fn methods_are_compared() {
    let scores = |shift: f64| -> Vec<Score> {
        (0..12)
            .map(|i| Score {
                object: format!("object {i}"),
                psnr: 20.0 + f64::from(i) + shift,
                ssim: f64::NAN,
                lpips: f64::NAN,
            })
            .collect()
    };
    let (a, b) = (scores(0.0), scores(1.0));
    let compare =
        |a, b| Comparison::of_scores(ScoreSet::Scores(a), ScoreSet::Scores(b), &Default::default());
    let comparison = compare(&a, &b).unwrap();
    let info = comparison.get_info().unwrap();
    assert_eq!((info.metrics, info.shared_objects, info.comparable), (1, 12, true));
    let metric = comparison.metric(0).unwrap();
    assert_eq!(metric.verdict, splat::Verdict::BETTER);
    assert!((metric.difference - 1.0).abs() < 1e-12);
    let (samples_a, samples_b) = comparison.samples(0).unwrap();
    assert_eq!((samples_a.len(), samples_b[3] - samples_a[3]), (12, 1.0));
    assert!(comparison.report().unwrap().contains("p_holm"));
    assert!(comparison.metric(1).is_err());
    assert_eq!(compare(&a, &[]).unwrap_err().code(), Code::InvalidArgument);
    let twice = [a[0].clone(), a[0].clone()];
    assert!(compare(&twice, &b).is_err());
    let missing = Comparison::of_scores(
        ScoreSet::Path("no.csv".as_ref()),
        ScoreSet::Scores(&b),
        &Default::default(),
    );
    assert_eq!(missing.unwrap_err().code(), Code::NotFound);
}

#[test]
fn lpips_needs_its_weights() {
    let weights = Weights::load("cars64", WeightsFlags::default()).unwrap();
    let error = Lpips::create(device(), &[&weights], 64).unwrap_err();
    assert_eq!(error.code(), Code::InvalidArgument, "{error}");
    assert!(Lpips::create(device(), &[], 64).is_err());
}

#[test]
fn models_of_priors_say_what_is_missing() {
    assert!(splat::prior_preset(None).unwrap().contains("\"u2net\""));
    let preset = splat::prior_preset(Some("u2net")).unwrap();
    assert!(preset.contains("\"sha256\""), "{preset}");
    assert_eq!(splat::prior_preset(Some("u3net")).unwrap_err().code(), Code::NotFound);
    let desc = splat::PriorModelDesc {
        preset: Some("u2net"),
        model: Some(std::path::Path::new("/nowhere/u2net.onnx")),
        runtime: Some(std::path::Path::new("/nowhere/runtime.so")),
        ..Default::default()
    };
    let error = splat::PriorModel::create(&desc).unwrap_err();
    assert_eq!(error.code(), Code::NotFound, "{error}");
    let none = splat::PriorModel::create(&Default::default()).unwrap_err();
    assert_eq!(none.code(), Code::InvalidArgument, "{none}");
}
