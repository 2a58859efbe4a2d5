//! Finds libsplat.so, for Windows the import library of splat.dll: in SPLAT_LIB_DIR, or as a feature says: `bundled`
//! builds it by CMake, `system` asks pkg-config.

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
        "SPLAT_SOURCE_DIR",
        "PKG_CONFIG",
        "PKG_CONFIG_PATH",
        "PKG_CONFIG_LIBDIR",
        "PKG_CONFIG_SYSROOT_DIR",
        "DOCS_RS",
        "CMAKE",
        "CMAKE_TOOLCHAIN_FILE",
    ] {
        println!("cargo:rerun-if-env-changed={name}");
    }
    if std::env::var_os("DOCS_RS").is_some() {
        return; // documentation needs no library
    }
    println!("cargo:rustc-link-lib=dylib=splat");
    match std::env::var("SPLAT_LIB_DIR") {
        Ok(folder) if !folder.is_empty() => from_folder(&folder),
        _ if cfg!(feature = "bundled") => from_folder(&build()),
        _ if cfg!(feature = "system") => from_pkg_config(),
        _ => fail("neither the feature `system` nor `bundled` of libsplat is on"),
    }
}

/// Build the library by CMake and install it below OUT_DIR, with its weights. Returns the library's folder.
fn build() -> String {
    let out = PathBuf::from(variable("OUT_DIR"));
    let (build, prefix, sources) = (out.join("build"), out.join("prefix"), sources());
    for name in ["CMakeLists.txt", "cmake", "include", "shaders", "src", "tools"] {
        println!("cargo:rerun-if-changed={}", sources.join(name).display());
    }
    let (host, target) = (variable("HOST"), variable("TARGET"));
    if host != target && std::env::var_os("CMAKE_TOOLCHAIN_FILE").is_none() {
        fail(&format!(
            "`bundled` builds for {target} on {host} only with a toolchain of CMake: set CMAKE_TOOLCHAIN_FILE"
        ));
    }
    let mut configure = cmake();
    configure.arg("-S").arg(&sources).arg("-B").arg(&build).arg("-DCMAKE_INSTALL_LIBDIR=lib");
    configure.arg(format!("-DCMAKE_INSTALL_PREFIX={}", prefix.display()));
    configure.args([
        "-DCMAKE_BUILD_TYPE=Release",
        "-DCMAKE_UNITY_BUILD=ON",
        "-DCMAKE_UNITY_BUILD_BATCH_SIZE=0",
    ]);
    configure.args(["-DSPLAT_INSTALL=ON", "-DSPLAT_BUILD_TESTS=OFF", "-DSPLAT_BUILD_TOOLS=OFF"]);
    run(&mut configure);
    let jobs = std::env::var("NUM_JOBS").unwrap_or_else(|_| "1".into());
    run(cmake().arg("--build").arg(&build).args(["--config", "Release", "--parallel", &jobs]));
    run(cmake().arg("--install").arg(&build).args(["--config", "Release"]));
    prefix.join("lib").display().to_string()
}

/// The library's sources: of SPLAT_SOURCE_DIR, in this package, or around this crate in a checkout.
fn sources() -> PathBuf {
    let own = PathBuf::from(variable("CARGO_MANIFEST_DIR"));
    let places = match std::env::var_os("SPLAT_SOURCE_DIR") {
        Some(folder) if !folder.is_empty() => vec![PathBuf::from(folder)],
        _ => vec![own.join("libsplat"), own.join("../../..")],
    };
    match places.iter().find(|folder| folder.join("include/splat.h").exists()) {
        Some(folder) => folder.clone(),
        None => fail(&format!(
            "`bundled` found no sources of libsplat in {}: set SPLAT_SOURCE_DIR to their folder",
            places
                .iter()
                .map(|folder| folder.display().to_string())
                .collect::<Vec<_>>()
                .join(" and ")
        )),
    }
}

fn cmake() -> Command {
    Command::new(std::env::var_os("CMAKE").unwrap_or_else(|| "cmake".into()))
}

fn run(command: &mut Command) {
    let reason = match command.status() {
        Ok(status) if status.success() => return,
        Ok(status) => format!("{status}, its output is above"),
        Err(error) => error.to_string(),
    };
    eprintln!("`bundled` cannot build libsplat: {command:?}: {reason}.");
    eprintln!("It takes CMake 3.25, a compiler of C++20, glslangValidator and the libraries that CMake names;");
    eprintln!("on Debian the packages_build of tools/setup.sh. Or install libsplat, and leave `bundled` out.");
    std::process::exit(1);
}

/// What cargo tells a build script.
fn variable(name: &str) -> String {
    std::env::var(name).unwrap_or_else(|_| fail(&format!("{name} is not set, as cargo does")))
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
    eprintln!("or set SPLAT_LIB_DIR to the folder of libsplat.so, or build it with the feature `bundled`.");
    std::process::exit(1);
}
