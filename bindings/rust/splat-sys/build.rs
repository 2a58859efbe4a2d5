//! Finds libsplat.so, for Windows the import library of splat.dll: in SPLAT_LIB_DIR, or by pkg-config.

use std::path::{Path, PathBuf};
use std::process::Command;

/// What is linked; for Windows the import library of the compiler's kind.
fn libraries() -> &'static [&'static str] {
    match std::env::var("CARGO_CFG_TARGET_ENV").as_deref() {
        Ok("gnu") if for_windows() => &["splat.dll.a", "libsplat.dll.a"],
        _ if for_windows() => &["splat.lib"],
        _ => &["libsplat.so", "libsplat.dylib"],
    }
}

fn for_windows() -> bool {
    std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("windows")
}

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    for name in [
        "SPLAT_LIB_DIR",
        "PKG_CONFIG",
        "PKG_CONFIG_PATH",
        "PKG_CONFIG_LIBDIR",
        "PKG_CONFIG_SYSROOT_DIR",
        "DOCS_RS",
    ] {
        println!("cargo:rerun-if-env-changed={name}");
    }
    if std::env::var_os("DOCS_RS").is_some() {
        return; // documentation needs no library
    }
    println!("cargo:rustc-link-lib=dylib=splat");
    match std::env::var("SPLAT_LIB_DIR") {
        Ok(folder) if !folder.is_empty() => from_folder(&folder),
        _ => from_pkg_config(),
    }
}

/// Use a folder, such as that of a build, and let programs find the library there at run time.
/// Crates that depend on `splat` add the run path by `DEP_SPLAT_RS_RUN_PATH`.
fn from_folder(folder: &str) {
    if !Path::new(folder).is_absolute() {
        fail(&format!(
            "SPLAT_LIB_DIR={folder} is relative, and cargo builds crates in other folders: give the \
             whole path, or in .cargo/config.toml set relative = true"
        ));
    }
    let library =
        libraries().iter().map(|name| Path::new(folder).join(name)).find(|path| path.exists());
    let library = match library {
        Some(library) => library,
        None => fail(&format!("there is no {} in SPLAT_LIB_DIR={folder}", libraries()[0])),
    };
    println!("cargo:rerun-if-changed={}", library.display());
    // The file is libsplat.so.1.2.3; without a version in its name the first call checks it.
    let file = library.canonicalize().unwrap_or_default();
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    if let Some((_, version)) = name.split_once(".so.") {
        check_version(version);
    }
    search(folder);
    if for_windows() {
        return; // which has no run path: splat.dll lies beside the program, or in PATH
    }
    for argument in ["-Xlinker", "-rpath", "-Xlinker", folder] {
        println!("cargo:rustc-link-arg={argument}");
    }
    println!("cargo:run_path={folder}");
}

/// Use the folders that `pkg-config --libs splat` names.
fn from_pkg_config() {
    check_version(pkg_config("--modversion").trim());
    for flag in split(&pkg_config("--libs-only-L")) {
        if let Some(folder) = flag.strip_prefix("-L") {
            search(folder);
        }
    }
}

fn pkg_config(option: &str) -> String {
    let program = std::env::var("PKG_CONFIG").unwrap_or_else(|_| "pkg-config".into());
    match Command::new(&program).args([option, "splat"]).output() {
        Ok(output) if output.status.success() => {
            String::from_utf8_lossy(&output.stdout).into_owned()
        }
        Ok(output) => fail(String::from_utf8_lossy(&output.stderr).trim()),
        Err(error) => fail(&format!("cannot run {program}: {error}")),
    }
}

/// Words between spaces; pkg-config puts a backslash before a space within one.
fn split(text: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut letters = text.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '\\' => words.last_mut().unwrap().extend(letters.next()),
            space if space.is_whitespace() => words.push(String::new()),
            letter => words.last_mut().unwrap().push(letter),
        }
    }
    words
}

/// Link with a folder's library. `cargo run` and `cargo test` look in build folders only, so these
/// get links to it, or copies of splat.dll, which is installed in bin.
fn search(folder: &str) {
    println!("cargo:rustc-link-search=native={folder}");
    let out = match std::env::var_os("OUT_DIR") {
        Some(out) => PathBuf::from(out),
        None => return,
    };
    let start = if for_windows() { "splat.dll" } else { "libsplat.so" };
    for place in [Path::new(folder).to_path_buf(), Path::new(folder).join("../bin")] {
        for file in std::fs::read_dir(place).into_iter().flatten().flatten() {
            if file.file_name().to_string_lossy().starts_with(start) {
                put(&file.path(), &out.join(file.file_name()));
            }
        }
    }
    println!("cargo:rustc-link-search=native={}", out.display());
}

#[cfg(unix)]
fn put(library: &Path, link: &Path) {
    std::fs::remove_file(link).ok();
    std::os::unix::fs::symlink(library, link).ok();
}

#[cfg(not(unix))]
fn put(library: &Path, copy: &Path) {
    std::fs::copy(library, copy).ok();
}

/// Refuse a library of another version: the rule of the crate `splat` at run time.
fn check_version(library: &str) {
    let own = env!("CARGO_PKG_VERSION");
    let numbers = |text: &str| -> Vec<u32> { text.split('.').flat_map(str::parse).collect() };
    let (found, needed) = (numbers(library), numbers(own));
    let same = if needed[0] == 0 { 2 } else { 1 };
    if found.len() == 3 && (found[..same] != needed[..same] || found < needed) {
        fail(&format!(
            "it is version {library}, and this crate is for {own}: install that version"
        ));
    }
}

fn fail(reason: &str) -> ! {
    eprintln!("libsplat was not found: {reason}");
    eprintln!("Install libsplat and set PKG_CONFIG_PATH to the folder of its splat.pc,");
    eprintln!("or set SPLAT_LIB_DIR to the folder of libsplat.so.");
    std::process::exit(1);
}
