//! Comparisons of numbers in which NaN fails.

use serde_json::Value;

/// A JSON list of numbers.
#[allow(dead_code)]
pub fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

/// The largest of several nonnegative errors: 0 without any, infinite if one is NaN. (`fold(0.0, f64::max)` ignores
/// NaN.)
pub fn largest(errors: impl IntoIterator<Item = f64>) -> f64 {
    errors.into_iter().fold(0.0, |worst, x| if x.is_nan() { f64::INFINITY } else { x.max(worst) })
}

/// Distance of two vectors, relative to the second or to `floor` if that is larger. Infinite if it is NaN.
#[allow(dead_code)]
pub fn distance(a: &[f64], b: &[f64], floor: f64) -> f64 {
    assert_eq!(a.len(), b.len(), "both sides have the same layout");
    let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
    largest([norm(&mut a.iter().zip(b).map(|(x, y)| x - y)) / norm(&mut b.iter().copied()).max(floor)])
}

#[test]
fn what_is_not_a_number_is_the_largest_error() {
    assert_eq!(largest([]), 0.0);
    assert_eq!(largest([1.0, 3.0, 2.0]), 3.0);
    assert_eq!(largest([1.0, f64::NAN, 2.0]), f64::INFINITY);
    assert_eq!(largest([f64::NAN, 2.0]), f64::INFINITY);
    assert_eq!(distance(&[f64::NAN], &[1.0], 1.0), f64::INFINITY);
    assert_eq!(distance(&[1.0], &[f64::NAN], 1.0), f64::INFINITY);
}
