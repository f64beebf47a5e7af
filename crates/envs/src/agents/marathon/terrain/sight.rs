//! Where a figure in space sees the ground.

/// A group of the observation, and its places: how far each is ahead of the figure and to its left, m.
pub type Sight = (&'static str, &'static [[f64; 2]]);

/// Around and ahead of the figure.
pub const AHEAD: Sight = ("ground_ahead", &grid::<45>(5, [-0.4, 0.6], [0.4, 0.3]));
/// Where a figure with long feet puts them in the next two steps, as fine as the ground itself. Between two points of the
/// other grid, an edge is hidden.
pub const CLOSE: Sight = ("ground_close", &grid::<51>(3, [0.0, 0.2], [0.1, 0.2]));

/// Rows of places from left to right, the farthest row last.
const fn grid<const N: usize>(columns: usize, first: [f64; 2], spacing: [f64; 2]) -> [[f64; 2]; N] {
    let (mut places, mut i) = ([[0.0; 2]; N], 0);
    while i < N {
        let [row, column] = [(i / columns) as f64, (i % columns) as f64];
        places[i] = [spacing[0] * row + first[0], first[1] - spacing[1] * column];
        i += 1;
    }
    places
}
