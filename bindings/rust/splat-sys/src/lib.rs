//! Declarations of libsplat's C API, as its headers have them. The package `libsplat` makes them safe.
//!
//! Structs have a `Default` that is zero with `struct_size` set, which is valid in every call.
//! Enums are integers: the library may return a number that this version does not know.
#![allow(non_camel_case_types)]

#[rustfmt::skip]
mod sys;
pub use sys::*;
