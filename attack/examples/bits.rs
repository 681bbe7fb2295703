//! Prints the bits of every estimator on every system that it takes; `just bits` compares them across builds.

fn main() -> Result<(), String> {
    print!("{}", zonobench_attack::bits()?);
    Ok(())
}
