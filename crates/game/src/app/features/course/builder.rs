//! The builder's role: mouse, wheel and keys choose how much higher or lower the next meter leads, and a mark shows where it
//! will be.

use crate::app::features::course::runs::Runs;
use crate::app::input::actions::{Action, ActionPressed};
use crate::app::mode::{AppSet, Mode};
use crate::app::stage::actors::{Actor, Focus};
use crate::app::stage::scenario::{LoadScenario, Scenario};
use bevy::input::mouse::{AccumulatedMouseScroll, MouseScrollUnit};
use bevy::prelude::*;
use bevy::window::PrimaryWindow;
use bevy_egui::input::EguiWantsInput;
use bevy_marathon::axes::to_game;
use bevy_marathon::look::FollowCamera;
use bevy_marathon::{Anatomy, Episode, Held, OwnGround, Track};
use marathon_envs::agents::marathon::terrain::course::{CELL, FARTHEST, FROM, LEVEL_TO, POINTS};

/// Steps up, and as many down.
pub const MOST_STEPS: i32 = 10;
/// Height of a step at difficulty 1, m.
const STEP: f64 = 0.1;
/// Pixels that a touchpad scrolls for a step.
const PIXELS: f32 = 30.0;
/// Half the width of the mark, m.
const HALF_WIDTH: f64 = 0.45;

const CHOSEN: Color = Color::srgb(1.0, 0.62, 0.25);
const POSSIBLE: Color = Color::srgb(0.75, 0.8, 0.86);

/// The chosen step, from -10 to 10. It holds for each next meter until another one is chosen.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Step(pub i32);

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Step>()
        .add_systems(
            Update,
            (reset.run_if(on_message::<LoadScenario>).run_if(in_state(Mode::Course)), choose, hold.run_if(is_built))
                .chain()
                .in_set(AppSet::Present),
        )
        .add_systems(PostUpdate, mark.run_if(is_built).after(TransformSystems::Propagate));
}

fn is_built(scenario: Res<Scenario>) -> bool {
    scenario.is_built()
}

/// A course begins level.
fn reset(mut step: ResMut<Step>) {
    step.set_if_neq(Step::default());
}

/// The place of the next meter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Its start along the track, m.
    pub from: f64,
    /// Height there, m above the start.
    pub height: f64,
    /// Height of a step, m.
    pub step: f64,
}

impl Site {
    /// The next meter of a course that is being built; `start` is where the runner's torso was at the start.
    pub fn of(farthest: f64, start: f64, ground: &[f32], difficulty: f64) -> Option<Self> {
        // the first one is built at once, and then one for each meter that the runner has made
        let from = LEVEL_TO + 1.0 + (farthest - start).max(0.0).floor();
        let at = ((from - FROM) / CELL).round() as usize;
        let height = f64::from(*ground.get(..POINTS)?.get(at)?);
        Some(Site { from, height, step: STEP * difficulty })
    }

    /// Height at which a step would end, m.
    pub fn end(&self, step: i32) -> f64 {
        (self.height + f64::from(step) * self.step).clamp(-FARTHEST, FARTHEST)
    }

    /// The step that ends nearest to a height, m.
    pub fn step_to(&self, height: f64) -> i32 {
        if self.step <= 0.0 {
            return 0;
        }
        let steps = ((height - self.height) / self.step).round();
        steps.clamp(f64::from(-MOST_STEPS), f64::from(MOST_STEPS)) as i32
    }
}

/// Height at which a ray meets the vertical plane of a track, m above its start.
fn height_at(ray: Ray3d, track: Vec3) -> Option<f64> {
    let distance = ray.intersect_plane(track, InfinitePlane3d::new(Vec3::Z))?;
    Some(f64::from((ray.get_point(distance) - track).y))
}

/// The site ahead of the character in focus.
fn site<'a>(
    scenario: &Scenario,
    runs: &Runs,
    focus: &Focus,
    mut actors: impl Iterator<Item = (Entity, &'a Actor, &'a Anatomy, &'a Episode, &'a OwnGround, &'a Track)>,
) -> Option<(Site, Transform)> {
    let (ragdoll, _, anatomy, episode, ground, track) = actors.find(|(_, actor, ..)| actor.0 == focus.0)?;
    let spec = anatomy.spec.as_ref()?;
    let farthest = spec.info.iter().position(|name| name == "distance").and_then(|i| episode.info.get(i));
    let start = runs.start(ragdoll).unwrap_or_default();
    let farthest = farthest.map_or(start, |x| f64::from(*x));
    Some((Site::of(farthest, start, ground.0.first()?, scenario.course.difficulty)?, track.place()))
}

/// Sets the step by mouse and keys.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
fn choose(
    mut actions: MessageReader<ActionPressed>,
    buttons: Res<ButtonInput<MouseButton>>,
    scroll: Res<AccumulatedMouseScroll>,
    wants: Option<Res<EguiWantsInput>>,
    (scenario, focus, runs): (Res<Scenario>, Res<Focus>, Res<Runs>),
    window: Query<&Window, With<PrimaryWindow>>,
    camera: Query<(&Camera, &GlobalTransform), With<FollowCamera>>,
    actors: Query<(Entity, &Actor, &Anatomy, &Episode, &OwnGround, &Track)>,
    mut scrolled: Local<f32>,
    mut step: ResMut<Step>,
) {
    let asked = actions.read().fold(step.0, |step, ActionPressed(action)| match action {
        Action::Higher => step + 1,
        Action::Lower => step - 1,
        Action::Even => 0,
        _ => step,
    });
    // actions are read in every mode, so that none waits for the next course
    if !scenario.is_built() {
        return;
    }
    let mut chosen = asked;
    if !wants.is_some_and(|w| w.wants_any_pointer_input()) {
        *scrolled += match scroll.unit {
            MouseScrollUnit::Line => scroll.delta.y,
            MouseScrollUnit::Pixel => scroll.delta.y / PIXELS,
        };
        chosen += *scrolled as i32;
        *scrolled -= scrolled.trunc();
        let cursor =
            window.iter().next().and_then(Window::cursor_position).filter(|_| buttons.pressed(MouseButton::Left));
        let ray = cursor.zip(camera.iter().next()).and_then(|(cursor, (c, at))| c.viewport_to_world(at, cursor).ok());
        if let Some((ray, (site, track))) = ray.zip(site(&scenario, &runs, &focus, actors.iter()))
            && let Some(height) = height_at(ray, track.translation)
        {
            chosen = site.step_to(height);
        }
    }
    step.set_if_neq(Step(chosen.clamp(-MOST_STEPS, MOST_STEPS)));
}

/// Hands the chosen step to the builder of each character: the last of its actions.
fn hold(step: Res<Step>, mut actors: Query<&mut Held, With<Actor>>) {
    let action = Some(step.0 as f32 / MOST_STEPS as f32);
    for mut held in &mut actors {
        if held.0.last().is_some_and(|last| *last != action)
            && let Some(last) = held.0.last_mut()
        {
            *last = action;
        }
    }
}

/// Draws where the next meter will be: the chosen step, and how far up and down it can go.
fn mark(
    (scenario, focus, runs, step): (Res<Scenario>, Res<Focus>, Res<Runs>, Res<Step>),
    actors: Query<(Entity, &Actor, &Anatomy, &Episode, &OwnGround, &Track)>,
    mut gizmos: Gizmos,
) {
    let Some((site, track)) = site(&scenario, &runs, &focus, actors.iter()) else { return };
    let point = |x: f64, y: f64, z: f64| track.transform_point(to_game([x, y, z])) + Vec3::Y * 0.015;
    let (near, far) = (site.from, site.from + 1.0);
    let outline = |end: f64| {
        let [a, b] = [(near, site.height), (far, end)];
        [(a, -HALF_WIDTH), (b, -HALF_WIDTH), (b, HALF_WIDTH), (a, HALF_WIDTH), (a, -HALF_WIDTH)]
            .map(|((x, z), y)| point(x, y, z))
    };
    for extreme in [-MOST_STEPS, MOST_STEPS] {
        let end = site.end(extreme);
        gizmos.line(point(far, -HALF_WIDTH, end), point(far, HALF_WIDTH, end), POSSIBLE);
    }
    for side in [-HALF_WIDTH, HALF_WIDTH] {
        gizmos.line(point(far, side, site.end(-MOST_STEPS)), point(far, side, site.end(MOST_STEPS)), POSSIBLE);
    }
    gizmos.linestrip(outline(site.end(step.0)), CHOSEN);
    let [_, from, to, ..] = outline(site.end(step.0));
    let middle = from.midpoint(to);
    gizmos.arrow(middle + Vec3::Y * 0.6, middle, CHOSEN).with_tip_length(0.15);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_site_is_six_meters_ahead_of_the_meters_made() {
        let mut ground = vec![0.0; 2 * POINTS];
        let at = |x: f64| ((x - FROM) / CELL).round() as usize;
        ground[at(6.0)..].fill(0.3);
        let site = |farthest| Site::of(farthest, 0.01, &ground, 0.5);
        assert_eq!(site(0.0), Some(Site { from: 6.0, height: f64::from(0.3_f32), step: 0.05 }));
        assert_eq!(site(1.005).map(|site| site.from), Some(6.0));
        assert_eq!(site(3.02).map(|site| site.from), Some(9.0));
        assert_eq!(site(1e9), None);
        assert_eq!(Site::of(0.0, 0.0, &[], 0.5), None);
    }

    #[test]
    fn a_height_becomes_one_of_21_steps() {
        let site = Site { from: 6.0, height: 1.0, step: 0.05 };
        for (height, step) in [(1.0, 0), (1.06, 1), (0.7, -6), (9.0, 10), (-9.0, -10)] {
            assert_eq!(site.step_to(height), step, "{height}");
        }
        assert_eq!((site.end(10), Site { height: 3.9, ..site }.end(10)), (1.5, FARTHEST));
        assert_eq!(Site { step: 0.0, ..site }.step_to(2.0), 0);
    }

    #[test]
    fn a_ray_meets_the_plane_of_the_track() {
        let ray = |direction: Vec3| Ray3d::new(Vec3::new(2.0, 3.0, 5.0), Dir3::new(direction).unwrap());
        let height = |direction| height_at(ray(direction), Vec3::new(0.0, 0.5, -1.0));
        assert!((height(Vec3::NEG_Z).unwrap() - 2.5).abs() < 1e-6);
        assert!((height(Vec3::new(0.0, -1.0, -6.0)).unwrap() - 1.5).abs() < 1e-5);
        assert_eq!(height(Vec3::Z), None);
    }
}
