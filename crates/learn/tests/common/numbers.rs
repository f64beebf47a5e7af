//! Numbers to test with, and finite differences.

/// 64-bit pseudorandom numbers: Knuth's generator, whose upper bits are good enough for test inputs.
fn random(salt: u64) -> impl Iterator<Item = u64> {
    let mut state = salt.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    std::iter::repeat_with(move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        state
    })
}

/// Pseudorandom numbers in [-1, 1).
pub fn noise(n: usize, salt: u64) -> Vec<f64> {
    random(salt).take(n).map(|x| (x >> 11) as f64 / (1u64 << 52) as f64 - 1.0).collect()
}

/// Such numbers, exactly representable in single precision.
pub fn noise_f32(n: usize, salt: u64) -> Vec<f32> {
    random(salt).take(n).map(|x| (x >> 40) as f32 / (1u64 << 23) as f32 - 1.0).collect()
}

/// Largest difference between a gradient and the central differences of a function, relative to the gradient's size.
pub fn worst(gradient: &[f64], params: &[f64], mut f: impl FnMut(&[f64]) -> f64) -> f64 {
    let size = gradient.iter().map(|g| g * g).sum::<f64>().sqrt().max(1e-3);
    let (mut worst, mut p, h) = (0f64, params.to_vec(), 1e-6);
    for i in 0..p.len() {
        p[i] = params[i] + h;
        let up = f(&p);
        p[i] = params[i] - h;
        let down = f(&p);
        p[i] = params[i];
        worst = worst.max(((up - down) / (2.0 * h) - gradient[i]).abs() / size);
    }
    worst
}
