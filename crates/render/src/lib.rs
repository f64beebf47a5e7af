//! Draws a gait without a GPU: a small ray caster that turns `qpos` into PNG, strips, GIF and MP4.
//!
//! ```no_run
//! use marathon_render::{Corner, Follow, Recorder, Renderer, Scene, status_line};
//! # fn video(model: &marathon_physics::Model, gait: &[Vec<f64>], speed: f64) -> Result<(), marathon_render::RenderError> {
//! let scene = Scene::new(model);
//! let renderer = Renderer::new(640, 360)?;
//! let mut camera = Follow::new(&scene, 1, 640, 360);
//! let mut video = Recorder::create("run.gif", 25.0, 8)?;
//! for (i, qpos) in gait.iter().enumerate() {
//!     let frame = scene.frame(&[qpos])?;
//!     let mut image = renderer.render(&frame, &camera.update(&frame, 1.0 / 25.0));
//!     let at = frame.agents()[0].com[0];
//!     image.caption(Corner::TopLeft, &[status_line(i as f64 / 25.0, at, speed)]);
//!     video.push(&image)?;
//! }
//! video.finish()
//! # }
//! ```
//!
//! A picture only depends on its inputs: not on the number of threads or the platform's math library.

mod animation;
mod atomic;
mod bins;
mod boxes;
mod camera;
mod error;
mod font;
mod ground;
mod image;
mod kinematics;
mod light;
mod mesh;
mod mp4;
mod palette;
mod recorder;
mod render;
mod scene;
mod shade;
mod shape;
mod terrain;
mod view;

pub use animation::GifWriter;
pub use camera::{Camera, Follow};
pub use error::RenderError;
pub use image::{Corner, Image, MAX_SIDE, status_line, strip, strip_size};
pub use kinematics::{BodyPose, GeomPose, Pose};
pub use mp4::Mp4Writer;
pub use recorder::{Format, Recorder};
pub use render::{Antialias, Renderer};
pub use scene::{AgentView, Frame, GhostPlace, Scene};
pub use shape::{Hit, Shape};
