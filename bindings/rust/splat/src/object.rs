//! Objects behind handles.

use crate::log::held;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A struct that owns a handle and destroys it. Children keep their parents alive in the library,
/// so objects may be dropped in any order. Fields after the handle are the crate's own.
macro_rules! object {
    ($(#[$doc:meta])* $name:ident, $raw:ident, $destroy:ident
     $(, $field:ident: $kind:ty)* $(,)?) => {
        $(#[$doc])*
        #[must_use]
        pub struct $name {
            pub(crate) handle: splat_sys::$raw,
            $(pub(crate) $field: $kind,)*
        }

        impl $name {
            /// Own what a call makes. Messages of the call arrive when it is owned.
            pub(crate) fn made(
                make: impl FnOnce(*mut splat_sys::$raw) -> crate::Result<()>,
            ) -> crate::Result<Self> {
                crate::log::held(|| {
                    let mut handle = std::ptr::null_mut();
                    make(&mut handle)?;
                    Ok($name { handle, $($field: Default::default()),* })
                })
            }

            /// The handle of C, which this object still owns.
            pub fn as_raw(&self) -> splat_sys::$raw {
                self.handle
            }
        }

        impl Drop for $name {
            fn drop(&mut self) {
                // SAFETY: destroying never waits and may happen on any thread; a handle is used
                // once, so one that is not live is refused.
                crate::log::dropping(|| unsafe { splat_sys::$destroy(self.handle) });
            }
        }

        /// Objects are equal if their handles are.
        impl PartialEq for $name {
            fn eq(&self, other: &Self) -> bool {
                self.handle == other.handle
            }
        }

        impl Eq for $name {}

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
#[derive(Clone)]
pub(crate) struct Serial(Vec<Arc<Mutex<()>>>);

impl Default for Serial {
    fn default() -> Self {
        Serial(vec![Arc::default()])
    }
}

impl Serial {
    /// All locks of `others`, in one order for all threads.
    pub(crate) fn of<'a>(others: impl IntoIterator<Item = &'a Serial>) -> Self {
        let mut locks: Vec<Arc<Mutex<()>>> =
            others.into_iter().flat_map(|serial| serial.0.iter().cloned()).collect();
        locks.sort_by_key(Arc::as_ptr);
        locks.dedup_by(|a, b| Arc::ptr_eq(a, b));
        Serial(locks)
    }

    /// Do a call when those of other threads have ended; its messages arrive without a lock. A panic
    /// in one of them left nothing undone here.
    pub(crate) fn with<T>(&self, work: impl FnOnce() -> T) -> T {
        held(|| {
            let _locks: Vec<MutexGuard<'_, ()>> = self
                .0
                .iter()
                .map(|lock| lock.lock().unwrap_or_else(PoisonError::into_inner))
                .collect();
            work()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::Serial;
    use crate::*;
    use std::sync::mpsc;
    use std::time::Duration;

    /// Assert that `call` waits while another thread has the locks.
    fn assert_waits(what: &str, serial: Serial, call: impl FnOnce() + Send + 'static) {
        let (sender, done) = mpsc::channel();
        serial.with(|| {
            std::thread::spawn(move || {
                call();
                sender.send(()).unwrap();
            });
            let waited = done.recv_timeout(Duration::from_millis(500)).is_err();
            assert!(waited, "{what}: a call did not wait");
        });
        done.recv().unwrap();
    }

    #[test]
    fn calls_on_one_network_wait_for_each_other() {
        let folder =
            std::env::temp_dir().join(format!("splat_rust_waiting_{}", std::process::id()));
        let desc = SyntheticDesc {
            path: Some(&folder),
            resolution: 64,
            test_views: 2,
            test_objects: 1,
            ..Default::default()
        };
        synthetic_write(&desc, 0).unwrap();
        let device = Device::create(&Default::default()).unwrap();
        let predictor = Predictor::create(&device, &Default::default()).unwrap();
        let desc = EvaluatorDesc {
            predictor: Some(&predictor),
            data_path: Some(&folder),
            ..Default::default()
        };
        let [one, other] = [(); 2].map(|()| Evaluator::create(&desc).unwrap());
        assert_waits("evaluators of one predictor", one.serial.clone(), move || {
            other.read(0, &mut EvaluatedViews::default()).unwrap();
        });
        std::fs::remove_dir_all(&folder).unwrap();

        let config = "model: {base_dim: 8, num_blocks: 1, channel_mult: [1, 2], \
                      attention_resolutions: [8]}\ndata: {training_resolution: 16}\n";
        let trainer = Trainer::create(&device, Some(config)).unwrap();
        let model = trainer.model().unwrap();
        assert_waits("a trainer and its network", trainer.serial.clone(), move || {
            model.init(1).unwrap();
        });

        let desc =
            ModelDesc { flags: ModelFlags::GRADIENTS, config: Some(config), ..Default::default() };
        let model = Model::create(&device, &desc).unwrap();
        let desc =
            OptimizerDesc { items: &[OptimizerItem::Model(None, &model)], ..Default::default() };
        let optimizer = Optimizer::create(&device, &desc).unwrap();
        assert_waits("a network and its optimizer", model.serial.clone(), move || {
            optimizer.zero_gradients().unwrap();
        });
    }
}
