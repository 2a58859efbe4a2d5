//! Sizes that no memory holds are errors, before memory is taken.

mod support;

use splat::{image, prior_scores, Camera, Code, Image, ImageFormat, ImageView, Result};

#[track_caller]
fn refused<T>(result: Result<T>) {
    let code = result.err().expect("not refused").code();
    let expected = [Code::InvalidArgument, Code::OutOfHostMemory];
    assert!(expected.contains(&code), "{code:?}");
}

#[test]
fn sizes_that_no_memory_holds_are_refused() {
    let scene = support::scene(3);
    refused(Camera::orbit(&scene, &Default::default(), u32::MAX));
    for count in [usize::MAX / 64, usize::MAX / 2, usize::MAX] {
        refused(prior_scores::mesh_points("none.obj", count, 0));
    }
    for side in [3_000_000, u32::MAX] {
        let depth = ImageView::new(&[1.0_f32], [side; 2], 1).unwrap();
        refused(prior_scores::depth_points(depth, &support::camera()));
    }
    let wide = Camera { width: u32::MAX, height: u32::MAX, ..support::camera() };
    let desc = Default::default();
    refused(scene.render::<f32>(None, &[wide], 4, &desc));
    refused(scene.render::<u8>(None, &[support::camera()], u32::MAX, &desc));
}

#[test]
fn images_have_samples_that_memory_holds() {
    for size in [[1 << 31; 2], [u32::MAX; 2]] {
        for channels in [1, 4] {
            refused(Image::<u8>::new(size, channels));
            refused(Image::<f32>::new(size, channels));
        }
    }
    for channels in [0, 5, u32::MAX] {
        refused(Image::<u8>::new([2, 2], channels));
    }
    let image = Image::<u8>::new([2, 3], 4).unwrap();
    assert_eq!(image.pixels, [0; 24]);
    let png = image::save_memory(image.view().unwrap(), ImageFormat::PNG).unwrap();
    refused(Image::<u8>::load_memory(&png, u32::MAX));
    assert_eq!(Image::<u8>::load_memory(&png, 4).unwrap().0, image);
}
