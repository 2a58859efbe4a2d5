//! Texts, paths and buffers that cross the border to C.

use crate::error::{check, Error, Result};
use crate::load::loaded;
use crate::log::held;
use crate::values::{Camera, Code};
use splat_sys as sys;
use std::alloc::{alloc_zeroed, Layout};
use std::ffi::{CStr, CString};
use std::os::raw::{c_char, c_void};
use std::path::Path;

/// Bytes of the first try of a call that writes text.
const FIRST_CAPACITY: usize = 1024;

/// Types of which zero is a value, and that own nothing.
///
/// # Safety
/// Bytes of 0 are a value of the type.
pub unsafe trait Plain: Copy {}

macro_rules! plain {
    ($($kind:ty),*) => {
        // SAFETY: numbers, and structs of C of numbers and pointers.
        $(unsafe impl Plain for $kind {})*
    };
}
plain!(u8, u16, i32, u32, f32, f64, Camera, sys::splat_picture_info, sys::splat_port);

/// Zeros that a call fills, as many as the product of `sizes`. Memory that is not written is not
/// used.
/// # Errors
/// More than there is memory for, naming `argument`.
pub(crate) fn zeros<T: Plain>(argument: &str, sizes: &[usize]) -> Result<Vec<T>> {
    let length = sizes.iter().try_fold(1_usize, |all, &size| all.checked_mul(size));
    let layout = length.and_then(|length| Layout::array::<T>(length).ok());
    let refuse = || {
        let words: Vec<String> = sizes.iter().map(usize::to_string).collect();
        let bytes = std::mem::size_of::<T>();
        Error::new(
            Code::OutOfHostMemory,
            format!(
                "{argument}: no memory for {} values of {bytes} bytes; expected less",
                words.join(" x ")
            ),
        )
    };
    let (length, layout) = length.zip(layout).ok_or_else(refuse)?;
    if layout.size() == 0 {
        return Ok(Vec::new());
    }
    // SAFETY: the layout is that of an array that is not empty.
    let pointer = unsafe { alloc_zeroed(layout) };
    if pointer.is_null() {
        return Err(refuse());
    }
    // SAFETY: from the same allocator, with this layout; bytes of 0 are values.
    Ok(unsafe { Vec::from_raw_parts(pointer.cast(), length, length) })
}

/// A text of C that the caller knows to be alive; bytes that are not UTF-8 end it.
///
/// # Safety
/// `text` is NULL or points to a text that lives as long as the result is used.
pub(crate) unsafe fn borrowed<'a>(text: *const c_char) -> &'a str {
    if text.is_null() {
        return "";
    }
    // SAFETY: by the caller.
    let bytes = unsafe { CStr::from_ptr(text) }.to_bytes();
    let valid = match std::str::from_utf8(bytes) {
        Ok(text) => return text,
        Err(error) => error.valid_up_to(),
    };
    std::str::from_utf8(&bytes[..valid]).unwrap_or("")
}

/// Copy a text that the library has just written into a struct; NULL gives an empty one.
pub(crate) fn copied(text: *const c_char) -> String {
    // SAFETY: called before the next call that may end the text's life.
    unsafe { borrowed(text) }.to_owned()
}

/// Copy a text that the library has just written; NULL gives none.
pub(crate) fn optional(text: *const c_char) -> Option<String> {
    if text.is_null() {
        None
    } else {
        Some(copied(text))
    }
}

/// Copy a NUL-terminated text in an array.
pub(crate) fn chars(array: &[c_char]) -> String {
    let bytes: Vec<u8> = array.iter().take_while(|&&c| c != 0).map(|&c| c as u8).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A text for C.
/// # Errors
/// A NUL within, naming `argument`.
pub(crate) fn c_text(argument: &str, text: &str) -> Result<CString> {
    CString::new(text).map_err(|error| Error::nul(argument, error))
}

/// A path for C, which takes UTF-8.
/// # Errors
/// Other paths, naming them.
pub(crate) fn c_path(argument: &str, path: &Path) -> Result<CString> {
    match path.to_str() {
        Some(text) => c_text(argument, text),
        None => Err(Error::argument(format!(
            "{argument}: the path {} is not UTF-8; rename it",
            path.display()
        ))),
    }
}

/// Paths for C that may be missing.
pub(crate) fn c_optional_path(argument: &str, path: Option<&Path>) -> Result<Option<CString>> {
    path.map(|path| c_path(argument, path)).transpose()
}

/// Texts for C that may be missing.
pub(crate) fn c_optional(argument: &str, text: Option<&str>) -> Result<Option<CString>> {
    text.map(|text| c_text(argument, text)).transpose()
}

/// A list of texts for C, and pointers to them.
pub(crate) struct Texts {
    _owned: Vec<CString>,
    pointers: Vec<*const c_char>,
}

impl Texts {
    pub(crate) fn new(argument: &str, texts: &[&str]) -> Result<Self> {
        let owned =
            texts.iter().map(|text| c_text(argument, text)).collect::<Result<Vec<CString>>>()?;
        let pointers = owned.iter().map(|text| text.as_ptr()).collect();
        Ok(Texts { _owned: owned, pointers })
    }

    pub(crate) fn as_ptr(&self) -> *const *const c_char {
        self.pointers.as_ptr()
    }

    pub(crate) fn len(&self) -> usize {
        self.pointers.len()
    }
}

pub(crate) fn pointer(text: &Option<CString>) -> *const c_char {
    text.as_ref().map_or(std::ptr::null(), |text| text.as_ptr())
}

/// A text that a call writes; it is called again with the size that it asks for.
pub(crate) fn text(
    mut call: impl FnMut(*mut c_char, usize, *mut usize) -> sys::splat_result,
) -> Result<String> {
    let mut bytes =
        grown(FIRST_CAPACITY, |pointer, capacity, needed| call(pointer.cast(), capacity, needed))?;
    bytes.pop(); // the NUL
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Bytes that a call writes; it is asked for their number first.
pub(crate) fn bytes(
    call: impl FnMut(*mut c_void, usize, *mut usize) -> sys::splat_result,
) -> Result<Vec<u8>> {
    grown(0, call)
}

fn grown(
    first: usize,
    mut call: impl FnMut(*mut c_void, usize, *mut usize) -> sys::splat_result,
) -> Result<Vec<u8>> {
    held(|| {
        loaded()?;
        let mut buffer: Vec<u8> = zeros("buffer", &[first])?;
        loop {
            let mut needed = 0;
            let result = call(buffer.as_mut_ptr().cast(), buffer.len(), &mut needed);
            if result == sys::SPLAT_INCOMPLETE && needed > buffer.len() {
                buffer = zeros("buffer", &[needed])?;
                continue;
            }
            check(result)?;
            buffer.truncate(needed);
            return Ok(buffer);
        }
    })
}

/// Structs that a call writes, with a count of 32 bits; it is asked for their number first.
pub(crate) fn items<T: Plain>(
    mut call: impl FnMut(*mut T, u32, *mut u32) -> sys::splat_result,
) -> Result<Vec<T>> {
    held(|| {
        loaded()?;
        let mut items: Vec<T> = Vec::new();
        loop {
            let mut count = 0;
            let result = call(items.as_mut_ptr(), items.len() as u32, &mut count);
            if result == sys::SPLAT_INCOMPLETE && count as usize > items.len() {
                items = zeros("items", &[count as usize])?;
                continue;
            }
            check(result)?;
            items.truncate(count as usize);
            return Ok(items);
        }
    })
}

/// A length for C.
/// # Errors
/// More than 32 bits, naming `argument`.
pub(crate) fn count(argument: &str, length: usize) -> Result<u32> {
    u32::try_from(length).map_err(|_| {
        Error::argument(format!("{argument}: {length} items, expected at most {}", u32::MAX))
    })
}

/// Pointer and length of an optional array.
/// # Errors
/// An empty one, whose length of 0 would tell the
/// library to trust the pointer.
pub(crate) fn array<T>(argument: &str, slice: Option<&[T]>) -> Result<(*const T, u64)> {
    match slice {
        None => Ok((std::ptr::null(), 0)),
        Some([]) => Err(empty(argument)),
        Some(slice) => Ok((slice.as_ptr(), slice.len() as u64)),
    }
}

/// The same for an array that the library fills.
pub(crate) fn array_mut<T>(argument: &str, slice: Option<&mut [T]>) -> Result<(*mut T, u64)> {
    match slice {
        None => Ok((std::ptr::null_mut(), 0)),
        Some([]) => Err(empty(argument)),
        Some(slice) => Ok((slice.as_mut_ptr(), slice.len() as u64)),
    }
}

fn empty(argument: &str) -> Error {
    Error::argument(format!("{argument}: the slice is empty; pass None for no array"))
}
