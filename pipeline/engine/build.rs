//! The code of every crate of the workspace as a hash, for the addresses of results.

#[path = "src/sources.rs"]
mod sources;

use std::path::Path;

fn main() {
    let here = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
    let root = Path::new(&here)
        .join("../..")
        .canonicalize()
        .expect("the workspace is there");
    let crates = sources::crates(&root);
    let mut code = String::from("&[\n");
    for (name, folder) in &crates {
        let files = sources::files(&root, &crates, name);
        code += &format!("    ({name:?}, {:?}),\n", sources::digest(&root, &files));
        for part in ["src", "Cargo.toml", "build.rs"] {
            let part = folder.join(part);
            if part.exists() {
                println!("cargo:rerun-if-changed={}", part.display());
            }
        }
    }
    code += "]\n";
    for file in ["Cargo.toml", "Cargo.lock"] {
        println!("cargo:rerun-if-changed={}", root.join(file).display());
    }
    let out = std::env::var("OUT_DIR").expect("cargo sets it");
    std::fs::write(Path::new(&out).join("code.rs"), code).expect("the build folder can be written");
}
