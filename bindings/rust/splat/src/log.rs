//! Messages of the library.

use crate::error::{call, Result};
use crate::text::borrowed;
use crate::values::LogLevel;
use splat_sys as sys;
use std::any::Any;
use std::cell::RefCell;
use std::os::raw::{c_char, c_void};
use std::panic::{catch_unwind, resume_unwind, AssertUnwindSafe};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

type Callback = Arc<dyn Fn(LogLevel, &str) + Send + Sync>;

/// What is set now. C has no pointer to it: it passes NULL as `user`, and the trampoline looks here,
/// so that a callback that is replaced while it runs stays alive until it returns.
struct Current {
    callback: Option<Callback>,
    level: LogLevel,
    changes: u64,
}

static CURRENT: Mutex<Current> = Mutex::new(Current {
    callback: None,
    level: LogLevel(0),
    changes: 0,
});

static PANICKED: AtomicBool = AtomicBool::new(false);

thread_local! {
    static PANIC: RefCell<Option<Box<dyn Any + Send>>> = const { RefCell::new(None) };
}

fn current() -> MutexGuard<'static, Current> {
    CURRENT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Send messages of `min_level` and above to `callback`, for the whole process. Without a callback
/// the library is silent. `LogLevel::default()` is [`LogLevel::WARNING`].
///
/// It runs on the thread that caused the message, at the end of the call that caused it, and may
/// call the library. A panic in it goes on in that call; in the drop of an object it goes on in the
/// thread's next call.
///
/// Errors: [`Code::InvalidArgument`](crate::Code::InvalidArgument) if `min_level` is not a level.
pub fn set_callback(
    min_level: LogLevel,
    callback: impl Fn(LogLevel, &str) + Send + Sync + 'static,
) -> Result<()> {
    replace(min_level, Some(Arc::new(callback)))
}

/// Make the library silent. No callback runs when this returns, except the one that calls it.
pub fn clear_callback() -> Result<()> {
    replace(LogLevel::default(), None)
}

fn replace(level: LogLevel, callback: Option<Callback>) -> Result<()> {
    let levels = LogLevel::default().0..=LogLevel::ERROR.0;
    if !levels.contains(&level.0) {
        // The library's own sentence; it changes nothing.
        return call!(splat_log_set_callback(None, std::ptr::null_mut(), level.0));
    }
    let before = {
        let mut current = current();
        current.level = level;
        current.changes += 1;
        std::mem::replace(&mut current.callback, callback)
    };
    drop(before);
    // Another thread may have changed it again: the last one to come out sets what stands.
    loop {
        let (set, level, changes) = {
            let current = current();
            (current.callback.is_some(), current.level, current.changes)
        };
        let function: sys::splat_log_callback = if set { Some(trampoline) } else { None };
        call!(splat_log_set_callback(
            function,
            std::ptr::null_mut(),
            level.0
        ))?;
        if current().changes == changes {
            return Ok(());
        }
    }
}

unsafe extern "C" fn trampoline(_: *mut c_void, level: sys::splat_log_level, text: *const c_char) {
    let callback = current().callback.clone();
    let run = AssertUnwindSafe(|| {
        if let Some(callback) = callback {
            // SAFETY: the library's text lives through this call.
            callback(LogLevel(level), unsafe { borrowed(text) });
        }
    });
    if let Err(panic) = catch_unwind(run) {
        PANIC.with(|slot| *slot.borrow_mut() = Some(panic));
        PANICKED.store(true, Ordering::Release);
    }
}

/// Go on with a panic that the trampoline stopped on this thread.
pub(crate) fn resume_panic() {
    if !PANICKED.load(Ordering::Acquire) || std::thread::panicking() {
        return;
    }
    if let Some(panic) = PANIC.with(|slot| slot.borrow_mut().take()) {
        resume_unwind(panic);
    }
}
