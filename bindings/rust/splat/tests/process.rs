//! The log callback with panics in it, forks, and the end of a process with live objects.
//! These change the whole process, so each runs as one of its own, which this program starts.

mod support;

use splat::{log, Code, Device, DeviceDesc, LogLevel, Scene, Tensor, Training};
use std::cell::RefCell;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// Run a test of this program, which is ignored otherwise, in a process of its own.
fn run_alone(name: &str) {
    let program = std::env::current_exe().unwrap();
    let output = Command::new(program)
        .args([name, "--exact", "--ignored", "--nocapture"])
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}: {}\n{text}", output.status);
    assert!(text.contains("1 passed"), "{name}: {text}");
}

#[test]
fn messages_arrive() {
    run_alone("alone_messages");
}

#[test]
fn a_panic_in_the_callback_goes_on_in_the_call() {
    run_alone("alone_panic");
}

#[test]
fn callbacks_are_replaced_while_they_run() {
    run_alone("alone_replaced");
}

#[test]
fn a_process_ends_with_live_objects() {
    run_alone("alone_live_objects");
}

#[cfg(unix)]
#[test]
fn a_forked_child_gets_errors() {
    run_alone("alone_fork");
}

/// Opens a device, of which the library tells at the level of information.
fn cause_messages() {
    Device::create(&DeviceDesc::default()).unwrap();
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
    assert_eq!(
        Arc::strong_count(&messages),
        1,
        "the callback was not freed"
    );
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
#[ignore = "run by a_process_ends_with_live_objects"]
fn alone_live_objects() {
    log::set_callback(LogLevel::DEBUG, |_, _| {}).unwrap();
    let device = support::device();
    let tensor = Tensor::from_slice(device, &[4], &[0.0_f32; 4]).unwrap();
    std::mem::forget(tensor.map(splat::Access::READ).unwrap());
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
    let own = Device::create(&Default::default());
    match own.and_then(|own| Tensor::from_slice(&own, &[2], &[1.0_f32, 2.0])?.to_vec::<f32>()) {
        Ok(values) if values == [1.0, 2.0] => None,
        _ => Some("a device of the child does not work"),
    }
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
