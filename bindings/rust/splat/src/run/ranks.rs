//! Processes or threads that train together, one rank each.

use splat_sys as sys;
use std::any::Any;
use std::ffi::CString;
use std::os::raw::{c_char, c_void};
use std::panic::{catch_unwind, AssertUnwindSafe};

/// What a call of [`Ranks`] gives: an error is a sentence.
pub type RanksResult = std::result::Result<(), String>;

/// What a rank of a training reaches the others by, see
/// [`Training::open_with_ranks`](crate::Training::open_with_ranks).
///
/// All ranks make the same calls in the same order, on a thread of the library's choice. An error
/// ends the training and is in the sentence of its error; a panic ends it too and goes on in the call
/// of the training that runs. Other ranks get the sentence, or wait until their own call gives up: it
/// needs a time limit.
pub trait Ranks: Send {
    /// Send bytes to rank `peer` and receive as many from it, which makes the same call.
    /// # Errors
    /// What ends the training.
    fn send_receive(&mut self, peer: u32, sent: &[u8], received: &mut [u8]) -> RanksResult;

    /// Give the bytes of rank `root` to all.
    /// # Errors
    /// What ends the training.
    fn broadcast(&mut self, root: u32, data: &mut [u8]) -> RanksResult;

    /// Return when all ranks have called it.
    /// # Errors
    /// What ends the training.
    fn barrier(&mut self) -> RanksResult;

    /// Whether [`Ranks::sum`] sums gradients. If not, they are summed in a fixed order, and 1, 2, 4... ranks have the
    /// same bits.
    fn sums(&self) -> bool {
        false
    }

    /// Replace numbers by their sums over all ranks, in any order: then runs cannot be reproduced.
    /// # Errors
    /// What ends the training.
    fn sum(&mut self, _values: &mut [f32]) -> RanksResult {
        Err("these ranks have no sum".to_owned())
    }
}

/// What C has a pointer to.
struct State {
    ranks: Box<dyn Ranks>,
    text: CString,
    panic: Option<Box<dyn Any + Send>>,
}

/// Owns it. It must outlive the run that has [`Group::raw`].
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Group(*mut State);

// SAFETY: the state is that of one run, which one thread uses at a time; all in it is Send.
unsafe impl Send for Group {}

impl Group {
    pub(crate) fn new(ranks: Box<dyn Ranks>) -> Self {
        Group(Box::into_raw(Box::new(State { ranks, text: CString::default(), panic: None })))
    }

    pub(crate) fn raw(&self, rank: u32, count: u32) -> sys::splat_group {
        sys::splat_group {
            rank,
            count,
            user: self.0.cast(),
            send_receive: Some(send_receive),
            broadcast: Some(broadcast),
            barrier: Some(barrier),
            // SAFETY: no call of the library runs.
            sum: if unsafe { (*self.0).ranks.sums() } { Some(sum) } else { None },
            describe: Some(describe),
            ..Default::default()
        }
    }

    /// The panic of a call, which goes on in the caller.
    pub(crate) fn panic(&self) -> Option<Box<dyn Any + Send>> {
        // SAFETY: no call of the library runs, which alone uses the state besides.
        unsafe { (*self.0).panic.take() }
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        // SAFETY: it is that of Box::into_raw, and the run is destroyed.
        drop(unsafe { Box::from_raw(self.0) });
    }
}

/// # Safety
/// `user` is a Group's, used by this call alone.
unsafe fn called(user: *mut c_void, work: impl FnOnce(&mut dyn Ranks) -> RanksResult) -> i32 {
    // SAFETY: by the caller.
    let state = unsafe { &mut *user.cast::<State>() };
    let text = match catch_unwind(AssertUnwindSafe(|| work(&mut *state.ranks))) {
        Ok(Ok(())) => return 0,
        Ok(Err(text)) => text,
        Err(panic) => {
            state.panic.get_or_insert(panic);
            "it panicked".to_owned()
        }
    };
    state.text = CString::new(text.replace('\0', " ")).unwrap_or_default();
    1
}

/// # Safety
/// As of `std::slice::from_raw_parts_mut`, but none may be at NULL.
unsafe fn slice<'a, T>(data: *mut c_void, count: u64) -> &'a mut [T] {
    if count == 0 {
        return &mut [];
    }
    // SAFETY: by the caller.
    unsafe { std::slice::from_raw_parts_mut(data.cast(), count as usize) }
}

unsafe extern "C" fn send_receive(
    user: *mut c_void,
    peer: u32,
    sent: *const c_void,
    received: *mut c_void,
    count: u64,
) -> i32 {
    // SAFETY: group.h: both have so many bytes and do not overlap; nothing writes `sent` meanwhile.
    unsafe {
        let (sent, received): (&[u8], _) =
            (slice(sent as *mut c_void, count), slice(received, count));
        called(user, |ranks| ranks.send_receive(peer, sent, received))
    }
}

unsafe extern "C" fn broadcast(user: *mut c_void, root: u32, data: *mut c_void, count: u64) -> i32 {
    // SAFETY: group.h: it has so many bytes.
    unsafe { called(user, |ranks| ranks.broadcast(root, slice(data, count))) }
}

unsafe extern "C" fn barrier(user: *mut c_void) -> i32 {
    // SAFETY: as above.
    unsafe { called(user, |ranks| ranks.barrier()) }
}

unsafe extern "C" fn sum(user: *mut c_void, values: *mut f32, count: u64) -> i32 {
    // SAFETY: group.h: so many numbers.
    unsafe { called(user, |ranks| ranks.sum(slice(values.cast(), count))) }
}

unsafe extern "C" fn describe(user: *mut c_void, _: i32) -> *const c_char {
    // SAFETY: as above; the text lives until the next call.
    unsafe { (*user.cast::<State>()).text.as_ptr() }
}
