//! Passes the run path of SPLAT_LIB_DIR on to tests and examples of this crate.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if let Ok(folder) = std::env::var("DEP_SPLAT_RUN_PATH") {
        println!("cargo:rustc-link-arg=-Wl,-rpath,{folder}");
    }
}
