//! A frame prepared for one camera: the candidate solids of each tile of the picture, each light ray and each spot.

use glam::DVec3;

use crate::bins::{Bins, Rect};
use crate::camera::{Basis, Camera};
use crate::ground::Ground;
use crate::light::Light;
use crate::scene::Frame;
use crate::shape::Solid;

/// Side of a screen tile, pixels.
const TILE: usize = 16;
/// Reach of ambient occlusion in radii of the occluding rod.
pub(crate) const OCCLUSION_REACH: f64 = 4.0;
/// Maximum number of translucent surfaces along a ray.
const LAYERS: usize = 6;

/// A simplified solid for soft effects.
#[derive(Clone, Copy)]
pub(crate) struct Rod {
    pub a: DVec3,
    pub b: DVec3,
    pub radius: f64,
}

pub(crate) struct View<'a> {
    pub frame: &'a Frame,
    pub basis: Basis,
    pub ground: Ground,
    pub light: Light,
    pub rods: Vec<Rod>,
    size: [usize; 2],
    tiles: Bins,
    shadows: Bins,
    nearby: Bins,
}

/// Result of a ray, before tone mapping.
#[derive(Clone, Copy)]
pub(crate) struct Sample {
    pub color: DVec3,
    /// Index of a solid plus a base. Planes and the sky have small numbers.
    pub id: u32,
    /// Fraction of the sun that reaches a plane; 1 elsewhere.
    pub sun: f32,
}

/// Ids of [`Sample`]: the sky, then planes, then solids.
pub(crate) const SKY_ID: u32 = 0;
pub(crate) const FIRST_PLANE: u32 = 1;

impl<'a> View<'a> {
    pub fn new(frame: &'a Frame, camera: &Camera, size: [usize; 2]) -> Self {
        let basis = camera.basis();
        let light = Light::new();
        let solids = &frame.solids;

        let count = size.map(|side| side.div_ceil(TILE));
        let area = [[0.0; 2], count.map(|n| (n * TILE) as f64)];
        let seen: Vec<Rect> = solids.iter().map(|solid| screen_rect(solid, &basis, size)).collect();

        let floor = frame.planes.iter().map(|plane| plane.pos.z).fold(f64::INFINITY, f64::min);
        let shadows: Vec<Rect> = solids.iter().map(|solid| light.shadow_rect(solid, floor)).collect();

        let rods: Vec<Rod> = solids
            .iter()
            .map(|solid| {
                let (a, b, radius) = solid.soft_rod();
                Rod { a, b, radius }
            })
            .collect();
        let nearby: Vec<Rect> = rods
            .iter()
            .map(|rod| {
                let (low, high) = (rod.a.min(rod.b), rod.a.max(rod.b));
                let reach = OCCLUSION_REACH * rod.radius;
                [[low.x - reach, low.y - reach], [high.x + reach, high.y + reach]]
            })
            .collect();

        Self {
            frame,
            basis,
            ground: Ground::new(frame.marks),
            light,
            rods,
            size,
            tiles: Bins::new(&seen, area, count),
            shadows: Bins::covering(&shadows, 96),
            nearby: Bins::covering(&nearby, 64),
        }
    }

    /// Solids that may shade a point from the sun.
    #[inline]
    pub fn shadow_candidates(&self, p: DVec3) -> &[u32] {
        let [u, v] = self.light.project(p);
        self.shadows.at(u, v)
    }

    /// Solids close enough to a point to darken its ambient light.
    #[inline]
    pub fn nearby(&self, p: DVec3) -> &[u32] {
        self.nearby.at(p.x, p.y)
    }

    /// First id of a solid.
    pub fn first_solid(&self) -> u32 {
        FIRST_PLANE + self.frame.planes.len() as u32
    }

    /// The light along the ray through picture coordinates `(x, y)`, for a sample that represents a square with sides
    /// of `share` pixels.
    pub fn sample(&self, x: f64, y: f64, share: f64) -> Sample {
        let basis = &self.basis;
        let pixel = 2.0 * basis.slope / self.size[1] as f64;
        let sx = (x - 0.5 * self.size[0] as f64) * pixel;
        let sy = (0.5 * self.size[1] as f64 - y) * pixel;
        // not normalized: its derivatives per pixel are then `right` and `up` times the pixel's size
        let ray = basis.forward + sx * basis.right + sy * basis.up;
        let length = ray.length();
        let d = ray / length;

        let mut sample = Sample { color: DVec3::ZERO, id: SKY_ID, sun: 1.0 };
        let mut through = 1.0;
        let candidates = self.tiles.at(x, y);
        let (mut start, mut haunted) = (0.0, false);
        for layer in 0..LAYERS {
            let hit = self.nearest(basis.eye, d, start, candidates, haunted);
            let (color, alpha, id, sun) = match hit {
                None => (self.light.sky(d), 1.0, SKY_ID, 1.0),
                Some((t, Surface::Plane(index))) => {
                    let (color, sun) = self.plane_color(index, t, d, ray, pixel * share);
                    (color, 1.0, FIRST_PLANE + index as u32, sun)
                }
                Some((t, Surface::Solid(index, normal))) => {
                    let p = basis.eye + t * d;
                    let color = self.solid_color(index, p, normal, d, t);
                    haunted |= self.frame.solids[index].ghost;
                    (color, self.frame.solids[index].alpha, self.first_solid() + index as u32, 1.0)
                }
            };
            if layer == 0 {
                (sample.id, sample.sun) = (id, sun);
            }
            sample.color += through * alpha * color;
            through *= 1.0 - alpha;
            let Some((t, _)) = hit.filter(|_| through > 0.01) else { break };
            start = t * (1.0 + 1e-9) + 1e-9;
        }
        sample
    }

    /// Nearest surface beyond `start`. Ghosts count only if none has been hit yet.
    #[inline]
    fn nearest(&self, o: DVec3, d: DVec3, start: f64, candidates: &[u32], haunted: bool) -> Option<(f64, Surface)> {
        let mut best: Option<(f64, Surface)> = None;
        let closer = |t: f64, best: &Option<(f64, Surface)>| t > start && best.as_ref().is_none_or(|b| t < b.0);
        for (index, plane) in self.frame.planes.iter().enumerate() {
            if let Some(t) = plane.enter(o, d).filter(|&t| closer(t, &best)) {
                best = Some((t, Surface::Plane(index)));
            }
        }
        for &index in candidates {
            let solid = &self.frame.solids[index as usize];
            if !(haunted && solid.ghost)
                && let Some((t, normal)) = solid.enter(o, d)
                && closer(t, &best)
            {
                best = Some((t, Surface::Solid(index as usize, normal)));
            }
        }
        best
    }
}

#[derive(Clone, Copy)]
enum Surface {
    Plane(usize),
    Solid(usize, DVec3),
}

/// Bounds of a solid in picture coordinates, a pixel larger than needed.
fn screen_rect(solid: &Solid, basis: &Basis, size: [usize; 2]) -> Rect {
    let everywhere = [[0.0; 2], size.map(|side| side as f64)];
    let (a, b, radius) = solid.hull_rod();
    // flat ends only extend beyond the rod's straight part sideways, so two balls and their hull contain the solid
    let mut rect = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    let scale = 0.5 * size[1] as f64 / basis.slope;
    for end in [a, b] {
        let p = end - basis.eye;
        let depth = p.dot(basis.forward);
        if depth <= 1.01 * radius {
            return if depth < -radius && (b - a).length() == 0.0 { [[-1.0; 2]; 2] } else { everywhere };
        }
        for (i, side) in [p.dot(basis.right), -p.dot(basis.up)].into_iter().enumerate() {
            // tangents to the ball's circle in the plane of this axis and the view direction
            let square = depth * depth - radius * radius;
            let root = radius * (side * side + square).sqrt();
            let center = 0.5 * size[i] as f64;
            rect[0][i] = rect[0][i].min(center + scale * (side * depth - root) / square - 1.0);
            rect[1][i] = rect[1][i].max(center + scale * (side * depth + root) / square + 1.0);
        }
    }
    rect
}
