//! Embeds what the pages say of each paper: `about.md` and `figures.toml` of its folder in `experiments/`.

use std::fs;
use std::path::PathBuf;

fn main() {
    let here = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let experiments = here.join("../../experiments");
    let folders = fs::read_dir(&experiments).expect("the experiments can be listed");
    let mut papers: Vec<PathBuf> = folders
        .map(|entry| entry.expect("readable").path())
        .filter(|path| path.join("about.md").is_file())
        .collect();
    papers.sort();
    let mut code = String::from("&[\n");
    for paper in papers {
        let name = paper.file_name().expect("a folder").to_string_lossy();
        let texts = ["about.md", "figures.toml"].map(|file| {
            let path = paper.join(file).display().to_string();
            println!("cargo:rerun-if-changed={path}");
            format!("include_str!({path:?})")
        });
        code += &format!("    ({name:?}, {}),\n", texts.join(", "));
    }
    code += "]\n";
    println!("cargo:rerun-if-changed={}", experiments.display());
    let out = PathBuf::from(std::env::var("OUT_DIR").expect("cargo sets it"));
    fs::write(out.join("pages.rs"), code).expect("the build folder can be written");
}
