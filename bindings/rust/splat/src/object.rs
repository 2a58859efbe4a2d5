//! Objects behind handles.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A struct that owns a handle and destroys it. Children keep their parents alive in the library,
/// so objects may be dropped in any order. Fields after the handle are the crate's own.
macro_rules! object {
    ($(#[$doc:meta])* $name:ident, $raw:ident, $destroy:ident
     $(, $field:ident: $kind:ty)* $(,)?) => {
        $(#[$doc])*
        pub struct $name {
            pub(crate) handle: splat_sys::$raw,
            $(pub(crate) $field: $kind,)*
        }

        impl $name {
            /// The handle of C, which this object still owns.
            pub fn as_raw(&self) -> splat_sys::$raw {
                self.handle
            }
        }

        impl Drop for $name {
            fn drop(&mut self) {
                // SAFETY: destroying never waits and may happen on any thread; a handle is used
                // once, so one that is not live is refused.
                unsafe { splat_sys::$destroy(self.handle) };
            }
        }

        impl std::fmt::Debug for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, "{}({:p})", stringify!($name), self.handle)
            }
        }
    };
}
pub(crate) use object;

/// The locks of what the caller synchronises in C: objects with another handle share them, such as
/// the network of a trainer, or what an optimizer updates.
#[derive(Clone, Default)]
pub(crate) struct Serial(Vec<Arc<Mutex<()>>>);

impl Serial {
    pub(crate) fn new() -> Self {
        Serial(vec![Arc::default()])
    }

    /// All locks of `others`, in one order for all threads.
    pub(crate) fn of<'a>(others: impl IntoIterator<Item = &'a Serial>) -> Self {
        let mut locks: Vec<Arc<Mutex<()>>> = others
            .into_iter()
            .flat_map(|serial| serial.0.iter().cloned())
            .collect();
        locks.sort_by_key(Arc::as_ptr);
        locks.dedup_by(|a, b| Arc::ptr_eq(a, b));
        Serial(locks)
    }

    /// Wait for calls of other threads. A panic in one of them left nothing undone here.
    pub(crate) fn lock(&self) -> Vec<MutexGuard<'_, ()>> {
        self.0
            .iter()
            .map(|lock| lock.lock().unwrap_or_else(PoisonError::into_inner))
            .collect()
    }
}
