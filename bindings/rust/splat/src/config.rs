//! Configurations of networks and training.

use crate::error::Result;
use crate::text::{c_optional, pointer, text, Texts};
use splat_sys as sys;

/// JSON array of all keys of a configuration: key, type, range, default, origin, about.
/// # Errors
/// Another version of the library.
pub fn keys() -> Result<String> {
    // SAFETY: the buffer lives through the call.
    text(|buffer, capacity, needed| unsafe { sys::splat_config_keys(buffer, capacity, needed) })
}

/// JSON array of the configurations of published models: name, about.
/// # Errors
/// Another version of the library.
pub fn presets() -> Result<String> {
    // SAFETY: the buffer lives through the call.
    text(|buffer, capacity, needed| unsafe { sys::splat_config_presets(buffer, capacity, needed) })
}

/// The text of one of them, YAML, for [`merge`].
/// # Errors
/// `InvalidArgument` (no such name).
pub fn preset(name: &str) -> Result<String> {
    let name = c_optional("name", Some(name))?;
    // SAFETY: name and buffer live through the call.
    text(|buffer, capacity, needed| unsafe {
        sys::splat_config_preset(pointer(&name), buffer, capacity, needed)
    })
}

/// JSON: warnings on what a training of a configuration would leave out. Arguments and errors as
/// [`merge`].
/// # Errors
/// `InvalidArgument` (an unknown key, with the nearest known one).
pub fn check(config: Option<&str>, values: &[&str]) -> Result<String> {
    let config = c_optional("config", config)?;
    let values = Texts::new("values", values)?;
    // SAFETY: texts and buffer live through the call.
    text(|buffer, capacity, needed| unsafe {
        let (config, list) = (pointer(&config), values.as_ptr());
        sys::splat_config_check(config, list, values.len(), buffer, capacity, needed)
    })
}

/// Make a configuration with every value, as JSON, from a YAML or JSON text and changes to it.
///
/// `config`: None: the defaults. `values`: "key=value", such as "opt.base_lr=1e-4"; later ones win.
///
/// ```
/// use splat::prelude::*;
/// let config = splat::config::merge(None, &["opt.base_lr=1e-4"])?;
/// assert!(config.contains("base_lr"));
/// # Ok::<(), splat::Error>(())
/// ```
/// # Errors
/// `InvalidArgument`, an unknown key (with the nearest known one), a value outside its
/// range.
pub fn merge(config: Option<&str>, values: &[&str]) -> Result<String> {
    let config = c_optional("config", config)?;
    let values = Texts::new("values", values)?;
    // SAFETY: texts and buffer live through the call.
    text(|buffer, capacity, needed| unsafe {
        let (config, list) = (pointer(&config), values.as_ptr());
        sys::splat_config_merge(config, list, values.len(), buffer, capacity, needed)
    })
}
