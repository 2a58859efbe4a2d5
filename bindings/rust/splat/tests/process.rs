//! The log callback with panics in it, forks, and the end of a process with live objects.
//! These change the whole process, so each runs as one of its own, which this program starts.

mod support;

use splat::{
    image, log, Code, DecodeLimits, Device, DeviceDesc, Image, ImageFormat, LogLevel, NamedArray,
    PortKind, Scene, Tensor, Trainer, Training, Weights, WeightsFormat,
};
use std::cell::RefCell;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Barrier, Mutex};
use std::time::Duration;
use support::model_and_optimizer;

/// Run a test of this program, which is ignored otherwise, in a process of its own.
fn run_alone(name: &str) {
    let program = std::env::current_exe().unwrap();
    let output =
        Command::new(program).args([name, "--exact", "--ignored", "--nocapture"]).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}: {}\n{text}", output.status);
    assert!(text.contains("1 passed"), "{name}: {text}");
}

/// Tests, each in a process that runs another one.
macro_rules! alone {
    ($($(#[$cfg:meta])* $test:ident $name:literal,)*) => {
        $($(#[$cfg])* #[test] fn $test() { run_alone($name) })*
    };
}
alone! {
    messages_arrive "alone_messages",
    a_panic_in_the_callback_goes_on_in_the_call "alone_panic",
    callbacks_are_replaced_while_they_run "alone_replaced",
    limits_of_decoding_hold_until_they_are_replaced "alone_limits",
    a_callback_uses_what_shares_a_network "alone_sharing",
    clearing_waits_for_every_callback_that_runs "alone_clearing",
    calls_of_an_ending_thread_return_after_a_panic "alone_ending_thread",
    #[cfg(target_os = "linux")] a_panic_in_the_callback_leaks_no_object "alone_leak",
    a_process_ends_with_live_objects "alone_live_objects",
    #[cfg(unix)] a_forked_child_gets_errors "alone_fork",
}

/// Opens a device, of which the library tells at the level of information.
fn cause_messages() {
    drop(Device::create(&DeviceDesc::default()).unwrap());
}

#[test]
#[ignore = "run by messages_arrive"]
fn alone_messages() {
    let messages = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&messages);
    log::set_callback(LogLevel::DEBUG, move |level, text| {
        sink.lock().unwrap().push((level, text.to_owned()));
        assert!(Device::count().unwrap() > 0);
    })
    .unwrap();
    cause_messages();
    assert!(log::set_callback(LogLevel(9), |_, _| {}).is_err());
    log::clear_callback().unwrap();
    let count = messages.lock().unwrap().len();
    assert!(count > 0);
    cause_messages();
    assert_eq!(messages.lock().unwrap().len(), count);
    assert_eq!(Arc::strong_count(&messages), 1, "the callback was not freed");
}

#[test]
#[ignore = "run by a_panic_in_the_callback_goes_on_in_the_call"]
fn alone_panic() {
    log::set_callback(LogLevel::DEBUG, |_, text| panic!("of {text}")).unwrap();
    let panic = catch_unwind(cause_messages).unwrap_err();
    assert!(panic.downcast_ref::<String>().unwrap().starts_with("of "));
    log::clear_callback().unwrap();
    cause_messages();
}

#[test]
#[ignore = "run by callbacks_are_replaced_while_they_run"]
fn alone_replaced() {
    let calls = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&calls);
    log::set_callback(LogLevel::DEBUG, move |_, _| {
        counted.fetch_add(1, Ordering::Relaxed);
        log::clear_callback().unwrap();
        // What the callback owns is still there.
        assert!(counted.load(Ordering::Relaxed) > 0);
    })
    .unwrap();
    cause_messages();
    assert_eq!(calls.load(Ordering::Relaxed), 1);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                for _ in 0..200 {
                    let counted = Arc::clone(&calls);
                    log::set_callback(LogLevel::DEBUG, move |_, _| {
                        counted.fetch_add(1, Ordering::Relaxed);
                    })
                    .unwrap();
                }
            });
        }
        scope.spawn(|| (0..5).for_each(|_| cause_messages()));
    });
    log::clear_callback().unwrap();
    assert_eq!(Arc::strong_count(&calls), 1, "a callback was not freed");
}

#[test]
#[ignore = "run by limits_of_decoding_hold_until_they_are_replaced"]
fn alone_limits() {
    let png = Image::<u8>::new([64, 64], 3).unwrap();
    let png = image::save_memory(png.view().unwrap(), ImageFormat::PNG).unwrap();
    let jpeg = include_bytes!("../../../../tests/fuzz/corpora/jpeg/progressive");
    let tensors = ["a", "b"].map(|name| NamedArray { name, values: &[1.0], dims: &[1] });
    let tensors = Weights::from_arrays(&tensors).unwrap();
    let tensors = tensors.save_memory(WeightsFormat::SAFETENSORS, Default::default()).unwrap();
    let read_png = || Image::<u8>::load_memory(&png, 0).map(drop);
    let read_jpeg = || Image::<u8>::load_memory(jpeg, 0).map(drop);
    let read_tensors = || Weights::load_memory(&tensors).map(drop);
    let refused = |limits: DecodeLimits, read: &dyn Fn() -> splat::Result<()>, part: &str| {
        splat::set_decode_limits(&limits).unwrap();
        let error = read().unwrap_err();
        assert_eq!(error.code(), Code::Format, "{error}");
        assert!(error.message().contains(part), "{error}");
    };
    let none = DecodeLimits::default();
    let bytes =
        |bytes_times_file, bytes_besides| DecodeLimits { bytes_times_file, bytes_besides, ..none };
    refused(bytes(1, 1000), &read_png, "set_decode_limits");
    for limits in [bytes(1000, 1000), bytes(1, 1 << 20)] {
        splat::set_decode_limits(&limits).unwrap();
        read_png().unwrap();
    }
    let jpeg_scans = 1;
    refused(DecodeLimits { jpeg_scans, ..none }, &read_jpeg, "scans");
    let one = DecodeLimits { items: 1, ..none };
    refused(one, &read_tensors, "more than 1 tensors");
    splat::set_decode_limits(&none).unwrap();
    read_jpeg().unwrap();
    read_tensors().unwrap();
}

/// What a network and what shares it are made with.
const TINY: &str =
    "model: {base_dim: 8, num_blocks: 1, channel_mult: [1, 2], attention_resolutions: [8]}\n\
     data: {training_resolution: 16}\n";

/// Do `work` on another thread, which must end.
fn assert_ends(what: &str, work: impl FnOnce() + Send + 'static) {
    let (sender, done) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        work();
        sender.send(()).unwrap();
    });
    let ended = done.recv_timeout(Duration::from_secs(30));
    assert!(ended.is_ok(), "{what}: {ended:?}");
}

#[test]
#[ignore = "run by a_callback_uses_what_shares_a_network"]
fn alone_sharing() {
    let device = support::device();
    let trainer = Trainer::create(device, Some(TINY)).unwrap();
    let calls = Arc::new(AtomicUsize::new(0));
    let (counted, model) = (Arc::clone(&calls), Mutex::new(trainer.model().unwrap()));
    log::set_callback(LogLevel::DEBUG, move |_, _| {
        let ports = model.lock().unwrap().ports(PortKind::INPUT).unwrap();
        counted.fetch_add(ports.len(), Ordering::Relaxed);
    })
    .unwrap();
    assert_ends("the network of a trainer", move || {
        trainer.resume_memory(b"bad").unwrap_err();
    });
    assert!(calls.swap(0, Ordering::Relaxed) > 0);

    let (model, optimizer) = model_and_optimizer(device, TINY);
    let (counted, optimizer) = (Arc::clone(&calls), Mutex::new(optimizer));
    log::set_callback(LogLevel::DEBUG, move |_, _| {
        optimizer.lock().unwrap().zero_gradients().unwrap();
        counted.fetch_add(1, Ordering::Relaxed);
    })
    .unwrap();
    assert_ends("the optimizer of a network", move || {
        let error = model.write("nothing", &[]).unwrap_err();
        assert_eq!(error.code(), Code::NotFound, "{error}");
    });
    assert!(calls.load(Ordering::Relaxed) > 0);
    log::clear_callback().unwrap();
}

#[test]
#[ignore = "run by clearing_waits_for_every_callback_that_runs"]
fn alone_clearing() {
    let (entered, leave) = (Arc::new(Barrier::new(2)), Arc::new(Barrier::new(2)));
    let (enter, left) = (Arc::clone(&entered), Arc::clone(&leave));
    let runs = Arc::new(AtomicBool::new(false));
    let running = Arc::clone(&runs);
    log::set_callback(LogLevel::DEBUG, move |_, _| {
        if !running.swap(true, Ordering::SeqCst) {
            enter.wait();
            left.wait();
            std::thread::sleep(Duration::from_millis(100));
            running.store(false, Ordering::SeqCst);
            log::clear_callback().unwrap(); // no further message
        }
    })
    .unwrap();
    std::thread::scope(|scope| {
        scope.spawn(cause_messages);
        entered.wait();
        scope.spawn(|| log::set_callback(LogLevel::DEBUG, |_, _| {}).unwrap());
        std::thread::sleep(Duration::from_millis(200)); // it waits
        let (sender, cleared) = std::sync::mpsc::channel();
        let runs = &runs;
        scope.spawn(move || {
            log::clear_callback().unwrap();
            sender.send(runs.load(Ordering::SeqCst)).unwrap();
        });
        let early = cleared.recv_timeout(Duration::from_millis(300)).ok();
        leave.wait();
        let runs = early.unwrap_or_else(|| cleared.recv().unwrap());
        assert!(!runs, "the first callback still runs");
    });
}

/// Calls the library when its thread ends.
struct Last;

impl Drop for Last {
    fn drop(&mut self) {
        assert!(Device::count().unwrap() > 0);
        drop(support::scene(2));
    }
}

#[test]
#[ignore = "run by calls_of_an_ending_thread_return_after_a_panic"]
fn alone_ending_thread() {
    thread_local!(static LAST: Last = const { Last });
    log::set_callback(LogLevel::DEBUG, |_, text| panic!("of {text}")).unwrap();
    std::thread::spawn(|| {
        LAST.with(|_| ());
        catch_unwind(cause_messages).unwrap_err();
    })
    .join()
    .unwrap();
    log::clear_callback().unwrap();
    cause_messages();
}

#[cfg(target_os = "linux")]
#[test]
#[ignore = "run by a_panic_in_the_callback_leaks_no_object"]
fn alone_leak() {
    let threads = || std::fs::read_dir("/proc/self/task").unwrap().count();
    cause_messages();
    let before = threads();
    log::set_callback(LogLevel::DEBUG, |_, text| panic!("of {text}")).unwrap();
    (0..4).for_each(|_| drop(catch_unwind(cause_messages).unwrap_err()));
    log::clear_callback().unwrap();
    let late = (0..50).take_while(|_| {
        std::thread::sleep(Duration::from_millis(20));
        threads() > before
    });
    assert!(late.count() < 50, "{} threads, {before} before", threads());
}

#[test]
#[ignore = "run by a_process_ends_with_live_objects"]
fn alone_live_objects() {
    log::set_callback(LogLevel::DEBUG, |_, _| {}).unwrap();
    let device = support::device();
    let tensor = Tensor::from_slice(device, &[4], &[0.0_f32; 4]).unwrap();
    std::mem::forget(tensor.map::<f32>().unwrap());
    std::mem::forget(tensor);
    std::mem::forget(support::scene(3));
    std::mem::forget(support::rasterizer(device, Default::default()));
    thread_local!(static LAST: RefCell<Option<Scene>> = const { RefCell::new(None) });
    LAST.with(|last| *last.borrow_mut() = Some(support::scene(2)));
    std::thread::spawn(|| LAST.with(|last| *last.borrow_mut() = Some(support::scene(2))))
        .join()
        .unwrap();
}

#[cfg(unix)]
mod unix {
    extern "C" {
        pub fn fork() -> i32;
        pub fn waitpid(process: i32, status: *mut i32, options: i32) -> i32;
        pub fn _exit(status: i32) -> !;
    }
}

/// What a forked child finds wrong, or nothing.
#[cfg(unix)]
fn child(tensor: Tensor, device: &Device, scene: Scene) -> Option<&'static str> {
    let refused = |result: splat::Result<()>| matches!(result, Err(error) if error.code() == Code::InvalidState);
    if !refused(tensor.to_vec::<f32>().map(drop)) || !refused(device.get_memory().map(drop)) {
        return Some("an object of the parent's device was not refused");
    }
    drop(tensor);
    if scene.to_vec("means").is_err() {
        return Some("a scene does not work");
    }
    if !refused(Training::open(device, &Default::default()).map(drop)) {
        return Some("a training of the parent's device was not refused");
    }
    if !refused(Device::create(&Default::default()).map(drop)) {
        return Some("a device of the child was not refused");
    }
    None
}

#[cfg(unix)]
#[test]
#[ignore = "run by a_forked_child_gets_errors"]
fn alone_fork() {
    let device = Device::create(&Default::default()).unwrap();
    let tensor = Tensor::from_slice(&device, &[2], &[1.0_f32, 2.0]).unwrap();
    let scene = support::scene(5);
    // SAFETY: the child returns to no other frame; it leaves by _exit.
    let process = unsafe { unix::fork() };
    if process == 0 {
        let found = catch_unwind(AssertUnwindSafe(|| child(tensor, &device, scene)));
        let status = match found {
            Ok(None) => 0,
            Ok(Some(text)) => {
                eprintln!("child: {text}");
                1
            }
            Err(_) => 2,
        };
        // SAFETY: ends the child without the parent's handlers.
        unsafe { unix::_exit(status) };
    }
    let mut status = -1;
    // SAFETY: status lives through the call.
    assert_eq!(unsafe { unix::waitpid(process, &mut status, 0) }, process);
    assert_eq!(status, 0, "the child failed, see its message");
    assert_eq!(tensor.to_vec::<f32>().unwrap(), [1.0, 2.0]);
}
