//! Values of other crates, with the features of their names.
#![cfg(all(
    feature = "bitflags",
    feature = "bytemuck",
    feature = "glam",
    feature = "image",
    feature = "ndarray",
    feature = "serde"
))]

mod support;

use bitflags::Flags;
use glam::{DAffine3, DVec3};
use image::{DynamicImage, ImageBuffer, LumaA, Rgb, Rgb32FImage, RgbImage, RgbaImage};
use ndarray::{arr2, s, Array3, Axis};
use serde_json::{from_str, to_string};
use splat::prelude::*;

#[test]
fn matrices_of_glam_are_poses() {
    let mut camera = support::camera();
    let (eye, zero) = (DVec3::new(1.0, -2.0, -3.0), DVec3::ZERO);
    camera.look_at(eye, zero, -DVec3::Y).unwrap();
    assert!(camera.position().distance(eye) < 1e-12);
    let view = camera.world_to_camera_mat4();
    let middle = view.transform_point3(zero);
    assert!(middle.distance(DVec3::Z * eye.length()) < 1e-12);
    let mut same = support::camera();
    same.set_world_to_camera_mat4(view);
    assert_eq!(same, camera);
    let (scale, rotation) = (2.0, [2.0, 0.0, 0.0, 2.0]);
    let translation = [0.0, 5.0, 0.0];
    let moves = DAffine3::from(Similarity { scale, rotation, translation });
    let moved = moves.transform_point3(DVec3::X); // a quarter turn around z
    assert!(moved.distance(DVec3::new(0.0, 7.0, 0.0)) < 1e-12);
    support::scene(4).crop(-DVec3::ONE, DVec3::ONE).unwrap();
}

#[test]
fn pictures_of_the_crate_image_are_images() {
    let rgb = RgbImage::from_fn(5, 3, |x, y| Rgb([x as u8, y as u8, 7]));
    let view = ImageView::new(&rgb, [5, 3], 3).unwrap();
    assert_eq!(ImageView::try_from(&rgb).unwrap(), view);
    let own = Image::from(rgb.clone());
    assert_eq!([own.width, own.height, own.channels], [5, 3, 3]);
    assert_eq!(RgbImage::try_from(own.clone()).unwrap(), rgb);
    let mut short = own.clone();
    short.height = 4;
    for error in [RgbaImage::try_from(own.clone()).err(), RgbImage::try_from(short).err()] {
        assert_eq!(error.unwrap().code(), Code::ShapeMismatch);
    }
    assert_eq!(Image::<u8>::from(DynamicImage::from(rgb)), own);
    let gray = ImageBuffer::from_pixel(2, 2, LumaA([7_u16 << 8, 0]));
    assert_eq!(Image::from(DynamicImage::from(gray)).pixels[..2], [7, 0]);
    let long: RgbImage = ImageBuffer::from_raw(1, 1, vec![1, 2, 3, 4]).unwrap();
    assert_eq!(Image::from(long).pixels, [1, 2, 3]);
    let floats = Rgb32FImage::from_pixel(2, 1, Rgb([0.5; 3]));
    let same = Rgb32FImage::try_from(Image::from(floats.clone()));
    assert_eq!(same.unwrap(), floats);
    assert!(ImageView::try_from(&RgbImage::new(0, 0)).is_err());
}

#[test]
fn arrays_of_ndarray_are_images_and_tensors() {
    let planes =
        Array3::from_shape_fn((3, 2, 4), |(c, y, x)| (100 * c + 10 * y + x) as f32 / 255.0);
    let array = planes.view().permuted_axes([1, 2, 0]);
    let own = Image::try_from(array).unwrap();
    assert_eq!((own.height, own.width, own.channels), (2, 4, 3));
    assert_eq!(own.pixels[own.pixels.len() - 3..], [13.0, 113.0, 213.0].map(|v| v / 255.0));
    let packed = own.view().unwrap();
    let saved = |view| splat::image::save_memory(view, ImageFormat::PNG).unwrap();
    assert_eq!(saved(ImageView::try_from(array).unwrap()), saved(packed));
    assert_eq!(Array3::try_from(own.clone()).unwrap(), array);
    let short = Image { height: 3, ..own };
    assert_eq!(Array3::try_from(short).unwrap_err().code(), Code::ShapeMismatch);
    for part in [array.slice(s![.., ..;-1, ..]), array.slice(s![.., 1.., ..])] {
        assert_eq!(ImageView::try_from(part).unwrap_err().code(), Code::InvalidArgument);
    }
    let matrix = arr2(&[[1, 2, 3], [4, 5, 6]]);
    let turned = Tensor::from_array(support::device(), &matrix.t()).unwrap();
    assert_eq!(
        (turned.dims(), turned.to_vec::<i32>().unwrap()),
        (&[3, 2][..], vec![1, 4, 2, 5, 3, 6])
    );
    assert_eq!(turned.to_array::<i32>().unwrap(), matrix.t().into_dyn());
    let empty = matrix.slice_axis(Axis(0), (0..0).into());
    assert_eq!(
        Tensor::from_array(support::device(), &empty).unwrap_err().code(),
        Code::InvalidArgument
    );
}

#[test]
fn slices_are_cast_by_bytemuck() {
    let camera = support::camera();
    let bytes = bytemuck::bytes_of(&camera);
    assert_eq!(bytemuck::pod_read_unaligned::<Camera>(bytes), camera);
    let tensor = Tensor::from_slice(support::device(), &[2, 2], &[1.0_f32; 4]).unwrap();
    let mapping = tensor.map::<f32>().unwrap();
    let rows: &[[f32; 2]] = bytemuck::cast_slice(&mapping);
    assert_eq!(rows, [[1.0; 2]; 2]);
}

#[test]
fn flags_are_those_of_bitflags() {
    let names: Vec<&str> = FilterFlags::all().iter_names().map(|(name, _)| name).collect();
    assert_eq!(names, ["FINITE", "SORT"]);
    assert_eq!(FilterFlags::from_bits(1 << 30), None);
}

#[test]
fn descriptions_are_read_and_written() {
    let json = r#"{"width": 8, "flags": "DEPTH | NORMALS", "convention": "GSPLAT"}"#;
    let desc: RasterizerDesc = from_str(json).unwrap();
    assert_eq!(desc.flags, RasterizerFlags::DEPTH | RasterizerFlags::NORMALS);
    assert_eq!((desc.convention, desc.width, desc.height), (Convention::GSPLAT, 8, 0));
    let text = to_string(&desc).unwrap();
    assert!(text.contains(r#""flags":"DEPTH | NORMALS""#), "{text}");
    assert_eq!(from_str::<RasterizerDesc>(&text).unwrap(), desc);
    for wrong in [r#"{"widht": 8}"#, r#"{"convention": "gsplatt"}"#, r#"{"flags": "DEPTHS"}"#] {
        let error = from_str::<RasterizerDesc>(wrong).unwrap_err().to_string();
        assert!(
            error.contains(&wrong[2..7]) || error.contains("GSPLAT") || error.contains("DEPTH,"),
            "{error}"
        );
    }
    let info = support::device().get_info().unwrap();
    assert_eq!(from_str::<DeviceInfo>(&to_string(&info).unwrap()).unwrap(), info);
    let nan = Score { psnr: f64::NAN, ..Default::default() };
    assert!(from_str::<Score>(&to_string(&nan).unwrap()).unwrap().psnr.is_nan());
    let mut scores = ObjectScores::default();
    (scores.novel.lpips, scores.predict_ms) = (f64::INFINITY, 1.5);
    let same: ObjectScores = from_str(&to_string(&scores).unwrap()).unwrap();
    assert!(same.novel.lpips.is_nan() && same.predict_ms == 1.5);
    let mut vif = FidelityScores::default();
    vif.channels[3] = f64::NAN;
    let same: FidelityScores = from_str(&to_string(&vif).unwrap()).unwrap();
    assert!(same.channels[0] == 0.0 && same.channels[3].is_nan());
    let camera = to_string(&support::camera()).unwrap();
    assert_eq!(from_str::<Camera>(&camera).unwrap(), support::camera());
    let device: DeviceDesc = from_str(r#"{"cache_folder": "", "kernels": "PLAIN"}"#).unwrap();
    assert_eq!((device.cache_folder, device.kernels), (Some("".into()), Kernels::PLAIN));
}
