//! Environments on assault courses, and their ground.

use super::options as options_of;
use marathon_envs::{Autoreset, VecEnv, VecEnvOptions};

/// Agents of an environment.
pub const AGENTS: usize = 20;
/// First point of a course, m.
const FROM: f64 = -6.0;
/// Distance between points, m.
const CELL: f64 = 0.1;
/// Points along a course.
pub const POINTS: usize = 1121;
/// Distance between the rows of a course that varies along y, m.
const ROW: f64 = 0.5;
/// All figures.
pub const FIGURES: [&str; 4] = ["TerrainHopper-v0", "TerrainWalker2d-v0", "TerrainAnt-v0", "TerrainMarathonMan-v0"];

/// An environment of a task on courses.
pub fn env(id: &str, options: &[(&str, &str)], autoreset: Autoreset) -> VecEnv {
    let options =
        VecEnvOptions { agents: AGENTS, seed: 3, options: options_of(options), autoreset, ..Default::default() };
    VecEnv::new(id, &options).unwrap_or_else(|e| panic!("{e}"))
}

/// Whether a figure moves in space.
pub fn in_space(id: &str) -> bool {
    matches!(id, "TerrainAnt-v0" | "TerrainMarathonMan-v0")
}

/// Name of its torso.
pub fn torso(id: &str) -> &'static str {
    match id {
        "TerrainAnt-v0" => "torso_geom",
        "TerrainMarathonMan-v0" => "butt",
        _ => "torso",
    }
}

/// Height of the ground at a point, m. A cell of the grid is two triangles whose common side goes to the upper right.
pub fn height(ground: &[f32], x: f64, y: f64) -> f64 {
    let rows = ground.len() / POINTS;
    let row = if rows == 2 { 16.0 } else { ROW };
    let cell = |at: f64, points: usize| {
        let at = at.clamp(0.0, (points - 1) as f64);
        let i = (at as usize).min(points - 2);
        (i, at - i as f64)
    };
    let ((i, u), (j, v)) = (cell((x - FROM) / CELL, POINTS), cell(y / row + 0.5 * (rows - 1) as f64, rows));
    let z = |i: usize, j: usize| f64::from(ground[POINTS * j + i]);
    let (low, high) = (z(i, j), z(i + 1, j + 1));
    if u > v {
        low + u * (z(i + 1, j) - low) + v * (high - z(i + 1, j))
    } else {
        low + v * (z(i, j + 1) - low) + u * (high - z(i, j + 1))
    }
}
