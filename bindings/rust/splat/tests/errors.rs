//! Errors, flags and values as programs of Rust meet them.

mod support;

use splat::prelude::*;
use std::collections::HashSet;
use std::error::Error as _;
use std::path::{Path, PathBuf};
use support::device;

/// Crates of these names, which the prelude must not hide.
mod crates {
    pub mod image {
        pub const OWN: i32 = 1;
    }
    pub mod log {
        pub const OWN: i32 = 2;
    }
}
use crates::*;

/// `Result` of the prelude takes another error.
fn parsed(text: &str) -> Result<i32, std::num::ParseIntError> {
    text.parse()
}

#[test]
fn the_prelude_hides_nothing() {
    assert_eq!((parsed("7"), image::OWN, log::OWN), (Ok(7), 1, 2));
    let ours: Result<Scene> = Scene::load("none.ply", &Default::default());
    assert_eq!(ours.unwrap_err().code(), Code::NotFound);
}

#[test]
fn errors_are_in_words() {
    let error = Scene::load("none.ply", &Default::default()).unwrap_err();
    assert!(error.to_string().starts_with("not found: "), "{error}");
    assert!(error.source().is_none());
    assert_eq!(Code::OutOfDeviceMemory.to_string(), "out of device memory");
    assert_eq!((Code::Io.name(), Code::NotFound.name()), ("Io", "NotFound"));
    assert_eq!(Code::Io.c_name(), "SPLAT_ERROR_IO");
    assert!(!Code::Timeout.sentence().contains("SPLAT_ERROR"));
    let nul =
        Device::create(&DeviceDesc { cache_folder: Some("a\0b".into()), ..Default::default() });
    let nul = nul.unwrap_err();
    let source = nul.source().unwrap().downcast_ref::<std::ffi::NulError>();
    assert_eq!(source.unwrap().nul_position(), 1);
}

#[test]
fn codes_are_equal_to_their_numbers() {
    for code in [Code::NotFound, Code::Cancelled, Code::Incomplete] {
        assert_eq!(Code::from_raw(code.to_raw()), code);
        assert!(!matches!(Code::from_raw(code.to_raw()), Code::Other(_)));
    }
    let other = Code::from_raw(-999);
    assert!(matches!(other, Code::Other(_)), "{other:?}");
    assert_eq!((other.to_raw(), other.name()), (-999, "Other"));
    assert_eq!(other.to_string(), "unknown code -999");
}

#[track_caller]
fn says<T>(result: Result<T>, part: &str) {
    let text = result.err().expect("not refused").to_string();
    assert!(text.contains(part), "{text}");
    assert!(!text.contains("SPLAT_") && !text.contains("splat_"), "{text}");
}

#[test]
fn sentences_name_what_programs_call() {
    let tensor = Tensor::from_slice(device(), &[2], &[1.0_f32, 2.0]).unwrap();
    let mapping = tensor.map::<f32>().unwrap();
    says(tensor.to_vec::<f32>(), "Mapping::unmap");
    drop(mapping);
    let ints = Tensor::from_slice(device(), &[2], &[1, 2]).unwrap();
    says(ints.check(), "Dtype::F32");
    let rasterizer = support::rasterizer(device(), Default::default());
    let scene = support::scene(3);
    rasterizer.forward_scene(None, &scene, &[support::camera()], None).unwrap();
    says(rasterizer.to_vec(None, Output::DEPTH), "RasterizerFlags::DEPTH");
    let (name, dims) = ("a", &[3_i64][..]);
    let array = NamedArray { name, values: &[1.0], dims };
    says(Weights::from_arrays(&[array]), "arrays[0].values.len()");
    says(scene.read("means", &mut [0.0]), "the slice's size in bytes is 4");
    says(device().profile_json(), "DeviceFlags::PROFILE");
}

#[test]
fn paths_are_paths_everywhere() {
    let none = PathBuf::from("no/such");
    let path: Option<&Path> = Some(&none);
    let desc = DatasetDesc { path, ..Default::default() };
    assert_eq!(Dataset::open(&desc).unwrap_err().code(), Code::NotFound);
    let picture = [Picture::file("no.png"), Picture::file(&none)];
    assert_ne!(picture[0], picture[1]);
    let weights: PathBuf = splat::builtin_weights(Some("cars64")).unwrap();
    assert!(weights.is_file());
    let set = ScoreSet::Path(&none);
    assert!(Comparison::of_scores(set, set, &Default::default()).is_err());
}

#[test]
fn flags_have_operators() {
    let mut flags = FilterFlags::FINITE;
    flags |= FilterFlags::SORT;
    assert_eq!(flags, FilterFlags::all());
    assert_eq!(format!("{flags:?}"), "FilterFlags(FINITE | SORT)");
    flags &= !FilterFlags::FINITE;
    assert_eq!(flags, FilterFlags::SORT);
    assert!(!flags.contains(FilterFlags::FINITE));
    assert!((flags & FilterFlags::FINITE).is_empty());
    assert_eq!(!FilterFlags::all(), FilterFlags::empty());
    assert_eq!(format!("{:?}", FilterFlags::empty()), "FilterFlags(empty)");
    let unknown = FilterFlags(1 << 30) | FilterFlags::SORT;
    assert_eq!(format!("{unknown:?}"), "FilterFlags(SORT | 0x40000000)");
    flags.set(FilterFlags::FINITE, true);
    assert_eq!(flags ^ FilterFlags::SORT, FilterFlags::FINITE);
    flags.remove(FilterFlags::SORT);
    assert_eq!(flags.bits(), FilterFlags::FINITE.0);
}

#[test]
fn names_are_texts_and_back() {
    for flags in [FilterFlags::empty(), FilterFlags::all(), FilterFlags(1 << 30)] {
        assert_eq!(flags.to_string().parse(), Ok(flags));
    }
    for output in [Output::RGB, Output(77), Output(-1), Output(0)] {
        assert_eq!(output.to_string().parse(), Ok(output));
    }
    assert_eq!("SORT|FINITE".parse(), Ok(FilterFlags::all()));
    for wrong in ["sort", "-1", "0x100000000", "SORT | RGB"] {
        let error = wrong.parse::<FilterFlags>().unwrap_err().to_string();
        assert!(error.contains("expected one of FINITE, SORT"), "{error}");
    }
    assert!("RGB | ALPHA".parse::<Output>().is_err() && "0x1".parse::<Output>().is_err());
}

#[test]
fn values_are_compared_and_shown() {
    assert_eq!(format!("{:?}", Convention::default()), "Convention::default()");
    assert_eq!(format!("{:?}", Output::RGB), "Output::RGB");
    assert_eq!(format!("{:?}", Output(77)), "Output(77)");
    assert_eq!(ModelInput::default(), ModelInput::default());
    assert_eq!(TrainingDesc::default(), TrainingDesc::default());
    assert_eq!(NamedArray::default().dims, &[] as &[i64]);
    let pixels = [1_u8, 2, 3, 4];
    let view = |channels| ImageView::new(&pixels, [2, 1], channels).unwrap();
    assert_eq!(Picture::pixels(view(2)), Picture::pixels(view(2)));
    assert_ne!(view(2), view(1));
    let text = format!("{:?}", view(2));
    assert!(text.contains("pixel: Pixel::U8, size: [2, 1], channels: 2"), "{text}");
    assert_ne!(support::scene(1), support::scene(1));
    let cancellers = [device().canceller(), device().canceller()];
    assert_eq!(HashSet::from(cancellers).len(), 1);
}
