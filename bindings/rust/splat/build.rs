//! Passes the run path of SPLAT_LIB_DIR on: to tests and examples of this crate, and to the build
//! scripts of crates that depend on it.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if let Ok(folder) = std::env::var("DEP_SPLAT_RUN_PATH") {
        for argument in ["-Xlinker", "-rpath", "-Xlinker", &folder] {
            println!("cargo:rustc-link-arg={argument}");
        }
        println!("cargo:run_path={folder}");
    }
}
