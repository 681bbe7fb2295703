//! A crate of somebody else, outside of this repository: a system of its own needs this crate and nothing else.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The example, in a package of its own with this repository's lock file, so that nothing is asked of the network.
fn package() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    // Outside of the repository, so that it is no member of its workspace; the name is that of this test's process.
    let folder = std::env::temp_dir().join(format!("zonobench-own-{}", std::process::id()));
    fs::create_dir_all(folder.join("src")).unwrap();
    let manifest = format!(
        "[package]\nname = \"own\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[dependencies]\nzonobench-estimation = {{ path = {here:?} }}\n\n[profile.dev]\ndebug = false\n"
    );
    fs::write(folder.join("Cargo.toml"), manifest).unwrap();
    fs::copy(here.join("../Cargo.lock"), folder.join("Cargo.lock")).unwrap();
    fs::copy(
        here.join("examples/own_system.rs"),
        folder.join("src/main.rs"),
    )
    .unwrap();
    folder
}

#[test]
fn a_crate_outside_of_this_repository_has_a_system_of_its_own() {
    let folder = package();
    let run = Command::new(env!("CARGO"))
        .args(["run", "--offline", "--quiet"])
        .current_dir(&folder)
        .env(
            "CARGO_TARGET_DIR",
            Path::new(env!("CARGO_TARGET_TMPDIR")).join("own-crate"),
        )
        // What the outer cargo says of its own build is not for the inner one.
        .env_remove("CARGO_BUILD_TARGET")
        .env_remove("RUSTFLAGS")
        .output()
        .unwrap();
    fs::remove_dir_all(&folder).unwrap();
    let said = String::from_utf8_lossy(&run.stdout);
    assert!(
        run.status.success(),
        "{said}{}",
        String::from_utf8_lossy(&run.stderr)
    );
    assert_eq!(said.lines().count(), 101, "{said}");
}
