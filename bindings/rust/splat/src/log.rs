//! Messages of the library.

use crate::error::{call, Result};
use crate::numbers::translated;
use crate::text::borrowed;
use crate::values::LogLevel;
use splat_sys as sys;
use std::any::Any;
use std::cell::{Cell, RefCell};
use std::os::raw::{c_char, c_void};
use std::panic::{catch_unwind, resume_unwind, AssertUnwindSafe};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

type Callback = Arc<dyn Fn(LogLevel, &str) + Send + Sync>;

/// What is set now. C has no pointer to it: it passes NULL as `user`, and messages look here, so that
/// a callback that is replaced while it runs stays alive until it returns.
struct Current {
    callback: Option<Callback>,
    level: LogLevel,
    changes: u64,
    /// `changes` as it was when each call of a callback that runs now began.
    running: Vec<u64>,
    /// The process whose calls these are: a forked child has none of them.
    process: u32,
}

static CURRENT: Mutex<Current> = Mutex::new(Current {
    callback: None,
    level: LogLevel(0),
    changes: 0,
    running: Vec::new(),
    process: 0,
});
static RETURNED: Condvar = Condvar::new();

/// The messages of a thread. They wait for the end of its call, when no lock is held and what the
/// call made has an owner.
struct Waiting {
    held: Cell<u32>,
    inside: Cell<bool>,
    messages: RefCell<Vec<(LogLevel, String)>>,
    panic: RefCell<Option<Box<dyn Any + Send>>>,
}

thread_local! {
    static WAITING: Waiting = const { Waiting {
        held: Cell::new(0),
        inside: Cell::new(false),
        messages: RefCell::new(Vec::new()),
        panic: RefCell::new(None),
    } };
}

fn current() -> MutexGuard<'static, Current> {
    let mut current = CURRENT.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if current.process != process {
        current.process = process;
        current.running.clear();
    }
    current
}

/// Send messages of `min_level` and above to `callback`, for the whole process. Without a callback
/// the library is silent. `LogLevel::default()` is [`LogLevel::WARNING`].
///
/// It runs on the thread that caused the message, at the end of the call that caused it, with no
/// lock of the library or of this crate held. It may call the library; messages that it causes
/// itself are dropped. A panic in it goes on in that call; in the drop of an object it goes on in
/// the thread's next call. No call of the callback before runs when this returns, unless a callback
/// calls this; so call it without a lock that the callback before takes.
///
/// The library calls into the code that set the callback: a plugin that can be unloaded calls
/// [`clear_callback`] first, or stays loaded.
///
/// ```
/// use splat::log::{clear_callback, set_callback};
/// set_callback(splat::LogLevel::WARNING, |level, text| eprintln!("{level:?}: {text}"))?;
/// clear_callback()?;
/// # Ok::<(), splat::Error>(())
/// ```
///
/// # Errors
/// [`Code::InvalidArgument`](crate::Code::InvalidArgument) if `min_level` is not a level.
pub fn set_callback(
    min_level: LogLevel,
    callback: impl Fn(LogLevel, &str) + Send + Sync + 'static,
) -> Result<()> {
    replace(min_level, Some(Arc::new(callback)))
}

/// Make the library silent. No callback runs when this returns, except the one that calls it.
///
/// # Errors
/// Another version of the library.
pub fn clear_callback() -> Result<()> {
    replace(LogLevel::default(), None)
}

fn replace(level: LogLevel, callback: Option<Callback>) -> Result<()> {
    let levels = LogLevel::default().0..=LogLevel::ERROR.0;
    if !levels.contains(&level.0) {
        // The library's own sentence; it changes nothing.
        return call!(splat_log_set_callback(None, std::ptr::null_mut(), level.0));
    }
    let (before, own) = {
        let mut current = current();
        current.level = level;
        current.changes += 1;
        let before = std::mem::replace(&mut current.callback, callback);
        (before, current.changes)
    };
    drop(before);
    // Another thread may have changed it again: the last one to come out sets what stands.
    loop {
        let (set, level, changes) = {
            let current = current();
            (current.callback.is_some(), current.level, current.changes)
        };
        let function: sys::splat_log_callback = if set { Some(trampoline) } else { None };
        call!(splat_log_set_callback(function, std::ptr::null_mut(), level.0))?;
        if current().changes == changes {
            break;
        }
    }
    // Inside a callback the wait could be for this thread, or for one that waits for this one.
    if !WAITING.try_with(|own| own.inside.get()).unwrap_or(true) {
        let earlier = |current: &mut Current| current.running.iter().any(|&run| run < own);
        drop(RETURNED.wait_while(current(), earlier));
    }
    Ok(())
}

unsafe extern "C" fn trampoline(_: *mut c_void, level: sys::splat_log_level, text: *const c_char) {
    // SAFETY: the library's text lives through this call.
    let (level, text) = (LogLevel(level), translated(unsafe { borrowed(text) }));
    let waits = |own: &Waiting| {
        if own.held.get() != 0 && !own.inside.get() {
            own.messages.borrow_mut().push((level, text.clone()));
        }
        own.held.get() != 0 || own.inside.get()
    };
    if !WAITING.try_with(waits).unwrap_or(false) {
        keep(run(level, &text));
    }
}

/// Call what is set, and catch its panic.
fn run(level: LogLevel, text: &str) -> std::thread::Result<()> {
    let (callback, changes) = {
        let mut current = current();
        let least = match current.level {
            LogLevel(0) => LogLevel::WARNING,
            level => level,
        };
        let callback = match &current.callback {
            Some(callback) if level >= least => Arc::clone(callback),
            _ => return Ok(()),
        };
        let changes = current.changes;
        current.running.push(changes);
        (callback, changes)
    };
    let inside = |inside| WAITING.try_with(|own| own.inside.set(inside)).ok();
    inside(true);
    let result = catch_unwind(AssertUnwindSafe(move || callback(level, text)));
    inside(false);
    let mut current = current();
    if let Some(place) = current.running.iter().position(|&run| run == changes) {
        current.running.swap_remove(place);
    }
    RETURNED.notify_all();
    result
}

/// Keep a panic for the end of the thread's next call. One of a thread that ends is lost.
fn keep(result: std::thread::Result<()>) {
    if let Err(panic) = result {
        let keep = |own: &Waiting| {
            own.panic.borrow_mut().get_or_insert(panic);
        };
        WAITING.try_with(keep).ok();
    }
}

/// Counts while messages wait.
struct Hold;

impl Hold {
    fn new() -> Self {
        WAITING.try_with(|own| own.held.set(own.held.get() + 1)).ok();
        Hold
    }
}

impl Drop for Hold {
    fn drop(&mut self) {
        WAITING.try_with(|own| own.held.set(own.held.get() - 1)).ok();
    }
}

/// Call what is set with the messages that wait, unless a call goes on.
fn deliver() {
    let take = |own: &Waiting| match own.held.get() {
        0 => own.messages.take(),
        _ => Vec::new(),
    };
    for (level, text) in WAITING.try_with(take).unwrap_or_default() {
        keep(run(level, &text));
    }
}

/// Do calls of the library, then deliver their messages. A panic in the callback goes on here, when
/// the result has an owner.
pub(crate) fn held<T>(work: impl FnOnce() -> T) -> T {
    let result = dropping(work);
    let take = |own: &Waiting| match own.held.get() {
        0 if !own.inside.get() && !std::thread::panicking() => own.panic.take(),
        _ => None,
    };
    if let Ok(Some(panic)) = WAITING.try_with(take) {
        resume_unwind(panic);
    }
    result
}

/// The same where no panic may leave; it goes on in the thread's next call.
pub(crate) fn dropping<T>(work: impl FnOnce() -> T) -> T {
    let hold = Hold::new();
    let result = work();
    drop(hold);
    deliver();
    result
}

#[cfg(test)]
mod tests {
    use super::WAITING;
    use crate::{Device, Tensor};

    #[test]
    fn a_panic_waits_where_it_would_leave_memory_without_an_owner() {
        let device = Device::create(&Default::default()).unwrap();
        let tensor = Tensor::from_slice(&device, &[2], &[1.0_f32, 2.0]).unwrap();
        WAITING.with(|own| *own.panic.borrow_mut() = Some(Box::new("late")));
        let shared = tensor.to_dlpack();
        assert!(std::panic::catch_unwind(Device::count).is_err());
        assert!(shared.map_or(true, |managed| !managed.is_null()));
    }
}
