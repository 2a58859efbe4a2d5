//! Errors of the library, and of arguments that this crate refuses itself.

use crate::text::borrowed;
use crate::values::Code;
use splat_sys as sys;
use std::fmt;

/// What failed: a code, and a sentence that says where, what was expected, what was got and what to
/// do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    code: Code,
    message: String,
}

/// The result of every call that can fail.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    pub(crate) fn new(code: Code, message: impl Into<String>) -> Self {
        Error {
            code,
            message: message.into(),
        }
    }

    pub(crate) fn argument(message: impl Into<String>) -> Self {
        Error::new(Code::InvalidArgument, message)
    }

    /// What kind of error it is.
    pub fn code(&self) -> Code {
        self.code
    }

    /// The library's sentence.
    pub fn message(&self) -> &str {
        &self.message
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.code.name(), self.message)
    }
}

impl std::error::Error for Error {}

impl Code {
    /// The name of C, such as `SPLAT_ERROR_TIMEOUT`.
    pub fn name(self) -> String {
        // SAFETY: returns a text that lives as long as the library.
        unsafe { borrowed(sys::splat_result_name(self.to_raw())) }.to_owned()
    }

    /// One sentence: what the code means and what to do.
    pub fn sentence(self) -> String {
        // SAFETY: returns a text that lives as long as the library.
        unsafe { borrowed(sys::splat_result_sentence(self.to_raw())) }.to_owned()
    }
}

/// Turn a result of C into one of Rust.
pub(crate) fn check(result: sys::splat_result) -> Result<()> {
    if result == sys::SPLAT_OK {
        return Ok(());
    }
    let message = if result < 0 {
        // SAFETY: the text is copied before the next call of this thread.
        unsafe { borrowed(sys::splat_last_error_message()) }.to_owned()
    } else {
        Code::from_raw(result).sentence()
    };
    Err(Error::new(Code::from_raw(result), message))
}

/// Call a function of C after the check of the library's version, and turn its result into one of
/// Rust.
macro_rules! call {
    ($function:ident($($argument:expr),* $(,)?)) => {
        match crate::load::loaded() {
            Ok(()) => {
                // SAFETY: the caller passes pointers that live through the call, with their lengths.
                crate::log::held(|| crate::error::check(unsafe { splat_sys::$function($($argument),*) }))
            }
            Err(error) => Err(error),
        }
    };
}
pub(crate) use call;
