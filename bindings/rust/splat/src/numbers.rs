//! Types around the numbers, flags and structs of C, which values.rs lists.

use crate::values::WORDS;

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
                match Self::NAMES.iter().any(|(_, _, value)| *value == i64::from(self.0)) {
                    true => write!(f, "{}::{self}", stringify!($name)),
                    false if self.0 == 0 => write!(f, "{}::default()", stringify!($name)),
                    false => write!(f, "{}({self})", stringify!($name)),
                }
            }
        }

        crate::numbers::named!($name, false);
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

            /// The number of C.
            #[must_use]
            pub const fn bits(self) -> u32 {
                self.0
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

            /// Set the bits of `other` (`true`), or unset them.
            pub fn set(&mut self, other: Self, value: bool) {
                *self = if value { *self | other } else { *self - other };
            }

            /// Set the bits of `other`.
            pub fn insert(&mut self, other: Self) {
                *self |= other;
            }

            /// Unset the bits of `other`.
            pub fn remove(&mut self, other: Self) {
                *self -= other;
            }
        }

        crate::numbers::operators! { $name(a, b):
            BitOr bitor BitOrAssign bitor_assign = a | b,
            BitAnd bitand BitAndAssign bitand_assign = a & b,
            BitXor bitxor BitXorAssign bitxor_assign = a ^ b,
            Sub sub SubAssign sub_assign = a & !b,
        }

        /// The bits of [`Self::all`] that are not set.
        impl std::ops::Not for $name {
            type Output = Self;

            fn not(self) -> Self {
                $name(!self.0 & Self::all().0)
            }
        }

        #[cfg(feature = "bitflags")]
        impl bitflags::Flags for $name {
            const FLAGS: &'static [bitflags::Flag<Self>] =
                &[$(bitflags::Flag::new(stringify!($short), $name::$short)),*];
            type Bits = u32;

            fn bits(&self) -> u32 {
                self.0
            }

            fn from_bits_retain(bits: u32) -> Self {
                $name(bits)
            }
        }

        crate::numbers::named!($name, true);

        impl std::fmt::Debug for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                let words = if self.is_empty() { "empty".to_owned() } else { self.to_string() };
                write!(f, "{}({words})", stringify!($name))
            }
        }
    };
}
pub(crate) use flags;

/// Operators of two sets of flags, and their assignments.
macro_rules! operators {
    ($name:ident($a:ident, $b:ident):
     $($trait:ident $call:ident $assign:ident $assigned:ident = $value:expr,)*) => {
        $(
            impl std::ops::$trait for $name {
                type Output = Self;

                fn $call(self, other: Self) -> Self {
                    let ($a, $b) = (self.0, other.0);
                    $name($value)
                }
            }

            impl std::ops::$assign for $name {
                fn $assigned(&mut self, other: Self) {
                    *self = std::ops::$trait::$call(*self, other);
                }
            }
        )*
    };
}
pub(crate) use operators;

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
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[non_exhaustive]
        pub struct $name {
            $(
                $(#[$each])*
                #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::numbers::Field::read"))]
                pub $field: $kind,
            )*
        }

        #[cfg(feature = "serde")]
        impl crate::numbers::Field<'_> for $name {}

        impl $name {
            pub(crate) fn from_raw($from: &sys::$raw) -> Self {
                $name { $($field: $value,)* }
            }
        }
    };
}
pub(crate) use output;

/// How fields are read: JSON has null for numbers that are not finite, which become NaN.
#[cfg(feature = "serde")]
pub(crate) trait Field<'de>: serde::Deserialize<'de> {
    fn read<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        Self::deserialize(from)
    }
}

#[cfg(feature = "serde")]
macro_rules! fields {
    ($($plain:ty),*; $($with_nan:ty = $read:ty, $nan:expr;)*) => {
        $(impl Field<'_> for $plain {})*
        $(
            impl<'de> Field<'de> for $with_nan {
                fn read<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                    serde::Deserialize::deserialize(from).map($nan as fn($read) -> Self)
                }
            }
        )*
    };
}
#[cfg(feature = "serde")]
fields! {
    bool, u32, u64, String, Vec<i64>, [u8; 16];
    f32 = Option<f32>, |n| n.unwrap_or(f32::NAN);
    f64 = Option<f64>, |n| n.unwrap_or(f64::NAN);
    [f32; 3] = [Option<f32>; 3], |all| all.map(|n| n.unwrap_or(f32::NAN));
    [f64; 3] = [Option<f64>; 3], |all| all.map(|n| n.unwrap_or(f64::NAN));
    [f64; 4] = [Option<f64>; 4], |all| all.map(|n| n.unwrap_or(f64::NAN));
}

/// A struct that the library reads.
macro_rules! input {
    ($(#[$doc:meta])* $name:ident($from:ident) = $raw:ident {
        $($(#[$each:meta])* $field:ident: $kind:ty = $value:expr,)*
    }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
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

/// The text of a number: its name, or digits; flags are joined by "|". And the way back, also for the
/// crate serde.
macro_rules! named {
    ($name:ident, $flags:literal) => {
        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(&crate::numbers::words(i64::from(self.0), Self::NAMES, $flags))
            }
        }

        impl std::str::FromStr for $name {
            type Err = crate::Error;

            fn from_str(text: &str) -> crate::Result<Self> {
                let number = crate::numbers::number_of(text, Self::NAMES, $flags);
                number.and_then(|number| number.try_into().ok()).map($name).ok_or_else(|| {
                    let names: Vec<&str> = Self::NAMES.iter().map(|names| names.0).collect();
                    let (kind, names) = (stringify!($name), names.join(", "));
                    crate::Error::argument(format!("{kind}: '{text}', expected one of {names}"))
                })
            }
        }

        #[cfg(feature = "serde")]
        impl crate::numbers::Field<'_> for $name {}

        #[cfg(feature = "serde")]
        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, out: S) -> Result<S::Ok, S::Error> {
                out.collect_str(self)
            }
        }

        #[cfg(feature = "serde")]
        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                String::deserialize(from)?.parse().map_err(serde::de::Error::custom)
            }
        }
    };
}
pub(crate) use named;

pub(crate) fn words(number: i64, names: Names, flags: bool) -> String {
    let mut rest = number;
    let mut words: Vec<String> = Vec::new();
    for &(name, _, value) in names {
        if number == value || flags && value != 0 && number & value == value {
            rest &= !value;
            words.push(name.to_owned());
        }
    }
    if words.is_empty() && !flags || rest != 0 && flags {
        words.push(if flags { format!("{rest:#x}") } else { rest.to_string() });
    }
    words.join(" | ")
}

pub(crate) fn number_of(text: &str, names: Names, flags: bool) -> Option<i64> {
    let one =
        |word: &str| match (names.iter().find(|names| names.0 == word), word.strip_prefix("0x")) {
            (Some(&(_, _, value)), _) => Some(value),
            (None, Some(digits)) if flags => i64::from_str_radix(digits, 16).ok(),
            _ => word.parse().ok(),
        };
    if !flags {
        return one(text);
    }
    let words = text.split('|').map(str::trim).filter(|word| !word.is_empty());
    words.map(one).try_fold(0, |all, bit| Some(all | bit?))
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
            quoted = if quoted { !ends } else { !result.ends_with(word) };
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
