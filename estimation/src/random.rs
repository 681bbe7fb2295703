//! Counter-based random numbers: every draw has an address, and no draw depends on another.
//!
//! A draw's address is (seed, purpose, run, step, component, attempt). It is mapped to one block of a
//! ChaCha8 key stream: seed and purpose are the key, the run is the stream number, and
//! step · 2³² + component · 2¹⁶ + attempt is the block counter. So methods, sweeps and thread counts
//! all see the same noise, and a run can be drawn without the runs before it.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// What a random number is for. Purposes never share numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The set part of the first state.
    X0,
    /// The set part of the process noise.
    W,
    /// The set part of the measurement noise.
    V,
    /// The scheduling parameters δ.
    Delta,
    /// The Gaussian part of the first state.
    X0Gaussian,
    /// The Gaussian part of the process noise.
    WGaussian,
    /// The Gaussian part of the measurement noise.
    VGaussian,
    /// The first cloud of a particle filter: step 0, component = particle, attempt = state component.
    ParticleX0,
    /// The process noise of a particle filter: component = particle, attempt = noise component.
    ParticleW,
    /// Where a particle filter begins to resample.
    Resample,
}

impl Purpose {
    /// The eight bytes that stand for it in the key.
    fn tag(self) -> &'static [u8; 8] {
        match self {
            Purpose::X0 => b"x0\0\0\0\0\0\0",
            Purpose::W => b"w\0\0\0\0\0\0\0",
            Purpose::V => b"v\0\0\0\0\0\0\0",
            Purpose::Delta => b"delta\0\0\0",
            Purpose::X0Gaussian => b"x0-gauss",
            Purpose::WGaussian => b"w-gauss\0",
            Purpose::VGaussian => b"v-gauss\0",
            Purpose::ParticleX0 => b"pf-x0\0\0\0",
            Purpose::ParticleW => b"pf-w\0\0\0\0",
            Purpose::Resample => b"pf-draw\0",
        }
    }
}

/// Bytes 16 to 31 of every key: changed if the meaning of an address ever changes.
const SCHEME: &[u8; 16] = b"zonobench rng 1\0";

/// The random numbers of one seed, purpose and run.
#[derive(Clone, Debug)]
pub struct Draws {
    stream: ChaCha8Rng,
}

/// The largest component of an address, plus one.
pub const MAX_COMPONENTS: usize = 1 << 16;
/// The largest attempt of an address, plus one.
pub const MAX_ATTEMPTS: usize = 1 << 16;
/// The largest step of an address, plus one.
pub const MAX_STEPS: usize = 1 << 32;

impl Draws {
    /// The numbers of `run` for `purpose` under `seed`.
    ///
    /// The key is seed (8 bytes, little endian) ‖ purpose (8 bytes of ASCII, zero padded) ‖ scheme
    /// (16 bytes): different seeds and purposes give different keys, which is all that ChaCha asks.
    pub fn new(seed: u64, purpose: Purpose, run: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(purpose.tag());
        key[16..].copy_from_slice(SCHEME);
        let mut stream = ChaCha8Rng::from_seed(key);
        stream.set_stream(run);
        Self { stream }
    }

    /// The first two 64-bit words at an address.
    fn words(&mut self, step: usize, component: usize, attempt: usize) -> [u64; 2] {
        debug_assert!(step < MAX_STEPS && component < MAX_COMPONENTS && attempt < MAX_ATTEMPTS);
        let block = (step as u128) << 32 | (component as u128) << 16 | attempt as u128;
        self.stream.set_word_pos(block * 16);
        [self.stream.next_u64(), self.stream.next_u64()]
    }

    /// A number uniform in [−1, 1): a multiple of 2⁻⁵².
    pub fn uniform(&mut self, step: usize, component: usize, attempt: usize) -> f64 {
        let [word, _] = self.words(step, component, attempt);
        (word >> 11) as f64 * TWO_POW_MINUS_52 - 1.0
    }

    /// A standard normal number: √(−2 ln a) cos(2π b) with a ∈ (0, 1], b ∈ [0, 1), both multiples of
    /// 2⁻⁵³, so its absolute value is at most 8.58.
    ///
    /// Source: \[BoxMuller1958\].
    pub fn gaussian(&mut self, step: usize, component: usize, attempt: usize) -> f64 {
        box_muller(self.words(step, component, attempt))
    }

    /// The standard normal numbers of the attempts 0, 1, … of one step and component: those of
    /// [`Draws::gaussian`], read in one go.
    pub fn gaussians(&mut self, step: usize, component: usize, into: &mut [f64]) {
        for (attempt, x) in into.iter_mut().enumerate() {
            let words = match attempt {
                0 => self.words(step, component, 0),
                _ => {
                    // The rest of the block before: 16 words of 32 bits, four of them read.
                    for _ in 0..6 {
                        self.stream.next_u64();
                    }
                    [self.stream.next_u64(), self.stream.next_u64()]
                }
            };
            *x = box_muller(words);
        }
    }

    /// −1 or +1, with equal chances.
    pub fn sign(&mut self, step: usize, component: usize, attempt: usize) -> f64 {
        if self.words(step, component, attempt)[0] >> 63 == 1 {
            1.0
        } else {
            -1.0
        }
    }
}

fn box_muller([first, second]: [u64; 2]) -> f64 {
    let a = ((first >> 11) + 1) as f64 * TWO_POW_MINUS_53;
    let b = (second >> 11) as f64 * TWO_POW_MINUS_53;
    (-2.0 * libm::log(a)).sqrt() * libm::cos(2.0 * std::f64::consts::PI * b)
}

const TWO_POW_MINUS_53: f64 = f64::EPSILON / 2.0;
const TWO_POW_MINUS_52: f64 = f64::EPSILON;

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean, variance, and the fourth standardised moment.
    fn moments(values: &[f64]) -> (f64, f64, f64) {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n;
        let fourth = values.iter().map(|x| (x - mean).powi(4)).sum::<f64>() / n;
        (mean, variance, fourth / (variance * variance))
    }

    const N: usize = 100_000;

    #[test]
    fn uniform_numbers_have_the_moments_of_the_uniform_law() {
        let mut draws = Draws::new(7, Purpose::W, 3);
        let values: Vec<f64> = (0..N).map(|k| draws.uniform(k, 0, 0)).collect();
        let (mean, variance, kurtosis) = moments(&values);
        // Five standard errors: mean √(1/3/N), variance √(4/45/N).
        assert!(mean.abs() < 5.0 * (1.0 / 3.0 / N as f64).sqrt(), "{mean}");
        assert!(
            (variance - 1.0 / 3.0).abs() < 5.0 * (4.0 / 45.0 / N as f64).sqrt(),
            "{variance}"
        );
        assert!((kurtosis - 1.8).abs() < 0.03, "{kurtosis}");
        assert!(values.iter().all(|x| (-1.0..1.0).contains(x)));
    }

    #[test]
    fn gaussian_numbers_have_the_moments_and_tails_of_the_normal_law() {
        let mut draws = Draws::new(7, Purpose::V, 0);
        let values: Vec<f64> = (0..N).map(|k| draws.gaussian(k, 1, 0)).collect();
        let (mean, variance, kurtosis) = moments(&values);
        assert!(mean.abs() < 5.0 / (N as f64).sqrt(), "{mean}");
        assert!(
            (variance - 1.0).abs() < 5.0 * (2.0 / N as f64).sqrt(),
            "{variance}"
        );
        assert!(
            (kurtosis - 3.0).abs() < 5.0 * (24.0 / N as f64).sqrt(),
            "{kurtosis}"
        );
        for (bound, probability) in [(1.0, 0.317_310_5), (2.0, 0.045_500_3), (3.0, 0.002_699_8)] {
            let beyond = values.iter().filter(|x| x.abs() > bound).count() as f64 / N as f64;
            let error = (probability * (1.0 - probability) / N as f64).sqrt();
            assert!(
                (beyond - probability).abs() < 5.0 * error,
                "{bound}: {beyond}"
            );
        }
    }

    #[test]
    fn neighbouring_addresses_are_uncorrelated() {
        let mut draws = Draws::new(1, Purpose::W, 0);
        let mut next_run = Draws::new(1, Purpose::W, 1);
        let mut next_seed = Draws::new(2, Purpose::W, 0);
        let mut other_purpose = Draws::new(1, Purpose::V, 0);
        let here: Vec<f64> = (0..N).map(|k| draws.uniform(k, 0, 0)).collect();
        let against = |name: &str, mut other: Box<dyn FnMut(usize) -> f64 + '_>| {
            let product: f64 = here.iter().enumerate().map(|(k, x)| x * other(k)).sum();
            // A mean of N products of variance 1/9.
            assert!(
                (product / N as f64).abs() < 5.0 / 3.0 / (N as f64).sqrt(),
                "{name}"
            );
        };
        against(
            "step",
            Box::new(|k| Draws::new(1, Purpose::W, 0).uniform(k + 1, 0, 0)),
        );
        against("component", Box::new(|k| draws.clone().uniform(k, 1, 0)));
        against("attempt", Box::new(|k| draws.clone().uniform(k, 0, 1)));
        against("run", Box::new(|k| next_run.uniform(k, 0, 0)));
        against("seed", Box::new(|k| next_seed.uniform(k, 0, 0)));
        against("purpose", Box::new(|k| other_purpose.uniform(k, 0, 0)));
    }

    #[test]
    fn a_draw_does_not_depend_on_the_draws_before_it() {
        let mut forward = Draws::new(5, Purpose::X0, 9);
        let mut backward = forward.clone();
        let up: Vec<f64> = (0..50).map(|k| forward.gaussian(k, k % 3, 0)).collect();
        let mut down: Vec<f64> = (0..50)
            .rev()
            .map(|k| backward.gaussian(k, k % 3, 0))
            .collect();
        down.reverse();
        assert_eq!(up, down);
    }

    #[test]
    fn numbers_read_in_one_go_are_those_of_their_addresses() {
        let mut draws = Draws::new(5, Purpose::ParticleW, 9);
        for (step, component) in [(0, 0), (7, 3), (7, 4), (2, 65_535)] {
            let mut all = [0.0; 13];
            draws.gaussians(step, component, &mut all);
            for (attempt, x) in all.into_iter().enumerate() {
                assert_eq!(x, draws.gaussian(step, component, attempt));
            }
        }
    }

    /// Computed with an independent ChaCha8 in Python from the address scheme of the module's docs.
    #[test]
    fn the_first_numbers_are_those_of_the_documented_scheme() {
        let mut w = Draws::new(2020, Purpose::W, 0);
        assert_eq!(w.uniform(0, 0, 0), -0.1335701710092818);
        assert_eq!(
            Draws::new(2020, Purpose::W, 3).uniform(100, 1, 2),
            -0.06040392023799801
        );
        let close = |got: f64, expected: f64| assert!((got - expected).abs() < 1e-15, "{got}");
        close(
            Draws::new(2020, Purpose::VGaussian, 0).gaussian(0, 0, 0),
            0.2642613322262484,
        );
        close(
            Draws::new(2020, Purpose::VGaussian, 29).gaussian(99, 1, 0),
            0.6852786117487719,
        );
    }

    #[test]
    fn signs_are_balanced() {
        let mut draws = Draws::new(11, Purpose::Delta, 0);
        let sum: f64 = (0..N).map(|k| draws.sign(k, 0, 0)).sum();
        assert!(sum.abs() < 5.0 * (N as f64).sqrt() && sum != 0.0, "{sum}");
    }
}
