//! Types around the numbers, flags and structs of C, which values.rs lists.

use crate::values::WORDS;
use std::fmt;

/// A struct around the number of an enum: the library may know numbers that this version does not.
macro_rules! number {
    ($(#[$doc:meta])* $name:ident {
        $($(#[$each:meta])* $short:ident = $raw:ident,)*
    }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(pub i32);

        impl $name {
            $($(#[$each])* pub const $short: $name = $name(sys::$raw);)*

            pub(crate) const NAMES: Names = &[
                $((stringify!($short), stringify!($raw), sys::$raw as i64)),*
            ];
        }

        impl std::fmt::Debug for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                let number = i64::from(self.0);
                match Self::NAMES.iter().find(|(_, _, value)| *value == number) {
                    Some((short, _, _)) => write!(f, "{}::{short}", stringify!($name)),
                    None if number == 0 => write!(f, "{}::default()", stringify!($name)),
                    None => write!(f, "{}({number})", stringify!($name)),
                }
            }
        }
    };
}
pub(crate) use number;

/// A struct around bits, with the operators of the crate bitflags.
macro_rules! flags {
    ($(#[$doc:meta])* $name:ident {
        $($(#[$each:meta])* $short:ident = $raw:ident,)*
    }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(pub u32);

        impl $name {
            $($(#[$each])* pub const $short: $name = $name(sys::$raw);)*

            pub(crate) const NAMES: Names = &[
                $((stringify!($short), stringify!($raw), sys::$raw as i64)),*
            ];

            /// No bit.
            #[must_use]
            pub const fn empty() -> Self {
                $name(0)
            }

            /// All bits that this version knows.
            #[must_use]
            pub const fn all() -> Self {
                $name(0 $(| sys::$raw)*)
            }

            /// True if no bit is set.
            #[must_use]
            pub const fn is_empty(self) -> bool {
                self.0 == 0
            }

            /// True if all bits of `other` are set.
            #[must_use]
            pub const fn contains(self, other: Self) -> bool {
                self.0 & other.0 == other.0
            }
        }

        impl std::ops::BitOr for $name {
            type Output = Self;

            fn bitor(self, other: Self) -> Self {
                $name(self.0 | other.0)
            }
        }

        impl std::ops::BitOrAssign for $name {
            fn bitor_assign(&mut self, other: Self) {
                self.0 |= other.0;
            }
        }

        impl std::ops::BitAnd for $name {
            type Output = Self;

            fn bitand(self, other: Self) -> Self {
                $name(self.0 & other.0)
            }
        }

        impl std::ops::BitAndAssign for $name {
            fn bitand_assign(&mut self, other: Self) {
                self.0 &= other.0;
            }
        }

        /// The bits of [`Self::all`] that are not set.
        impl std::ops::Not for $name {
            type Output = Self;

            fn not(self) -> Self {
                $name(!self.0 & Self::all().0)
            }
        }

        impl std::fmt::Debug for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                crate::numbers::bits(f, stringify!($name), self.0, Self::NAMES)
            }
        }
    };
}
pub(crate) use flags;

/// The codes of results: an enum with a place for all other numbers.
macro_rules! codes {
    ($($(#[$each:meta])* $name:ident = $raw:ident,)*) => {
        /// What a result code says.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum Code {
            $($(#[$each])* $name,)*
            /// A number that this version does not know. Only [`Code::from_raw`] makes one.
            Other(UnknownCode),
        }

        impl Code {
            pub(crate) const NAMES: Names = &[
                $((stringify!($name), stringify!($raw), sys::$raw as i64)),*
            ];

            /// The code of a number of C.
            #[must_use]
            pub fn from_raw(code: i32) -> Self {
                match code {
                    $(sys::$raw => Code::$name,)*
                    other => Code::Other(UnknownCode(other)),
                }
            }

            /// The number of C.
            #[must_use]
            pub fn to_raw(self) -> i32 {
                match self {
                    $(Code::$name => sys::$raw,)*
                    Code::Other(other) => other.0,
                }
            }
        }
    };
}
pub(crate) use codes;

/// A struct that the library fills and this crate copies, while its texts live.
macro_rules! output {
    ($(#[$doc:meta])* $name:ident = $raw:ident($from:ident) {
        $($(#[$each:meta])* $field:ident: $kind:ty = $value:expr,)*
    }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq)]
        #[non_exhaustive]
        pub struct $name {
            $($(#[$each])* pub $field: $kind,)*
        }

        impl $name {
            pub(crate) fn from_raw($from: &sys::$raw) -> Self {
                $name { $($field: $value,)* }
            }
        }
    };
}
pub(crate) use output;

/// A struct that the library reads.
macro_rules! input {
    ($(#[$doc:meta])* $name:ident($from:ident) = $raw:ident {
        $($(#[$each:meta])* $field:ident: $kind:ty = $value:expr,)*
    }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct $name {
            $($(#[$each])* pub $field: $kind,)*
        }

        impl $name {
            pub(crate) fn to_raw(&self) -> sys::$raw {
                let $from = self;
                sys::$raw { $($field: $value,)* ..Default::default() }
            }
        }
    };
}
pub(crate) use input;

/// Names here, names in C, and numbers.
pub(crate) type Names = &'static [(&'static str, &'static str, i64)];

/// A number of C that is no [`Code`](crate::Code) of this version.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct UnknownCode(pub(crate) i32);

/// Debug text of bits with names.
pub(crate) fn bits(f: &mut fmt::Formatter<'_>, kind: &str, bits: u32, names: Names) -> fmt::Result {
    let mut rest = bits;
    let mut words: Vec<String> = Vec::new();
    for &(name, _, bit) in names {
        if bit != 0 && i64::from(bits) & bit == bit {
            rest &= !(bit as u32);
            words.push(name.to_owned());
        }
    }
    if rest != 0 {
        words.push(format!("{rest:#x}"));
    }
    if words.is_empty() {
        words.push("empty".to_owned());
    }
    write!(f, "{kind}({})", words.join(" | "))
}

/// A sentence of the library with the names of this crate: `SPLAT_DTYPE_F32` is `Dtype::F32`,
/// `splat_tensor_map` is `Tensor::map`, and a count of C is the length of a slice. What is quoted
/// stays.
pub(crate) fn translated(text: &str) -> String {
    let text = match text.strip_prefix("bytes is ") {
        Some(rest) => format!("the slice's size in bytes is {rest}"),
        None => text.to_owned(),
    };
    let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut result = String::with_capacity(text.len());
    let (mut rest, mut quoted) = (&text[..], false);
    while let Some(first) = rest.chars().next() {
        let length = rest.find(|c| !word(c)).unwrap_or(rest.len());
        if length != 0 {
            let (token, after) = rest.split_at(length);
            let of_c = token == "NULL" || token.to_ascii_lowercase().starts_with("splat_");
            let in_path = result.ends_with('/') || of_c && result.ends_with('.');
            let known = if quoted || in_path { None } else { name(token) };
            let star = known.is_some() && token.ends_with('_') && after.starts_with('*');
            result += known.as_deref().unwrap_or(token);
            rest = &after[usize::from(star)..];
            continue;
        }
        if first == '\'' {
            // An apostrophe stands between letters; a text of the caller does not.
            let ends = !rest[1..].starts_with(word);
            quoted = if quoted {
                !ends
            } else {
                !result.ends_with(word)
            };
        }
        result.push(first);
        rest = &rest[first.len_utf8()..];
    }
    result
}

/// The name of this crate for one of C. Structs have its name in camel case.
fn name(token: &str) -> Option<String> {
    if let Ok(place) = WORDS.binary_search_by_key(&token, |&(name, _)| name) {
        return Some(WORDS[place].1.to_owned());
    }
    splat_sys::STRUCTS.iter().find(|each| each.0 == token)?;
    let camel = |word: &str| word[..1].to_uppercase() + &word[1..];
    Some(token.split('_').skip(1).map(camel).collect())
}

#[cfg(test)]
mod tests {
    use super::translated;

    /// Writes the words of Rust for the sentences in a file; bindings/smoke/sentences.py judges.
    #[test]
    fn sentences_of_a_file() -> std::io::Result<()> {
        let file = std::env::var("SPLAT_SENTENCES").unwrap_or_else(|_| "/dev/null".into());
        for line in std::fs::read_to_string(file)?.lines() {
            println!("> {}", translated(line));
        }
        Ok(())
    }

    #[test]
    fn sentences_have_the_names_of_this_crate() {
        for (c, rust) in [
            ("call splat_tensor_unmap first", "call Mapping::unmap first"),
            (
                "made without SPLAT_RASTERIZER_DEPTH",
                "made without RasterizerFlags::DEPTH",
            ),
            (
                "cannot open 'it's splat_scene.ply' or /tmp/splat_run/NULL: splat__x of splat_no_such",
                "cannot open 'it's splat_scene.ply' or /tmp/splat_run/NULL: splat__x of splat_no_such",
            ),
            ("arrays[0].value_count is 3", "arrays[0].values.len() is 3"),
            (
                "bytes is 4, but 'x' takes 8",
                "the slice's size in bytes is 4, but 'x' takes 8",
            ),
            (
                "splat_model_input.images is NULL",
                "ModelInput.images is None",
            ),
            (
                "what is 7, expected SPLAT_EXPORT_*",
                "what is 7, expected Export",
            ),
            ("expected a SPLAT_PIXEL_ type", "expected a Pixel type"),
            (
                "SPLAT_DTYPE_F32 of splat_model_forward",
                "Dtype::F32 of Model::forward",
            ),
            (
                "splat_device_cancel cancelled the call",
                "Device::cancel cancelled the call",
            ),
            (
                "the device's 'splat_scene_desc' of NULL",
                "the device's 'splat_scene_desc' of None",
            ),
            ("set SPLAT_TIMEOUT_SCALE", "set SPLAT_TIMEOUT_SCALE"),
            ("SceneFileDesc.max_count", "SceneFileDesc.max_count"),
        ] {
            assert_eq!(translated(c), rust);
        }
    }
}
