//! Terrain of the app: heights over a grid.

#[cfg(feature = "render")]
use bevy::asset::RenderAssetUsages;
#[cfg(feature = "render")]
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use marathon_physics::model::HField;
use std::sync::Arc;

/// Depth of solid ground below the lowest point, m.
const BASE: f32 = 1.0;
/// Largest height and side, m.
const LARGEST: f32 = 1e5;

/// Heights over a grid, for [`Obstacle::HeightField`](crate::Obstacle). The grid lies in the plane of the x and z axes, with its
/// center at the origin. Each cell is two flat triangles, split along the diagonal from its low x and high z to its high x and low
/// z.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_marathon::prelude::*;
/// fn build(mut commands: Commands) {
///     // 20 m x 20 m of hills, in cells of half a meter
///     let hills = HeightField::from_fn(Vec2::splat(20.0), [41, 41], |x, z| 0.1 * (x.sin() * z.sin()).abs());
///     commands.spawn(Obstacle::HeightField(hills));
/// }
/// ```
#[derive(Clone, Debug, PartialEq, Reflect)]
#[reflect(opaque)]
#[reflect(Clone, Debug, PartialEq)]
pub struct HeightField {
    size: Vec2,
    columns: usize,
    heights: Arc<[f32]>,
    /// Lowest and highest height and 0; `None` unless all are finite.
    range: Option<[f32; 2]>,
}

/// A field as the physics takes it, and what it was made from.
#[derive(Clone, Debug)]
pub(crate) struct LaneField {
    of: HeightField,
    scale: Vec3,
    field: Arc<HField>,
    radius: f32,
}

impl HeightField {
    /// Heights in m, row by row, over `size` meters along x and z. The first row is at the lowest z. Each goes from the lowest to
    /// the highest x.
    ///
    /// A field with fewer than two rows or columns or with an incomplete row is not felt as an obstacle. The same holds for one with a
    /// height or a side beyond 100 km. A scale of the entity counts.
    pub fn new(size: Vec2, columns: usize, heights: impl Into<Arc<[f32]>>) -> Self {
        let heights = heights.into();
        let finite = heights.iter().all(|y| y.is_finite());
        let range = || heights.iter().fold([0.0_f32; 2], |[low, high], y| [low.min(*y), high.max(*y)]);
        HeightField { size, columns, range: finite.then(range), heights }
    }

    /// The same from a function of x and z, m, at the points of a grid of so many columns and rows.
    pub fn from_fn(size: Vec2, [columns, rows]: [usize; 2], height: impl Fn(f32, f32) -> f32) -> Self {
        let heights = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        let heights = heights.map(|(row, column)| height(line(column, columns, size.x), line(row, rows, size.y)));
        HeightField::new(size, columns, heights.collect::<Vec<_>>())
    }

    /// Its extent along x and z, m.
    pub fn size(&self) -> Vec2 {
        self.size
    }

    /// The number of points along x and along z.
    pub fn points(&self) -> [usize; 2] {
        [self.columns, self.heights.len() / self.columns.max(1)]
    }

    /// Its heights as [`HeightField::new`] takes them, m.
    pub fn heights(&self) -> &[f32] {
        &self.heights
    }

    /// Its surface, to draw it (feature `render`).
    #[cfg(feature = "render")]
    pub fn mesh(&self) -> Mesh {
        let [columns, rows] = self.points();
        let points = (0..rows * columns).map(|i| {
            let (x, z) = (line(i % columns, columns, self.size.x), line(i / columns, rows, self.size.y));
            [x, self.heights[i], z]
        });
        let points: Vec<[f32; 3]> = points.collect();
        let uvs: Vec<[f32; 2]> = points.iter().map(|[x, _, z]| [*x, *z]).collect();
        let cells = (1..rows).flat_map(|row| (1..columns).map(move |column| (row * columns + column) as u32));
        let triangles = cells.flat_map(|high| {
            let [right, left] = [high - columns as u32, high - 1];
            let low = right - 1;
            [low, left, right, left, high, right]
        });
        let mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, points)
            .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, uvs)
            .with_inserted_indices(Indices::U32(triangles.collect()));
        if rows < 2 || columns < 2 { mesh } else { mesh.with_computed_smooth_normals() }
    }

    /// Half its sides and the depth of its bottom below the origin at a scale, m. `None` if it is no solid.
    pub(crate) fn extent(&self, scale: Vec3) -> Option<[f32; 3]> {
        let ([columns, rows], [low, high]) = (self.points(), self.range?);
        let half = 0.5 * self.size * scale.xz().abs();
        let depth = BASE - low * scale.y;
        let whole = columns > 1 && rows > 1 && columns * rows == self.heights.len();
        let sides = half.to_array().iter().all(|side| (1e-3..LARGEST).contains(side));
        let heights = scale.y > 1e-6 && depth < LARGEST && high * scale.y < LARGEST;
        (whole && sides && heights).then_some([half.x, half.y, depth])
    }

    /// As the physics takes it at a scale, and the radius of a ball around it. `None` if it is no solid. The scale along x is
    /// negative for a mirrored field.
    pub(crate) fn for_lanes(&self, scale: Vec3, last: &mut Option<LaneField>) -> Option<(Arc<HField>, f32)> {
        let same = |last: &&LaneField| {
            let (of, own) = (&last.of, &self.heights);
            Arc::ptr_eq(&of.heights, own) && (of.size, of.columns, last.scale) == (self.size, self.columns, scale)
        };
        if let Some(LaneField { field, radius, .. }) = last.as_ref().filter(same) {
            return Some((field.clone(), *radius));
        }
        *last = None;
        let ([ncol, nrow], [x, z, depth]) = (self.points(), self.extent(scale)?);
        // the physics has the rows along its y axis, which is -z
        let mut data: Vec<f32> = self.heights.chunks(ncol).rev().flatten().copied().collect();
        if scale.x < 0.0 {
            data.chunks_mut(ncol).for_each(<[f32]>::reverse);
        }
        let size = [x, z, scale.y, depth].map(f64::from);
        let field = Arc::new(HField { name: String::new(), nrow, ncol, size, data });
        let radius = Vec3::new(x, z, depth.max(self.range?[1] * scale.y)).length();
        *last = Some(LaneField { of: self.clone(), scale, field: field.clone(), radius });
        Some((field, radius))
    }
}

/// Coordinate of one of the lines of a grid along a side, m.
fn line(i: usize, count: usize, side: f32) -> f32 {
    side * (i as f32 / (count.max(2) - 1) as f32 - 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_has_the_axes_of_the_physics() {
        let field = HeightField::from_fn(Vec2::new(4.0, 2.0), [3, 2], |x, z| x - 10.0 * z);
        assert_eq!(field.heights(), [8.0, 10.0, 12.0, -12.0, -10.0, -8.0]);
        let mut last = None;
        let (lanes, radius) = field.for_lanes(Vec3::new(1.0, 2.0, 3.0), &mut last).expect("a solid");
        assert_eq!((lanes.nrow, lanes.ncol, lanes.size), (2, 3, [2.0, 3.0, 2.0, 25.0]));
        assert_eq!(lanes.data, [-12.0, -10.0, -8.0, 8.0, 10.0, 12.0]);
        assert_eq!(radius, Vec3::new(2.0, 3.0, 25.0).length());
        // made once
        let again = field.for_lanes(Vec3::new(1.0, 2.0, 3.0), &mut last).map(|(again, _)| again);
        assert!(again.is_some_and(|again| Arc::ptr_eq(&again, &lanes)));
        let mirrored = field.for_lanes(Vec3::new(-1.0, 1.0, 1.0), &mut last).map(|(field, _)| field.data.clone());
        assert_eq!(mirrored, Some(vec![-8.0, -10.0, -12.0, 12.0, 10.0, 8.0]));
        let larger = field.for_lanes(Vec3::ONE, &mut last).map(|(larger, _)| larger.size[2]);
        assert_eq!(larger, Some(1.0));
    }

    #[test]
    fn what_is_no_grid_is_no_solid() {
        let solid = |field: &HeightField| field.for_lanes(Vec3::ONE, &mut None).is_some();
        let (one, nan) = (Vec2::ONE, f32::NAN);
        assert!(solid(&HeightField::new(one, 2, [0.0; 4])));
        for (size, columns, heights) in [
            (one, 2, vec![0.0; 2]),
            (one, 2, vec![0.0; 5]),
            (one, 0, vec![0.0; 4]),
            (one, 4, vec![0.0; 4]),
            (one, 2, vec![0.0, 0.0, nan, 0.0]),
            (Vec2::new(1.0, 0.0), 2, vec![0.0; 4]),
            (Vec2::new(nan, 1.0), 2, vec![0.0; 4]),
            (-one, 2, vec![0.0; 4]),
            (one, 0, vec![]),
            (one, 2, vec![0.0, 0.0, 0.0, f32::MIN]),
            (one, 2, vec![3e38; 4]),
        ] {
            let field = HeightField::new(size, columns, heights);
            assert!(!solid(&field), "{field:?}");
            #[cfg(feature = "render")]
            let _ = field.mesh();
        }
    }

    #[cfg(feature = "render")]
    #[test]
    fn its_mesh_faces_up() {
        let mesh = HeightField::from_fn(Vec2::ONE, [4, 3], |x, z| 0.1 * x * z).mesh();
        let normals = mesh.attribute(Mesh::ATTRIBUTE_NORMAL).and_then(|values| values.as_float3()).expect("normals");
        assert_eq!(normals.len(), 12);
        assert!(normals.iter().all(|normal| normal[1] > 0.9), "{normals:?}");
        assert_eq!(mesh.indices().map(Indices::len), Some(36));
    }
}
