//! Finds libsplat.so: in SPLAT_LIB_DIR, or by pkg-config.

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-env-changed=SPLAT_LIB_DIR");
    println!("cargo:rerun-if-env-changed=PKG_CONFIG_PATH");
    println!("cargo:rerun-if-env-changed=PKG_CONFIG");
    println!("cargo:rustc-link-lib=dylib=splat");
    match std::env::var("SPLAT_LIB_DIR") {
        Ok(folder) if !folder.is_empty() => from_folder(&folder),
        _ => from_pkg_config(),
    }
}

/// Use a folder, such as that of a build, and let programs find the library there at run time.
/// Crates that depend on `splat` add the run path by `DEP_SPLAT_RUN_PATH`.
fn from_folder(folder: &str) {
    if !["libsplat.so", "libsplat.dylib", "splat.lib"]
        .iter()
        .any(|name| Path::new(folder).join(name).exists())
    {
        fail(&format!(
            "there is no libsplat.so in SPLAT_LIB_DIR={folder}"
        ));
    }
    println!("cargo:rustc-link-search=native={folder}");
    println!("cargo:rustc-link-arg=-Wl,-rpath,{folder}");
    println!("cargo:run_path={folder}");
}

/// Use the folders that `pkg-config --libs splat` names.
fn from_pkg_config() {
    let program = std::env::var("PKG_CONFIG").unwrap_or_else(|_| "pkg-config".into());
    let output = match Command::new(&program)
        .args(["--libs-only-L", "splat"])
        .output()
    {
        Ok(output) => output,
        Err(error) => fail(&format!("cannot run {program}: {error}")),
    };
    if !output.status.success() {
        fail(String::from_utf8_lossy(&output.stderr).trim());
    }
    for flag in String::from_utf8_lossy(&output.stdout).split_whitespace() {
        if let Some(folder) = flag.strip_prefix("-L") {
            println!("cargo:rustc-link-search=native={folder}");
        }
    }
}

fn fail(reason: &str) -> ! {
    eprintln!("libsplat was not found: {reason}");
    eprintln!("Install libsplat and set PKG_CONFIG_PATH to the folder of its splat.pc,");
    eprintln!("or set SPLAT_LIB_DIR to the folder of libsplat.so.");
    std::process::exit(1);
}
