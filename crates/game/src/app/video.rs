//! Videos without a window: every frame is as long as the last, drawn to an image, and written out. The same command gives
//! the same run, however slow the machine.

use crate::app::display::check_graphics;
use crate::app::error::GameError;
use crate::app::features::replay::record::save_running;
use crate::app::interrupt;
use crate::app::pacing::{IsVideo, TICKS};
use crate::app::stage::skin::{SkinState, generate_at_once};
use bevy::app::{PluginsState, TerminalCtrlCHandlerPlugin};
use bevy::asset::RenderAssetUsages;
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::gpu_readback::{Readback, ReadbackComplete};
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat, TextureUsages};
use bevy::time::TimeUpdateStrategy;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_marathon::look::FollowCamera;
use marathon_render::{Format, Image as Picture, Recorder};
use std::collections::VecDeque;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Frames before the first one of the video, in which the graphics card gets its data.
const WARM_UP: usize = 4;
/// Limit on the frames that a picture comes late.
const PATIENCE: usize = 200;

/// Time between two lines about how far the video is.
const REPORT: Duration = Duration::from_secs(5);

/// Longest time that a skin takes to read.
const LONGEST_FITTING: Duration = Duration::from_secs(120);

/// Pictures from the graphics card, oldest first.
#[derive(Resource, Default)]
struct Reel(VecDeque<Vec<u8>>);

/// The destination of the pictures.
enum Sink {
    Video(Recorder),
    /// The last one only.
    Png(PathBuf, Option<Picture>),
    Folder(PathBuf, usize),
}

impl Sink {
    fn new(path: &Path, fps: f64) -> Result<Self, GameError> {
        if path.extension().is_none() {
            std::fs::create_dir_all(path).map_err(|source| GameError::Write { path: path.into(), source })?;
            return Ok(Sink::Folder(path.into(), 0));
        }
        Ok(match Format::of(path)? {
            Format::Png => Sink::Png(path.into(), None),
            Format::Gif | Format::Mp4 => Sink::Video(Recorder::create(path, fps, 1)?),
        })
    }

    fn push(&mut self, picture: Picture) -> Result<(), GameError> {
        match self {
            Sink::Video(recorder) => recorder.push(&picture)?,
            Sink::Png(_, last) => *last = Some(picture),
            Sink::Folder(path, count) => {
                *count += 1;
                picture.save_png(path.join(format!("{count:05}.png")))?;
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<(), GameError> {
        match self {
            Sink::Video(recorder) => recorder.finish()?,
            Sink::Png(path, last) => match last {
                Some(picture) => picture.save_png(path)?,
                None => return Err(GameError::NoGraphics),
            },
            Sink::Folder(..) => {}
        }
        Ok(())
    }
}

/// A video to record.
pub struct Video<'a> {
    /// The file or folder.
    pub out: &'a Path,
    /// Width and height, pixels.
    pub size: (u32, u32),
    /// Frames per second.
    pub fps: f64,
    /// Seconds of the game before the first frame.
    pub start: f64,
    /// Length, s.
    pub seconds: f64,
}

/// Records a video of the game.
///
/// # Errors
/// If there are no graphics, or the video cannot be written.
pub fn record(video: &Video<'_>, game: impl Plugin) -> Result<(), GameError> {
    let Video { out, size: (width, height), fps, start, seconds } = *video;
    // before there is a file that a signal would leave behind
    interrupt::listen();
    let mut sink = Sink::new(out, fps)?;
    check_graphics()?;
    let frame = Duration::from_secs_f64(1.0 / fps);
    let mut app = windowless(game);
    // video time equals simulated time at any frame rate
    let longest = app.world().resource::<Time<Virtual>>().max_delta().max(frame);
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(longest);
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();

    let target = target(&mut app, width, height);
    // cameras are made at startup
    app.update();
    let mut cameras = app.world_mut().query_filtered::<Entity, With<FollowCamera>>();
    let cameras: Vec<Entity> = cameras.iter(app.world()).collect();
    for camera in &cameras {
        app.world_mut().entity_mut(*camera).insert(RenderTarget::Image(target.clone().into()));
    }

    let draw = |app: &mut App, on: bool| {
        for camera in &cameras {
            if let Some(mut camera) = app.world_mut().get_mut::<Camera>(*camera) {
                camera.is_active = on;
            }
        }
    };
    // frames before the video are not drawn; at least one tick, in which the characters come
    draw(&mut app, false);
    let before = (start / frame.as_secs_f64()).round() as usize;
    pace(&mut app, Duration::from_secs_f64(1.0 / TICKS));
    wait_for_skin(&mut app)?;
    let mut over = false;
    for _ in 0..before {
        pace(&mut app, frame);
        over = app.should_exit().is_some();
        if over || interrupt::requested() {
            break;
        }
    }
    draw(&mut app, true);
    (0..WARM_UP).for_each(|_| pace(&mut app, Duration::ZERO));
    let reader = app.world_mut().spawn(Readback::texture(target)).id();
    app.world_mut().entity_mut(reader).observe(|read: On<ReadbackComplete>, mut reel: ResMut<Reel>| {
        reel.0.push_back(read.data.clone());
    });

    let mut frames = ((seconds * fps).round() as usize).max(1);
    let (mut drawn, mut taken, mut waited) = (0, 0, 0);
    let mut reported: Option<Instant> = None;
    while taken < frames {
        if interrupt::requested() {
            save_running(app.world_mut());
            return Err(GameError::Interrupted(Some(out.into())));
        }
        // pictures arrive in their order, some frames late
        if drawn < frames {
            pace(&mut app, if drawn == 0 { Duration::ZERO } else { frame });
            drawn += 1;
            // a video ends when its game ends
            if over || app.should_exit().is_some() {
                frames = drawn;
            }
        } else {
            pace(&mut app, Duration::ZERO);
            waited += 1;
            if waited > PATIENCE {
                return Err(GameError::NoGraphics);
            }
        }
        while let Some(bytes) = app.world_mut().resource_mut::<Reel>().0.pop_front() {
            if taken < frames {
                sink.push(unpad(&bytes, width as usize, height as usize)?)?;
                taken += 1;
            }
        }
        if taken > 0 && reported.is_none_or(|at| at.elapsed() > REPORT) {
            reported = Some(Instant::now());
            let [done, all] = [taken, frames].map(|frames| frames as f64 / fps);
            eprintln!("{}: {done:.1} of {all:.1} s", out.display());
        }
    }
    save_running(app.world_mut());
    sink.finish()?;
    // the reader of a pipe may have closed it
    let _ = writeln!(std::io::stdout(), "wrote {}", out.display());
    Ok(())
}

/// The app without a window, whose time stands still.
fn windowless(game: impl Plugin) -> App {
    let mut app = App::new();
    let headless = WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    let render = RenderPlugin { synchronous_pipeline_compilation: true, ..default() };
    let log = bevy::log::LogPlugin { level: bevy::log::Level::WARN, ..default() };
    app.add_plugins(
        DefaultPlugins
            .set(headless)
            .set(render)
            .set(log)
            .disable::<WinitPlugin>()
            .disable::<TerminalCtrlCHandlerPlugin>()
            .disable::<PipelinedRenderingPlugin>(),
    )
    .add_plugins(game)
    .init_resource::<Reel>()
    .insert_resource(IsVideo)
    .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    generate_at_once(&mut app);
    app
}

/// A picture that cameras draw into.
fn target(app: &mut App, width: u32, height: u32) -> Handle<Image> {
    let size = Extent3d { width, height, depth_or_array_layers: 1 };
    let mut target = Image::new_fill(
        size,
        TextureDimension::D2,
        &[0; 4],
        TextureFormat::Rgba8UnormSrgb,
        RenderAssetUsages::default(),
    );
    target.texture_descriptor.usage =
        TextureUsages::COPY_SRC | TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
    app.world_mut().resource_mut::<Assets<Image>>().add(target)
}

/// Waits until the skins are worn. A thread reads them.
fn wait_for_skin(app: &mut App) -> Result<(), GameError> {
    let begun = Instant::now();
    loop {
        match app.world().resource::<SkinState>() {
            SkinState::Worn => return Ok(()),
            SkinState::Refused(problem) => return Err(GameError::System(problem.clone())),
            SkinState::Waiting if begun.elapsed() > LONGEST_FITTING => {
                let problem = format!("the skin takes more than {} s to read", LONGEST_FITTING.as_secs());
                return Err(GameError::System(problem));
            }
            SkinState::Waiting => {}
        }
        pace(app, Duration::ZERO);
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Updates the app after a step of time.
fn pace(app: &mut App, step: Duration) {
    app.insert_resource(TimeUpdateStrategy::ManualDuration(step));
    app.update();
}

/// Removes the padding of rows to 256 bytes, and alpha.
fn unpad(bytes: &[u8], width: usize, height: usize) -> Result<Picture, GameError> {
    let row = bytes.len() / height;
    let rgb = bytes.chunks_exact(row).flat_map(|row| row[..4 * width].chunks_exact(4)).flat_map(|p| [p[0], p[1], p[2]]);
    Ok(Picture::from_rgb(width, height, rgb.collect())?)
}
