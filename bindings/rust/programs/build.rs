//! Lets programs find the library of SPLAT_LIB_DIR at run time, also where cargo does not start them.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if let Ok(folder) = std::env::var("DEP_SPLAT_RS_RUN_PATH") {
        for argument in ["-Xlinker", "-rpath", "-Xlinker", &folder] {
            println!("cargo:rustc-link-arg={argument}");
        }
    }
}
