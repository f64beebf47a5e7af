//! The inner loops of a network: register tiles over blocks of sixteen samples.
//!
//! A *column* is one vector of samples of one block: a block is one column of sixteen lanes, two of eight, four of
//! four. Each tile keeps a small rectangle of results in registers while it runs over the inner dimension. Every result
//! is a chain of fused products. Its order depends neither on the shape of the tile nor on the vector width. Sums over
//! samples end in [`sum16`], so all instruction sets give the same bits.
//!
//! `x`, `y`, `dx` and `dy` are rows of sixteen, `[block][feature][16]`, with blocks `*_stride` rows apart. Weights are
//! `[output][input]`.

#![expect(clippy::needless_range_loop, reason = "plain counted loops over small arrays are what the compiler unrolls")]

use crate::lanes::BLOCK;
use marathon_physics::lanes::{Real, sum16};

/// Rows of sixteen samples.
pub type Rows<'a, S> = &'a [[S; BLOCK]];
/// Mutable rows of sixteen samples.
pub type RowsMut<'a, S> = &'a mut [[S; BLOCK]];

/// Maximum rows of a tile. With four columns of AVX-512 they fill 24 of 32 registers.
const ROWS: usize = 6;

/// Lane counts whose kernels have 32 registers, and room for four columns: AVX-512, and NEON. One lane is a row of blocks.
const FOUR_COLUMNS: &[usize] = if cfg!(target_arch = "aarch64") { &[1, 4, 16] } else { &[1, 16] };

/// Most rows of a tile with two columns or four. Engines of WebAssembly keep fewer numbers in registers than LLVM.
#[inline(always)]
fn rows<T: Real>() -> usize {
    if T::LANES == 4 && !FOUR_COLUMNS.contains(&4) { 4 } else { ROWS }
}

/// Splits `n` into tiles of at most `max` that are as equal as possible. Returns the size of the next one.
#[inline(always)]
fn next_tile(n: usize, max: usize) -> usize {
    n.div_ceil(n.div_ceil(max))
}

/// Runs `$f::<T, size, ..>` over `0..$n` in tiles of at most [`ROWS`].
macro_rules! tiles {
    ($n:expr, $max:expr, $j:ident, $f:ident, [$($g:tt),*], $args:tt) => {{
        let n = $n;
        let mut $j = 0;
        while $j < n {
            let size = next_tile(n - $j, $max);
            match size {
                1 => tiles!(@call $f, 1, [$($g),*], $args),
                2 => tiles!(@call $f, 2, [$($g),*], $args),
                3 => tiles!(@call $f, 3, [$($g),*], $args),
                4 => tiles!(@call $f, 4, [$($g),*], $args),
                5 => tiles!(@call $f, 5, [$($g),*], $args),
                _ => tiles!(@call $f, 6, [$($g),*], $args),
            }
            $j += size;
        }
    }};
    (@call $f:ident, $size:literal, [$($g:tt),*], ($($arg:expr),*)) => { $f::<T, $size $(, $g)*>($($arg),*) };
}

/// Samples in lanes `lane .. lane + LANES` of a row.
#[inline(always)]
fn load<T: Real>(row: &[T::Scalar; BLOCK], lane: usize) -> T {
    T::load(&row[lane..lane + T::LANES])
}

/// Writes samples into lanes `lane .. lane + LANES` of a row.
#[inline(always)]
fn store<T: Real>(v: T, row: &mut [T::Scalar; BLOCK], lane: usize) {
    v.store(&mut row[lane..lane + T::LANES])
}

/// Places of `V` consecutive columns: block and first lane of each.
#[derive(Clone, Copy)]
struct Columns<const V: usize> {
    block: [usize; V],
    lane: [usize; V],
}

#[inline(always)]
fn columns<T: Real, const V: usize>(first: usize) -> Columns<V> {
    let per_block = BLOCK / T::LANES;
    let mut c = Columns { block: [0; V], lane: [0; V] };
    for v in 0..V {
        c.block[v] = (first + v) / per_block;
        c.lane[v] = (first + v) % per_block * T::LANES;
    }
    c
}

/// `n` rows from row `first` of each column's block.
#[inline(always)]
fn column_rows<'a, S, const V: usize>(x: Rows<'a, S>, stride: usize, n: usize, at: &Columns<V>) -> [Rows<'a, S>; V] {
    let mut rows = [&x[..n]; V];
    for v in 0..V {
        rows[v] = &x[at.block[v] * stride..][..n];
    }
    rows
}

/// A layer without its activation, `y = W x + b`, for `V` columns from `first` on.
#[inline(always)]
fn affine_columns<T: Real, const V: usize>(
    (w, b): (&[T::Scalar], &[T::Scalar]),
    (x, x_stride, ni): (Rows<T::Scalar>, usize, usize),
    (y, y_stride, no): (RowsMut<T::Scalar>, usize, usize),
    first: usize,
) {
    let at = columns::<T, V>(first);
    let x = column_rows(x, x_stride, ni, &at);
    tiles!(no, rows::<T>(), j, affine_tile, [V], (&w[j * ni..], &b[j..], &x, y, y_stride, j, &at));
}

#[inline(always)]
fn affine_tile<T: Real, const J: usize, const V: usize>(
    w: &[T::Scalar],
    b: &[T::Scalar],
    x: &[Rows<T::Scalar>; V],
    y: RowsMut<T::Scalar>,
    y_stride: usize,
    j: usize,
    at: &Columns<V>,
) {
    let ni = x[0].len();
    let mut x = *x;
    for v in 0..V {
        x[v] = &x[v][..ni];
    }
    let mut rows = [w; J];
    let mut acc = [[T::zero(); V]; J];
    for i in 0..J {
        rows[i] = &w[i * ni..][..ni];
        acc[i] = [T::splat(b[i]); V];
    }
    for k in 0..ni {
        let mut xk = [T::zero(); V];
        for v in 0..V {
            xk[v] = load(&x[v][k], at.lane[v]);
        }
        for i in 0..J {
            let s = T::splat(rows[i][k]);
            for v in 0..V {
                acc[i][v] = s.mul_add(xk[v], acc[i][v]);
            }
        }
    }
    for v in 0..V {
        let out = &mut y[at.block[v] * y_stride + j..][..J];
        for i in 0..J {
            store(acc[i][v], &mut out[i], at.lane[v]);
        }
    }
}

/// `dx = W^T dy` for `V` columns.
#[inline(always)]
fn transposed_columns<T: Real, const V: usize>(
    w: &[T::Scalar],
    (dy, dy_stride, no): (Rows<T::Scalar>, usize, usize),
    (dx, dx_stride, ni): (RowsMut<T::Scalar>, usize, usize),
    first: usize,
) {
    let at = columns::<T, V>(first);
    let dy = column_rows(dy, dy_stride, no, &at);
    tiles!(ni, rows::<T>(), k, transposed_tile, [V], (w, ni, &dy, dx, dx_stride, k, &at));
}

#[inline(always)]
fn transposed_tile<T: Real, const K: usize, const V: usize>(
    w: &[T::Scalar],
    ni: usize,
    dy: &[Rows<T::Scalar>; V],
    dx: RowsMut<T::Scalar>,
    dx_stride: usize,
    k: usize,
    at: &Columns<V>,
) {
    let no = dy[0].len();
    let mut dy = *dy;
    for v in 0..V {
        dy[v] = &dy[v][..no];
    }
    let mut acc = [[T::zero(); V]; K];
    for j in 0..no {
        let row = &w[j * ni + k..][..K];
        let mut d = [T::zero(); V];
        for v in 0..V {
            d[v] = load(&dy[v][j], at.lane[v]);
        }
        for i in 0..K {
            let s = T::splat(row[i]);
            for v in 0..V {
                acc[i][v] = s.mul_add(d[v], acc[i][v]);
            }
        }
    }
    for v in 0..V {
        let out = &mut dx[at.block[v] * dx_stride + k..][..K];
        for i in 0..K {
            store(acc[i][v], &mut out[i], at.lane[v]);
        }
    }
}

/// Number of columns per tile of `affine` and `transposed`, as many as fit the registers.
macro_rules! by_columns {
    ($blocks:expr, $f:ident, $($arg:expr),*) => {{
        let n = $blocks * (BLOCK / T::LANES);
        let mut c = 0;
        if FOUR_COLUMNS.contains(&T::LANES) {
            while c + 4 <= n {
                $f::<T, 4>($($arg,)* c);
                c += 4;
            }
        }
        while c + 2 <= n {
            $f::<T, 2>($($arg,)* c);
            c += 2;
        }
        while c < n {
            $f::<T, 1>($($arg,)* c);
            c += 1;
        }
    }};
}

/// A layer without its activation: `y = W x + b` for `blocks` blocks.
#[inline(always)]
pub fn affine<T: Real>(
    (w, b): (&[T::Scalar], &[T::Scalar]),
    (x, x_stride, ni): (Rows<T::Scalar>, usize, usize),
    (y, y_stride, no): (RowsMut<T::Scalar>, usize, usize),
    blocks: usize,
) {
    by_columns!(blocks, affine_columns, (w, b), (x, x_stride, ni), (&mut *y, y_stride, no));
}

/// Gradient with respect to a layer's input: `dx = W^T dy` for `blocks` blocks.
#[inline(always)]
pub fn transposed<T: Real>(
    w: &[T::Scalar],
    (dy, dy_stride, no): (Rows<T::Scalar>, usize, usize),
    (dx, dx_stride, ni): (RowsMut<T::Scalar>, usize, usize),
    blocks: usize,
) {
    by_columns!(blocks, transposed_columns, w, (dy, dy_stride, no), (&mut *dx, dx_stride, ni));
}

/// Gradient with respect to a layer's weights and biases, summed over `blocks` blocks: `dw = dy x^T`, `db = dy 1`.
/// Overwrites `dw` and `db`.
#[inline(always)]
pub fn outer<T: Real>(
    (x, x_stride, ni): (Rows<T::Scalar>, usize, usize),
    (dy, dy_stride, no): (Rows<T::Scalar>, usize, usize),
    (dw, db): (&mut [T::Scalar], &mut [T::Scalar]),
    blocks: usize,
) {
    let mut j0 = 0;
    while j0 < no {
        let size = next_tile(no - j0, 4);
        match size {
            1 => outer_rows::<T, 1>((x, x_stride, ni), (dy, dy_stride, j0), dw, blocks),
            2 => outer_rows::<T, 2>((x, x_stride, ni), (dy, dy_stride, j0), dw, blocks),
            3 => outer_rows::<T, 3>((x, x_stride, ni), (dy, dy_stride, j0), dw, blocks),
            _ => outer_rows::<T, 4>((x, x_stride, ni), (dy, dy_stride, j0), dw, blocks),
        }
        j0 += size;
    }
    tiles!(no, ROWS, j, bias_tile, [], (dy, dy_stride, j, db, blocks));
}

#[inline(always)]
fn outer_rows<T: Real, const J: usize>(
    (x, x_stride, ni): (Rows<T::Scalar>, usize, usize),
    (dy, dy_stride, j0): (Rows<T::Scalar>, usize, usize),
    dw: &mut [T::Scalar],
    blocks: usize,
) {
    let rows = if T::LANES == 16 { ROWS } else { ROWS / 2 };
    tiles!(ni, rows, k, outer_tile, [J], (x, x_stride, k, ni, dy, dy_stride, j0, dw, blocks));
}

#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "an inner loop whose arguments are plain positions")]
fn outer_tile<T: Real, const K: usize, const J: usize>(
    x: Rows<T::Scalar>,
    x_stride: usize,
    k: usize,
    ni: usize,
    dy: Rows<T::Scalar>,
    dy_stride: usize,
    j: usize,
    dw: &mut [T::Scalar],
    blocks: usize,
) {
    let per_block = BLOCK / T::LANES;
    if per_block == 1 {
        let acc = outer_part::<T, K, J>(x, x_stride, k, dy, dy_stride, j, blocks, 0);
        for i in 0..J {
            let out = &mut dw[(j + i) * ni + k..][..K];
            for m in 0..K {
                out[m] = acc[i][m].reduce_add();
            }
        }
        return;
    }
    // partial sums of the lanes of a block, one vector width after another
    let mut sums = [[[T::zero(); BLOCK]; K]; J];
    for part in 0..per_block {
        let acc = outer_part::<T, K, J>(x, x_stride, k, dy, dy_stride, j, blocks, part * T::LANES);
        for i in 0..J {
            for m in 0..K {
                sums[i][m][part] = acc[i][m];
            }
        }
    }
    for i in 0..J {
        let out = &mut dw[(j + i) * ni + k..][..K];
        for m in 0..K {
            out[m] = sum16(&sums[i][m][..per_block]);
        }
    }
}

/// Sums over blocks of the products of lanes `lane ..` of `J` rows of `dy` and `K` rows of `x`.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "an inner loop whose arguments are plain positions")]
fn outer_part<T: Real, const K: usize, const J: usize>(
    x: Rows<T::Scalar>,
    x_stride: usize,
    k: usize,
    dy: Rows<T::Scalar>,
    dy_stride: usize,
    j: usize,
    blocks: usize,
    lane: usize,
) -> [[T; K]; J] {
    // known to the compiler, which then checks no bounds below
    let lane = lane.min(BLOCK - T::LANES);
    let mut acc = [[T::zero(); K]; J];
    for (xb, db) in x.chunks_exact(x_stride).zip(dy.chunks_exact(dy_stride)).take(blocks) {
        let (xr, dr) = (&xb[k..k + K], &db[j..j + J]);
        let mut xv = [T::zero(); K];
        for i in 0..K {
            xv[i] = load(&xr[i], lane);
        }
        for i in 0..J {
            let d = load::<T>(&dr[i], lane);
            for m in 0..K {
                acc[i][m] = d.mul_add(xv[m], acc[i][m]);
            }
        }
    }
    acc
}

#[inline(always)]
fn bias_tile<T: Real, const J: usize>(
    dy: Rows<T::Scalar>,
    dy_stride: usize,
    j: usize,
    db: &mut [T::Scalar],
    blocks: usize,
) {
    let mut sums = [[T::zero(); BLOCK]; J];
    let per_block = BLOCK / T::LANES;
    for part in 0..per_block {
        let mut acc = [T::zero(); J];
        for b in 0..blocks {
            let row = &dy[b * dy_stride + j..][..J];
            for i in 0..J {
                acc[i] += load(&row[i], part * T::LANES);
            }
        }
        for i in 0..J {
            sums[i][part] = acc[i];
        }
    }
    for i in 0..J {
        db[j + i] = sum16(&sums[i][..per_block]);
    }
}
