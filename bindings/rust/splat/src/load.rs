//! The loaded library: its check against the header that this crate was made from, and what it may
//! spend on files.

use crate::error::{call, Error, Result};
use crate::text::borrowed;
use crate::values::Code;
use splat_sys as sys;
use std::sync::atomic::{AtomicBool, Ordering};

static CHECKED: AtomicBool = AtomicBool::new(false);

/// Check version and layout before the first call; later ones cost one load.
pub(crate) fn loaded() -> Result<()> {
    if CHECKED.load(Ordering::Acquire) {
        return Ok(());
    }
    // SAFETY: both take no arguments; the text lives as long as the library.
    let (version, info) = unsafe { (sys::splat_version(), borrowed(sys::splat_build_info())) };
    verify(version, info)?;
    CHECKED.store(true, Ordering::Release);
    Ok(())
}

/// Check that the loaded library fits this crate: its version, which [`version`] gives, and the sizes
/// of its structs. Every other call makes the same check once.
/// # Errors
/// [`Code::Unsupported`], naming both versions.
pub fn check_library() -> Result<()> {
    loaded()
}

/// The version of the loaded library: major, minor, patch.
#[must_use]
pub fn version() -> [u32; 3] {
    // SAFETY: takes no arguments.
    unpack(unsafe { sys::splat_version() })
}

/// The version of the loaded library as text.
#[must_use]
pub fn version_string() -> String {
    // SAFETY: takes no arguments; the text lives as long as the library.
    unsafe { borrowed(sys::splat_version_string()) }.to_owned()
}

/// JSON object on the build: version, compiler, assertions, fault_points, shaders, structs.
#[must_use]
pub fn build_info() -> String {
    // SAFETY: takes no arguments; the text lives as long as the library.
    unsafe { borrowed(sys::splat_build_info()) }.to_owned()
}

/// What a file may cost when it is read, by this process and whatever reads it: a small file can ask
/// for all memory or for hours. 0 is the default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct DecodeLimits {
    /// Bytes of memory for each byte of the file; 0: 64.
    pub bytes_times_file: u64,
    /// Bytes on top of that; 0: 64 MiB.
    pub bytes_besides: u64,
    /// Tensors or files of an archive; 0: 10^6.
    pub items: u64,
    /// Scans of one JPEG; 0: 100.
    pub jpeg_scans: u32,
}

/// Replace the limits of this process (`splat_decode_set_limits`). Calls that read a file then take
/// the new ones; a file beyond them is [`Code::Format`]. `&Default::default()` restores the defaults.
///
/// ```
/// let limits = splat::DecodeLimits { jpeg_scans: 10, ..Default::default() };
/// splat::set_decode_limits(&limits)?;
/// splat::set_decode_limits(&Default::default())?;
/// # Ok::<(), splat::Error>(())
/// ```
/// # Errors
/// `InvalidArgument` (a field of limits).
pub fn set_decode_limits(limits: &DecodeLimits) -> Result<()> {
    let raw = sys::splat_decode_limits {
        bytes_times_file: limits.bytes_times_file,
        bytes_besides: limits.bytes_besides,
        items: limits.items,
        jpeg_scans: limits.jpeg_scans,
        ..Default::default()
    };
    call!(splat_decode_set_limits(&raw))
}

fn unpack(version: u32) -> [u32; 3] {
    [version >> 22, version >> 12 & 0x3ff, version & 0xfff]
}

fn dotted(version: [u32; 3]) -> String {
    format!("{}.{}.{}", version[0], version[1], version[2])
}

/// The library may be newer, within a major version and before 1.0 a minor one: structs then may have
/// grown at the end, except frozen ones.
fn verify(version: u32, build_info: &str) -> Result<()> {
    let (library, crates) = (unpack(version), sys::SPLAT_VERSION);
    let refuse = |reason: String| {
        Err(Error::new(
            Code::Unsupported,
            format!(
                "the loaded libsplat is version {}, but this crate was made for {}: {reason}; \
                 install the library of this crate's version, or build with the crate of the \
                 library's",
                dotted(library),
                dotted(crates)
            ),
        ))
    };
    if library[0] != crates[0] || (crates[0] == 0 && library[1] != crates[1]) {
        return refuse("these do not fit together".into());
    }
    if library < crates {
        return refuse("it is older".into());
    }
    for &(name, frozen, bytes) in sys::STRUCTS {
        match size_in(build_info, name) {
            Some(size) if size == bytes || (size > bytes && !frozen) => {}
            Some(size) => return refuse(format!("{name} has {size} bytes, here {bytes}")),
            None => return refuse(format!("the library does not know {name}")),
        }
    }
    Ok(())
}

/// The number of a struct's name in the object "structs" of splat_build_info.
fn size_in(build_info: &str, name: &str) -> Option<usize> {
    let sizes = &build_info[build_info.find("\"structs\"")?..];
    let key = format!("\"{name}\":");
    let rest = sizes[sizes.find(&key)? + key.len()..].trim_start();
    let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    rest[..digits].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packed(version: [u32; 3]) -> u32 {
        version[0] << 22 | version[1] << 12 | version[2]
    }

    fn info(change: impl Fn(&str, usize) -> usize) -> String {
        let sizes: Vec<String> = sys::STRUCTS
            .iter()
            .map(|&(name, _, bytes)| format!("\"{name}\": {}", change(name, bytes)))
            .collect();
        format!("{{\"version\": \"x\", \"structs\": {{{}}}}}", sizes.join(", "))
    }

    #[test]
    fn the_loaded_library_fits() {
        loaded().unwrap();
    }

    #[test]
    fn another_version_is_refused_with_both() {
        let [major, minor, patch] = sys::SPLAT_VERSION;
        let info = info(|_, bytes| bytes);
        let error = verify(packed([major + 1, 0, 0]), &info).unwrap_err();
        assert_eq!(error.code(), Code::Unsupported);
        assert!(error.message().contains(&dotted([major + 1, 0, 0])), "{error}");
        assert!(error.message().contains(&dotted(sys::SPLAT_VERSION)), "{error}");
        assert!(verify(packed([major, minor - 1, patch]), &info).is_err());
        let next_minor = verify(packed([major, minor + 1, 0]), &info);
        assert_eq!(next_minor.is_err(), major == 0);
        verify(packed([major, minor, patch + 1]), &info).unwrap();
    }

    #[test]
    fn another_layout_is_refused() {
        let version = packed(sys::SPLAT_VERSION);
        let grow = |which: &'static str, by: isize| {
            info(
                move |name, bytes| {
                    if name == which {
                        (bytes as isize + by) as usize
                    } else {
                        bytes
                    }
                },
            )
        };
        verify(version, &grow("splat_device_desc", 8)).unwrap();
        assert!(verify(version, &grow("splat_device_desc", -8)).is_err());
        let error = verify(version, &grow("splat_camera", 8)).unwrap_err();
        assert!(error.message().contains("splat_camera"), "{error}");
        assert!(verify(version, "{\"version\": \"0.1.0\"}").is_err());
    }
}
