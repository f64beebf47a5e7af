//! Every backend gives the bits of the scalar one, and the functions have the documented accuracy.

use super::*;

struct Probe<'a, T: Real> {
    x: &'a [f32],
    y: &'a [f32],
    out: &'a mut Vec<Vec<u32>>,
    lanes: std::marker::PhantomData<T>,
}
impl<T: Real<Scalar = f32>> Kernel<T> for Probe<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for (x, y) in self.x.chunks(T::LANES).zip(self.y.chunks(T::LANES)) {
            let (a, b) = (T::load(x), T::load(y));
            let (s, c) = a.sin_cos();
            let m = a.lt(b);
            let all = [
                a + b,
                a - b,
                a * b,
                -a,
                a.div(b),
                a.abs().sqrt(),
                a.abs(),
                a.max(b),
                a.min(b),
                a.round(),
                a.floor(),
                a.mul_add(b, a),
                a.neg_mul_add(b, b),
                s,
                c,
                a.exp(),
                b.abs().max(T::lit(1e-30)).ln(),
                a.tanh(),
                a.atan2(b),
                T::select(m, a, b),
                T::masked(T::not(m), a),
                T::masked(T::from_bits(T::bits(m)), b),
                T::masked(a.is_finite(), a),
            ];
            self.out.resize(all.len(), Vec::new());
            for (k, v) in all.iter().enumerate() {
                for i in 0..T::LANES {
                    self.out[k].push(v.get(i).to_bits());
                }
            }
        }
    }
}

fn arguments() -> (Vec<f32>, Vec<f32>) {
    let mut state = 7u64;
    let mut next = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 40) as f32 / (1u64 << 24) as f32 - 0.5) * 40.0
    };
    let mut x: Vec<f32> = (0..4096).map(|_| next()).collect();
    let mut y: Vec<f32> = (0..4096).map(|_| next()).collect();
    x[..8].copy_from_slice(&[0.0, -0.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e-40, 3.4e38, 0.5]);
    y[..8].copy_from_slice(&[0.0, 0.0, 1.0, 2.0, 3.0, -0.0, f32::NAN, 0.5]);
    (x, y)
}

fn probe<T: Real<Scalar = f32>>() -> Vec<Vec<u32>> {
    let (x, y) = arguments();
    let mut out = Vec::new();
    T::enter(Probe::<T> { x: &x, y: &y, out: &mut out, lanes: std::marker::PhantomData });
    out
}

#[test]
fn backends_agree_bit_for_bit() {
    let want = probe::<f32>();
    let check = |got: Vec<Vec<u32>>, isa: &str| {
        for (k, (g, w)) in got.iter().zip(&want).enumerate() {
            for (i, (g, w)) in g.iter().zip(w).enumerate() {
                // the sign and payload of a NaN are unspecified
                let nan = f32::from_bits(*g).is_nan() && f32::from_bits(*w).is_nan();
                assert!(
                    g == w || nan,
                    "{isa}: operation {k}, argument {i}: {} != {}",
                    f32::from_bits(*g),
                    f32::from_bits(*w)
                );
            }
        }
    };
    check(probe::<F32x4>(), F32x4::ISA);
    check(probe::<portable::F32x4>(), "portable");
    #[cfg(target_arch = "x86_64")]
    {
        if F32x8::supported() {
            check(probe::<F32x8>(), "avx2");
        }
        if F32x16::supported() {
            check(probe::<F32x16>(), "avx512");
        }
    }
}

#[test]
fn functions_are_accurate() {
    for i in 0..200_000 {
        let x = (i as f32 - 100_000.0) * 1.57e-4;
        let d = x as f64;
        let (s, c) = Real::sin_cos(x);
        assert!((s as f64 - d.sin()).abs() < 1.5e-7 && (c as f64 - d.cos()).abs() < 1.5e-7, "sin cos {x}");
        assert!((Real::tanh(x) as f64 - d.tanh()).abs() < 4e-7, "tanh {x}");
        assert!((Real::exp(x) as f64 / d.exp() - 1.0).abs() < 3e-7, "exp {x}");
        let p = (x.abs() + 1e-3) * 3.0;
        assert!((Real::ln(p) as f64 - (p as f64).ln()).abs() < 3e-7 * (1.0 + (p as f64).ln().abs()), "ln {p}");
        let y = ((i * 7919) % 1000) as f32 * 0.01 - 5.0;
        assert!((Real::atan2(y, x) as f64 - (y as f64).atan2(d)).abs() < 4e-7, "atan2 {y} {x}");
    }
}

#[test]
fn rearranging_moves_every_lane() {
    struct Turn<T>(std::marker::PhantomData<T>);
    impl<T: Real<Scalar = f32>> Kernel<T> for Turn<T> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            let (mut numbers, mut from) = ([0.0; MAX_LANES], [0; MAX_LANES]);
            for i in 0..T::LANES {
                numbers[i] = 10.0 + i as f32;
                from[i] = ((5 * i + 3) % T::LANES) as i32;
            }
            let turned = T::load(&numbers[..T::LANES]).rearrange(&from);
            for i in 0..T::LANES {
                assert_eq!(turned.get(i), numbers[from[i] as usize], "{}, lane {i}", T::ISA);
            }
        }
    }
    fn turn<T: Real<Scalar = f32>>() {
        if T::supported() {
            T::enter(Turn::<T>(std::marker::PhantomData));
        }
    }
    turn::<f32>();
    turn::<F32x4>();
    turn::<portable::F32x4>();
    #[cfg(target_arch = "x86_64")]
    {
        turn::<F32x8>();
        turn::<F32x16>();
    }
}

#[test]
fn sums_do_not_depend_on_width() {
    let (x, _) = arguments();
    let x = &x[16..32];
    fn total<T: Real<Scalar = f32>>(x: &[f32]) -> u32 {
        let v: Vec<T> = x.chunks(T::LANES).map(T::load).collect();
        sum16(&v).to_bits()
    }
    let want = total::<f32>(x);
    assert_eq!(total::<F32x4>(x), want);
    assert_eq!(total::<portable::F32x4>(x), want);
    #[cfg(target_arch = "x86_64")]
    {
        assert!(!F32x8::supported() || total::<F32x8>(x) == want);
        assert!(!F32x16::supported() || total::<F32x16>(x) == want);
    }
}

/// Products of easy, cancelling, tiny, halfway and special arguments are rounded once in all four lanes.
fn products_are_fused<T: Real<Scalar = f32>>() {
    struct Products<T>(std::marker::PhantomData<T>);
    impl<T: Real<Scalar = f32>> Kernel<T> for Products<T> {
        type Output = ();
        fn run(self) {
            let mut state = 1u64;
            let mut next = || {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 32) as u32
            };
            let (mut a, mut b, mut c) = ([0.0; 4], [0.0; 4], [0.0; 4]);
            for round in 0..250_000 {
                for i in 0..4 {
                    // few significant bits give sums halfway between two numbers
                    let mask = [u32::MAX, u32::MAX, 0xffff_f000, 0xffff_0000][(round + i) % 4];
                    [a[i], b[i]] = [next(), next()].map(|x| f32::from_bits(x & mask));
                    c[i] = match (round + i) % 5 {
                        // cancellation leaves only the rounding error of the product
                        0 => -(a[i] * b[i]),
                        1 => a[i] * b[i] * f32::EPSILON,
                        2 => a[i] * b[i] * 0.5 * f32::EPSILON,
                        _ => f32::from_bits(next() & mask),
                    };
                }
                let (x, y, z) = (T::load(&a), T::load(&b), T::load(&c));
                let (sum, difference) = (x.mul_add(y, z), x.neg_mul_add(y, z));
                for i in 0..4 {
                    let want = [a[i].mul_add(b[i], c[i]), (-a[i]).mul_add(b[i], c[i])];
                    for (got, want) in [sum.get(i), difference.get(i)].into_iter().zip(want) {
                        let same = got.to_bits() == want.to_bits() || got.is_nan() && want.is_nan();
                        assert!(same, "{}: {:e} * {:e} + {:e}: {got:e} != {want:e}", T::ISA, a[i], b[i], c[i]);
                    }
                }
            }
        }
    }
    T::enter(Products::<T>(std::marker::PhantomData));
}

#[test]
fn multiply_add_rounds_once() {
    products_are_fused::<F32x4>();
    products_are_fused::<portable::F32x4>();
    #[cfg(not(vectors = "none"))]
    assert!(fuses());
}
