//! Errors of the library, and of arguments that this crate refuses itself.

use crate::numbers::translated;
use crate::text::borrowed;
use crate::values::Code;
use splat_sys as sys;
use std::ffi::NulError;
use std::fmt;

/// What failed: a code, and a sentence that says where, what was expected, what was got and what to
/// do.
///
/// ```
/// let error = splat::Scene::load("none.ply", &Default::default()).unwrap_err();
/// assert_eq!(error.code(), splat::Code::NotFound);
/// assert!(error.to_string().starts_with("not found: "));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    code: Code,
    message: String,
    source: Option<NulError>,
}

/// The result of every call that can fail.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    pub(crate) fn new(code: Code, message: impl Into<String>) -> Self {
        Error { code, message: message.into(), source: None }
    }

    pub(crate) fn argument(message: impl Into<String>) -> Self {
        Error::new(Code::InvalidArgument, message)
    }

    /// A text with a NUL.
    pub(crate) fn nul(argument: &str, source: NulError) -> Self {
        let place = source.nul_position();
        Error {
            source: Some(source),
            ..Error::argument(format!("{argument}: the text has a NUL at byte {place}; remove it"))
        }
    }

    /// What kind of error it is.
    #[must_use]
    pub fn code(&self) -> Code {
        self.code
    }

    /// The library's sentence, with the names of this crate.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.message
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.code, self.message)
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.source.as_ref().map(|source| source as _)
    }
}

impl Code {
    /// The name of the code, such as `NotFound`.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.names().map_or("Other", |names| names.0)
    }

    /// The name in C, such as `SPLAT_ERROR_NOT_FOUND`.
    #[must_use]
    pub fn c_name(self) -> &'static str {
        self.names().map_or("SPLAT_UNKNOWN_RESULT", |names| names.1)
    }

    fn names(self) -> Option<&'static (&'static str, &'static str, i64)> {
        let code = i64::from(self.to_raw());
        Code::NAMES.iter().find(|(_, _, value)| *value == code)
    }

    /// One sentence: what the code means and what to do.
    #[must_use]
    pub fn sentence(self) -> String {
        // SAFETY: returns a text that lives as long as the library.
        translated(unsafe { borrowed(sys::splat_result_sentence(self.to_raw())) })
    }
}

/// The name in words: "not found".
impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Code::Other(_) = self {
            return write!(f, "unknown code {}", self.to_raw());
        }
        for (place, letter) in self.name().char_indices() {
            if place != 0 && letter.is_ascii_uppercase() {
                f.write_str(" ")?;
            }
            write!(f, "{}", letter.to_ascii_lowercase())?;
        }
        Ok(())
    }
}

/// Turn a result of C into one of Rust.
pub(crate) fn check(result: sys::splat_result) -> Result<()> {
    if result == sys::SPLAT_OK {
        return Ok(());
    }
    let message = if result < 0 {
        // SAFETY: the text is copied before the next call of this thread.
        translated(unsafe { borrowed(sys::splat_last_error_message()) })
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
