//! Calls beside each other: cancelling, and dropping what others use.

mod support;

use splat::{
    Code, Device, Image, Model, ModelDesc, ModelInput, Picture, Predictor, RasterState, Tensor,
    Trainer,
};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;
use support::{camera, model_and_optimizer, rasterizer, scene};

const TINY: &str = "model: {base_dim: 8, num_blocks: 1, channel_mult: [1, 2], \
                    attention_resolutions: [8]}\ndata: {training_resolution: 16}\n\
                    opt: {batch_size: 1, imgs_per_obj: 2}\n";

fn picture() -> Image<u8> {
    let mut picture = Image::<u8>::new([64, 64], 4).unwrap();
    picture.pixels.iter_mut().enumerate().for_each(|(i, pixel)| *pixel = (i % 251) as u8 | 128);
    picture
}

#[test]
fn another_thread_cancels_a_long_call() {
    let device = Device::create(&Default::default()).unwrap();
    let predictor = Predictor::create(&device, &Default::default()).unwrap();
    let picture = picture();
    let pictures = [Picture::pixels(picture.view().unwrap())];
    let done = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                device.cancel().unwrap();
                thread::sleep(Duration::from_millis(1));
            }
        });
        let error = (0..1000).find_map(|_| predictor.predict(&pictures).err());
        done.store(true, Ordering::Relaxed);
        assert_eq!(error.expect("no call was cancelled").code(), Code::Cancelled);
    });
    drop(predictor.predict(&pictures).unwrap());
    let canceller = device.canceller();
    drop(device);
    assert_eq!(canceller.cancel().unwrap_err().code(), Code::InvalidHandle);
}

#[test]
fn objects_are_dropped_while_another_thread_computes() {
    let device = Device::create(&Default::default()).unwrap();
    let predictor = Predictor::create(&device, &Default::default()).unwrap();
    let tensors: Vec<Tensor> =
        (0..8).map(|_| Tensor::from_slice(&device, &[4096], &[1.0_f32; 4096]).unwrap()).collect();
    let (scene, rasterizer) = (scene(100), rasterizer(&device, Default::default()));
    rasterizer.forward_scene(None, &scene, &[camera()], None).unwrap();
    let started = AtomicBool::new(false);
    thread::scope(|scope| {
        let worker = scope.spawn(|| {
            let picture = picture();
            let pictures = [Picture::pixels(picture.view().unwrap())];
            started.store(true, Ordering::Relaxed);
            (0..3).for_each(|_| drop(predictor.predict(&pictures).unwrap()));
            predictor.predict(&pictures).unwrap()
        });
        while !started.load(Ordering::Relaxed) {
            thread::yield_now();
        }
        drop(device);
        drop(tensors);
        drop(scene);
        drop(rasterizer);
        assert!(worker.join().unwrap().get_info().unwrap().count > 0);
    });
}

/// Drops the objects of a device in the order of `places`.
fn drop_in(order: [usize; 6]) -> Result<(), splat::Error> {
    let device = Device::create(&Default::default())?;
    let tensor = Tensor::from_slice(&device, &[64, 64], &[1.0_f32; 4096])?;
    let rasterizer = rasterizer(&device, Default::default());
    let state = RasterState::create(&rasterizer)?;
    let scene = scene(20);
    rasterizer.forward_scene(Some(&state), &scene, &[camera()], None)?;
    let model = Model::create(&device, &ModelDesc { config: Some(TINY), ..Default::default() })?;
    let watch = device.canceller();
    let mut objects: Vec<Option<Box<dyn std::any::Any>>> = vec![
        Some(Box::new(device)),
        Some(Box::new(tensor)),
        Some(Box::new(rasterizer)),
        Some(Box::new(state)),
        Some(Box::new(scene)),
        Some(Box::new(model)),
    ];
    order.iter().for_each(|&place| drop(objects[place].take()));
    assert_eq!(watch.cancel().unwrap_err().code(), Code::InvalidHandle);
    Ok(())
}

#[test]
fn objects_are_dropped_in_any_order() {
    for order in [[0, 1, 2, 3, 4, 5], [5, 4, 3, 2, 1, 0], [2, 0, 5, 3, 1, 4], [3, 5, 1, 0, 4, 2]] {
        drop_in(order).unwrap();
    }
}

#[test]
fn children_work_after_their_device_is_dropped() {
    let device = Device::create(&Default::default()).unwrap();
    let tensor = Tensor::from_slice(&device, &[2], &[1.0_f32, 2.0]).unwrap();
    let model = Model::create(&device, &ModelDesc { config: Some(TINY), ..Default::default() });
    let shared = model.as_ref().unwrap().tensor("images").unwrap();
    drop(device);
    tensor.write(&[3.0_f32, 4.0], None).unwrap();
    assert_eq!(tensor.to_vec::<f32>().unwrap(), [3.0, 4.0]);
    drop(model);
    shared.write(&vec![0.5_f32; shared.elements()], None).unwrap();
}

#[test]
fn memory_returns_when_objects_are_dropped() {
    let device = Device::create(&Default::default()).unwrap();
    let before = device.get_memory().unwrap().live_bytes;
    for _ in 0..3 {
        let model = Model::create(&device, &ModelDesc { config: Some(TINY), ..Default::default() });
        let tensor = model.unwrap().tensor("images").unwrap();
        assert!(device.get_memory().unwrap().live_bytes > before);
        drop(tensor);
        assert_eq!(device.get_memory().unwrap().live_bytes, before);
    }
}

#[test]
fn what_shares_a_network_waits_for_its_calls() {
    let device = Device::create(&Default::default()).unwrap();
    let (model, optimizer) = model_and_optimizer(&device, TINY);
    let worker = thread::spawn(move || {
        for _ in 0..20 {
            optimizer.step().unwrap();
            optimizer.zero_gradients().unwrap();
        }
        optimizer.store().unwrap().count().unwrap()
    });
    let images = vec![0.5; 3 * 16 * 16];
    for _ in 0..20 {
        model.forward(&ModelInput { images: Some(&images), ..Default::default() }).unwrap();
        model.to_vec("means").unwrap();
    }
    assert!(worker.join().unwrap() > 0);
    let trainer = Trainer::create(&device, Some(TINY)).unwrap();
    let model = trainer.model().unwrap();
    let worker = thread::spawn(move || (0..20).for_each(|i| model.init(i).unwrap()));
    (0..20).for_each(|_| drop(trainer.store().unwrap()));
    worker.join().unwrap();
}
