//! Places that a camera must not enter: the ground and the fixed shapes of a ragdoll's model, and the obstacles of the app.

use crate::axes::place_to_game;
use crate::height_field::HeightField;
use crate::obstacle::Obstacle;
use crate::ragdoll::{Anatomy, OwnGround};
use bevy::math::Affine3A;
use bevy::prelude::*;
use marathon_physics::model::{Geom, GeomType, HField};

/// Solids whose two smaller sides are below this do not push a camera in, m: it would jump at every post that passes between it
/// and its target.
const THIN: f32 = 0.25;
/// Longest and shortest step of a cast, m.
const STEP: [f32; 2] = [0.1, 0.02];

/// The ground and the fixed shapes around a ragdoll, in the world's axes.
#[derive(Default)]
pub(crate) struct Obstacles<'a> {
    solids: Vec<Solid<'a>>,
}

/// A fixed shape.
struct Solid<'a> {
    /// From the world's axes to those of the shape, whose axis is y.
    inverse: Affine3A,
    shape: Shape<'a>,
    thin: bool,
}

/// Geometry of a [`Solid`], m.
enum Shape<'a> {
    /// Solid below y = 0.
    Plane,
    Sphere(f32),
    /// Radius, and half the length of the axis.
    Capsule(f32, f32),
    Cylinder(f32, f32),
    Ellipsoid(Vec3),
    Cuboid(Vec3),
    Field(Field<'a>),
}

/// A height field with its present elevations, m.
enum Field<'a> {
    Model { of: &'a HField, own: Option<&'a [f32]> },
    App { of: &'a HeightField, extent: [f32; 3], height: f32 },
}

impl<'a> Obstacles<'a> {
    /// Those of a ragdoll. `track` is the place of its track, `part` that of one of its bodies along it.
    pub fn of(
        anatomy: &'a Anatomy,
        own: Option<&'a OwnGround>,
        track: &Transform,
        part: impl Fn(Entity) -> Option<Transform>,
    ) -> Self {
        let model = &*anatomy.model;
        let fixed = model.geoms.iter().filter(|geom| model.bodies[geom.body].weld_id == 0 && is_there(geom));
        let solid = |geom: &'a Geom| {
            let shape = match geom.hfield.filter(|_| geom.kind == GeomType::Hfield) {
                Some(number) => {
                    let own = own.and_then(|own| own.0.get(number)).map(Vec::as_slice);
                    Shape::Field(Field::Model { of: model.hfields.get(number)?, own })
                }
                None => Shape::of(geom)?,
            };
            let body = if geom.body == 0 { Transform::default() } else { part(*anatomy.parts.get(geom.body)?)? };
            let place = *track * body * place_to_game(geom.pos, geom.quat);
            let thin = shape.sides().is_some_and(|[a, b, _]| a < THIN && b < THIN);
            Some(Solid { inverse: place.compute_affine().inverse(), shape, thin })
        };
        Obstacles { solids: fixed.filter_map(solid).collect() }
    }

    /// Adds obstacles of the app.
    pub fn add(&mut self, app: impl Iterator<Item = (&'a Obstacle, &'a GlobalTransform)>) {
        let solids = app.filter_map(|(obstacle, place)| {
            let (scale, rotation, translation) = place.to_scale_rotation_translation();
            let shape = Shape::of_app(obstacle, scale)?;
            let thin = shape.sides().is_some_and(|[a, b, _]| a < THIN && b < THIN);
            // all shapes but height fields are their own mirror image
            let mirror = Vec3::new(scale.x.signum(), 1.0, 1.0);
            let inverse = Affine3A::from_scale_rotation_translation(mirror, rotation, translation).inverse();
            Some(Solid { inverse, shape, thin })
        });
        self.solids.extend(solids);
    }

    /// Height of the highest ground (planes and height fields) within a level distance of a place, m. None without ground there.
    pub fn ground(&self, at: Vec3, around: f32) -> Option<f32> {
        let height = |solid: &Solid| match solid.shape {
            Shape::Plane | Shape::Field(_) => {
                solid.clearance(at, around).is_finite().then(|| at.y - solid.clearance(at, around))
            }
            _ => None,
        };
        self.solids.iter().filter_map(height).max_by(f32::total_cmp)
    }

    /// Distance to the nearest solid, m; negative inside. Above a height field it is the height over its highest point within
    /// `around`.
    pub fn clearance(&self, at: Vec3, around: f32) -> f32 {
        self.solids.iter().map(|solid| solid.clearance(at, around)).fold(f32::INFINITY, f32::min)
    }

    /// Moves a sphere from one place towards another. Returns how far it gets before it touches a solid, m. At the start the sphere
    /// is as small as it must be to be free.
    pub fn cast(&self, from: Vec3, to: Vec3, radius: f32) -> f32 {
        let Some((way, length)) = (to - from).try_normalize().map(|way| (way, from.distance(to))) else { return 0.0 };
        let thick = |at: Vec3| {
            let thick = self.solids.iter().filter(|solid| !solid.thin);
            thick.map(|solid| solid.clearance(at, radius)).fold(f32::INFINITY, f32::min)
        };
        let radius_there = radius.min(thick(from));
        let mut gone = 0.0;
        while gone < length {
            let next = (gone + (thick(from + gone * way) - radius_there).clamp(STEP[1], STEP[0])).min(length);
            // a sphere that starts at a wall may move along it
            if thick(from + next * way) < radius_there - 1e-4 {
                break;
            }
            gone = next;
        }
        // a post is no reason to come closer, unless the sphere would end in it
        while gone > 0.0 && self.clearance(from + gone * way, radius) < 0.5 * radius_there {
            gone = (gone - STEP[1]).max(0.0);
        }
        gone
    }
}

/// Whether a geom collides or is seen.
fn is_there(geom: &Geom) -> bool {
    geom.rgba[3] > 0.0 || geom.contype != 0 || geom.conaffinity != 0
}

impl<'a> Shape<'a> {
    /// The shape of an obstacle of the app at a scale. None for one that nothing feels.
    fn of_app(obstacle: &'a Obstacle, scale: Vec3) -> Option<Self> {
        if let Obstacle::HeightField(of) = obstacle {
            let extent = of.extent(scale)?;
            return Some(Shape::Field(Field::App { of, extent, height: scale.y }));
        }
        obstacle.shape(scale, &mut None)?;
        let scale = scale.abs();
        Some(match *obstacle {
            Obstacle::Sphere { radius } => Shape::Sphere(radius * scale.max_element()),
            Obstacle::Capsule { radius, half_length } => {
                Shape::Capsule(radius * scale.x.max(scale.z), half_length * scale.y)
            }
            Obstacle::Cuboid { half_size } => Shape::Cuboid(half_size * scale),
            Obstacle::HeightField(_) => return None,
        })
    }

    /// The shape of a geom other than a height field. None for meshes, which nothing collides with.
    fn of(geom: &Geom) -> Option<Self> {
        let [x, y, z] = geom.size.map(|side| side as f32);
        Some(match geom.kind {
            GeomType::Plane => Shape::Plane,
            GeomType::Sphere => Shape::Sphere(x),
            GeomType::Capsule => Shape::Capsule(x, y),
            GeomType::Cylinder => Shape::Cylinder(x, y),
            GeomType::Ellipsoid => Shape::Ellipsoid(Vec3::new(x, z, y)),
            GeomType::Box => Shape::Cuboid(Vec3::new(x, z, y)),
            GeomType::Hfield | GeomType::Mesh => return None,
        })
    }

    /// Its sides, shortest first. None for grounds.
    fn sides(&self) -> Option<[f32; 3]> {
        let half = match *self {
            Shape::Plane | Shape::Field(_) => return None,
            Shape::Sphere(r) => Vec3::splat(r),
            Shape::Capsule(r, half) => Vec3::new(r, half + r, r),
            Shape::Cylinder(r, half) => Vec3::new(r, half, r),
            Shape::Ellipsoid(half) | Shape::Cuboid(half) => half,
        };
        let mut sides = (2.0 * half).to_array();
        sides.sort_by(f32::total_cmp);
        Some(sides)
    }
}

impl Solid<'_> {
    /// Distance to a place, m; negative inside.
    fn clearance(&self, at: Vec3, around: f32) -> f32 {
        let p = self.inverse.transform_point3(at);
        // https://iquilezles.org/articles/distfunctions
        match &self.shape {
            Shape::Plane => p.y,
            Shape::Sphere(r) => p.length() - r,
            Shape::Capsule(r, half) => p.with_y(p.y - p.y.clamp(-half, *half)).length() - r,
            Shape::Cylinder(r, half) => {
                let d = Vec2::new(p.xz().length() - r, p.y.abs() - half);
                d.max(Vec2::ZERO).length() + d.max_element().min(0.0)
            }
            // a lower bound
            Shape::Ellipsoid(half) => ((p / *half).length() - 1.0) * half.min_element(),
            Shape::Cuboid(half) => {
                let d = p.abs() - *half;
                d.max(Vec3::ZERO).length() + d.max_element().min(0.0)
            }
            Shape::Field(field) => field.clearance(p, around),
        }
    }
}

impl Field<'_> {
    /// Height above the highest point within `around`, or depth below the base, m; infinity beside the field.
    fn clearance(&self, p: Vec3, around: f32) -> f32 {
        // the rows of a model's field go along MuJoCo's y
        let (along, half, [columns, rows], base) = match self {
            Field::Model { of, .. } => {
                let [x, y, _, base] = of.size.map(|side| side as f32);
                (-p.z, [x, y], [of.ncol, of.nrow], -base)
            }
            Field::App { of, extent: [x, z, depth], .. } => (p.z, [*x, *z], of.points(), -depth),
        };
        let (rows, columns) = (span(along, half[1], rows, around), span(p.x, half[0], columns, around));
        let (Some(rows), Some(columns)) = (rows, columns) else { return f32::INFINITY };
        let top = rows.flat_map(|row| columns.clone().map(move |column| self.height(row, column)));
        let top = top.fold(f32::NEG_INFINITY, f32::max);
        (p.y - top).max(base - p.y)
    }

    fn height(&self, row: usize, column: usize) -> f32 {
        match *self {
            Field::Model { of, own } => elevation(of, own, row, column),
            Field::App { of, height, .. } => {
                height * of.heights().get(row * of.points()[0] + column).copied().unwrap_or_default()
            }
        }
    }
}

/// Elevation of a point of a field, m: its own, or else that of the model.
pub(crate) fn elevation(field: &HField, own: Option<&[f32]>, row: usize, column: usize) -> f32 {
    let i = row * field.ncol + column;
    let own = own.and_then(|own| own.get(i)).copied();
    own.unwrap_or_else(|| field.size[2] as f32 * field.data.get(i).copied().unwrap_or_default())
}

/// The points of a side of a field whose cells reach within `around` of a place. None beside the field.
fn span(at: f32, half: f32, points: usize, around: f32) -> Option<std::ops::RangeInclusive<usize>> {
    let last = points.checked_sub(1).filter(|last| *last > 0)?;
    let point = |x: f32| (x + half) / (2.0 * half) * last as f32;
    let (low, high) = (point(at - around), point(at + around));
    // numbers that are not finite are beside the field, too
    (high >= 0.0 && low <= last as f32).then(|| (low.max(0.0) as usize)..=(high.ceil() as usize).min(last))
}

#[cfg(test)]
mod tests {
    use super::*;
    use marathon_physics::Model;
    use std::sync::Arc;

    fn anatomy(world: &str) -> Result<Anatomy, Box<dyn std::error::Error>> {
        let text = format!("<mujoco>{world}</mujoco>");
        let model = Arc::new(Model::from_xml_str(&text, "room")?);
        Ok(Anatomy { model, spec: None, parts: Vec::new(), feet: Vec::new(), dt: 0.01 })
    }

    #[test]
    fn a_sphere_stops_at_walls_and_passes_posts() -> Result<(), Box<dyn std::error::Error>> {
        let room = anatomy(
            "<worldbody><geom type='plane' size='0 0 1'/>
             <geom type='box' pos='3 0 1' size='.2 2 1'/>
             <geom type='capsule' fromto='-2 0 0 -2 0 3' size='.05'/></worldbody>",
        )?;
        let track = Transform::from_xyz(10.0, 0.0, 0.0);
        let all = Obstacles::of(&room, None, &track, |_| None);
        let from = Vec3::new(10.0, 1.0, 0.0);
        let cast = |way: Vec3| all.cast(from, from + way, 0.2);
        assert!((cast(5.0 * Vec3::X) - 2.6).abs() < 0.03, "{}", cast(5.0 * Vec3::X));
        assert!((cast(2.0 * Vec3::NEG_Y) - 0.8).abs() < 0.03);
        // behind a post, not in it
        assert_eq!(cast(-4.0 * Vec3::X), 4.0);
        assert!((1.7..1.9).contains(&cast(-2.0 * Vec3::X)), "{}", cast(-2.0 * Vec3::X));
        assert_eq!(all.ground(from, 0.2), Some(0.0));
        Ok(())
    }

    #[test]
    fn obstacles_of_the_app_are_avoided() {
        let hill = HeightField::from_fn(Vec2::splat(4.0), [5, 5], |x, _| if x < 0.0 { 0.0 } else { 1.0 });
        let app = [
            (Obstacle::Cuboid { half_size: Vec3::new(0.5, 1.0, 1.0) }, GlobalTransform::from_xyz(-3.0, 1.0, 0.0)),
            (Obstacle::HeightField(hill), GlobalTransform::from(Transform::from_scale(Vec3::new(1.0, 2.0, 1.0)))),
            (Obstacle::Sphere { radius: f32::NAN }, GlobalTransform::from_xyz(0.0, 1.0, 0.0)),
        ];
        let mut all = Obstacles::default();
        all.add(app.iter().map(|(obstacle, place)| (obstacle, place)));
        let from = Vec3::new(-1.5, 1.0, 0.0);
        assert!((all.cast(from, from - 2.0 * Vec3::X, 0.2) - 0.8).abs() < 0.03);
        assert!(all.cast(from, from + 3.0 * Vec3::X, 0.2) < 1.0);
        assert_eq!([1.0, -1.9].map(|x| all.ground(Vec3::new(x, 3.0, 1.0), 0.05)), [Some(2.0), Some(0.0)]);
    }

    #[test]
    fn a_step_of_a_height_field_is_ground() -> Result<(), Box<dyn std::error::Error>> {
        let stairs = anatomy(
            "<asset><hfield name='f' nrow='2' ncol='5' size='2 1 .5 1' elevation='0 0 0 1 1 0 0 0 1 1'/></asset>
             <worldbody><geom type='hfield' hfield='f' pos='0 0 .1'/></worldbody>",
        )?;
        let all = Obstacles::of(&stairs, None, &Transform::default(), |_| None);
        let ground = |x: f32| all.ground(Vec3::new(x, 3.0, 0.5), 0.2);
        assert_eq!(ground(-1.5).map(|y| (1e3 * y).round()), Some(100.0));
        assert_eq!(ground(1.5).map(|y| (1e3 * y).round()), Some(600.0));
        assert_eq!(ground(2.5), None);
        // the app's own elevations go before those of the model
        let own = OwnGround(Arc::new(vec![vec![0.2; 10]]));
        let all = Obstacles::of(&stairs, Some(&own), &Transform::default(), |_| None);
        assert!((all.ground(Vec3::Y, 0.1).unwrap_or_default() - 0.3).abs() < 1e-5);
        Ok(())
    }
}
