//! Copying a network into a larger one that computes the same outputs.

use super::mlp::Mlp;
use crate::error::Error;

/// Copies a network's parameters into a larger one: input `i` becomes input `sees[i]`. At first, the outputs ignore all
/// other inputs and units of the larger network. Other units keep their parameters.
///
/// # Errors
/// If the larger network has other layers, narrower layers, or another activation.
///
/// # Panics
/// If `sees` has the wrong length or an index beyond the inputs.
pub fn widen(net: &Mlp, params: &mut [f32], small: &Mlp, of_small: &[f32], sees: &[usize]) -> Result<(), Error> {
    let (sizes, others) = (net.sizes(), small.sizes());
    let hidden = |sizes: &[usize]| format!("{:?}", &sizes[1..sizes.len() - 1]);
    let wide = sizes.len() == others.len() && sizes[1..].iter().zip(&others[1..]).all(|(a, b)| a >= b);
    if !wide || sizes.last() != others.last() {
        let what = "the policy to start from".into();
        return Err(Error::Mismatch {
            what,
            found: format!("hidden layers {}", hidden(others)),
            expected: format!("{} or narrower", hidden(sizes)),
        });
    }
    if net.activation() != small.activation() {
        let [found, expected] = [small, net].map(|net| format!("{:?}", net.activation()).to_lowercase());
        return Err(Error::Mismatch { what: "activation of the policy to start from".into(), found, expected });
    }
    assert!(sees.len() == others[0] && sees.iter().all(|i| *i < sizes[0]), "one valid index per input");
    for (l, ((weights, biases), (from, shifts))) in net.layers().zip(small.layers()).enumerate() {
        let rows = params[weights].chunks_exact_mut(sizes[l]);
        for (row, theirs) in rows.zip(of_small[from].chunks_exact(others[l])) {
            row.fill(0.0);
            for (k, weight) in theirs.iter().enumerate() {
                row[if l == 0 { sees[k] } else { k }] = *weight;
            }
        }
        params[biases][..others[l + 1]].copy_from_slice(&of_small[shifts]);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::noise::SplitMix;
    use crate::nets::activation::Activation;
    use crate::nets::init::orthogonal;

    #[test]
    fn a_grafted_network_puts_out_what_it_did() {
        let (small, large) = (Mlp::new(&[3, 5, 4, 2], Activation::Tanh), Mlp::new(&[6, 9, 4, 2], Activation::Tanh));
        let mut random = SplitMix::new(1, 2);
        let (mut own, mut theirs) = (vec![0.0; large.len()], vec![0.0; small.len()]);
        orthogonal(&large, &mut own, 1.0, &mut random);
        orthogonal(&small, &mut theirs, 1.0, &mut random);
        widen(&large, &mut own, &small, &theirs, &[4, 0, 2]).unwrap();
        let want = small.forward_row(&theirs, &[0.3, -1.2, 0.7]);
        let got = large.forward_row(&own, &[-1.2, 9.0, 0.7, 9.0, 0.3, 9.0]);
        assert!(want.iter().zip(&got).all(|(a, b)| (a - b).abs() < 1e-6), "{got:?}, expected {want:?}");
        // narrower networks and other numbers of layers are refused
        for sizes in [&[6, 4, 4, 2][..], &[6, 9, 2], &[6, 9, 4, 3]] {
            let net = Mlp::new(sizes, Activation::Tanh);
            assert!(widen(&net, &mut vec![0.0; net.len()], &small, &theirs, &[4, 0, 2]).is_err(), "{sizes:?}");
        }
        let relu = Mlp::new(&[6, 9, 4, 2], Activation::Relu);
        let error = widen(&relu, &mut own, &small, &theirs, &[4, 0, 2]).unwrap_err().to_string();
        assert!(error.contains("activation") && error.contains("tanh") && error.contains("relu"), "{error}");
    }
}
