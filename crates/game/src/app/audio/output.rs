//! Output of sounds to the sound card. Without one, the game is silent.

use crate::app::audio::PlaySound;
use crate::app::audio::synth::{RATE, Sound};
use crate::app::mode::AppSet;
use crate::app::settings::values::Volumes;
use bevy::prelude::*;
use bevy::window::PrimaryWindow;
use bevy_audio::{
    AddAudioSource, AudioPlayer, AudioPlugin, ChannelCount, Decodable, PlaybackSettings, Sample, SampleRate, Source,
    Volume,
};
use bevy_marathon::look::FollowCamera;
use std::num::NonZero;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// Sounds that are heard at once; more are left out.
const VOICES: usize = 12;
/// Distance at which a sound is half as loud as at its source, m.
const HALF: f32 = 7.0;
/// Loudness below which a sound is left out.
const INAUDIBLE: f32 = 0.01;

/// Samples of a sound, one channel.
#[derive(Asset, TypePath, Clone)]
struct Clip(Arc<[f32]>);

/// The sounds, in the order of [`Sound::ALL`], each with its variants.
#[derive(Resource)]
struct Clips(Vec<Vec<Handle<Clip>>>);

/// A sound that is being heard.
#[derive(Component)]
struct Voice;

/// Opens the sound card, if there is one.
pub fn output(app: &mut App) {
    if !has_device() {
        info!("no sound card: no sounds");
        return;
    }
    app.add_plugins(AudioPlugin::default())
        .add_audio_source::<Clip>()
        .add_systems(Startup, bake)
        .add_systems(Update, play.in_set(AppSet::Present));
}

/// Whether a sound card or a sound server is there. ALSA writes many lines to the terminal if it looks for one in vain.
fn has_device() -> bool {
    if !cfg!(target_os = "linux") {
        return true;
    }
    let card = std::fs::read_dir("/dev/snd").into_iter().flatten().flatten();
    let mut card = card.filter(|entry| entry.file_name().to_string_lossy().starts_with("pcm"));
    let runtime = std::env::var_os("XDG_RUNTIME_DIR");
    let server = |name| runtime.as_ref().is_some_and(|folder| Path::new(folder).join(name).exists());
    card.next().is_some()
        || std::env::var_os("PULSE_SERVER").is_some()
        || ["pulse/native", "pipewire-0"].into_iter().any(server)
}

/// Makes all sounds.
fn bake(mut commands: Commands, mut clips: ResMut<Assets<Clip>>) {
    let mut variants =
        |sound: Sound| (0..sound.variants()).map(|i| clips.add(Clip(sound.samples(i).into()))).collect::<Vec<_>>();
    let all = Sound::ALL.into_iter().map(&mut variants).collect();
    commands.insert_resource(Clips(all));
}

/// Plays the sounds of this frame, if the window has the focus.
fn play(
    mut commands: Commands,
    mut sounds: MessageReader<PlaySound>,
    (clips, volumes): (Res<Clips>, Res<Volumes>),
    windows: Query<&Window, With<PrimaryWindow>>,
    cameras: Query<&Transform, With<FollowCamera>>,
    voices: Query<(), With<Voice>>,
    mut turn: Local<usize>,
) {
    let focused = windows.iter().any(|window| window.focused);
    let ear = cameras.iter().next().map(|camera| camera.translation);
    let mut free = VOICES.saturating_sub(voices.iter().count());
    for PlaySound { sound, at, loudness } in sounds.read() {
        let away = at.zip(ear).map_or(0.0, |(at, ear)| at.distance(ear));
        let loudness = loudness * volumes.master * volumes.effects / (1.0 + (away / HALF).powi(2));
        if !focused || free == 0 || loudness < INAUDIBLE {
            continue;
        }
        free -= 1;
        *turn += 1;
        let number = Sound::ALL.iter().position(|known| known == sound).unwrap_or(0);
        let variants = &clips.0[number];
        // variants take turns in an order that does not repeat to the ear, and no two are the same in a row
        let clip = variants[(*turn * 5) % variants.len()].clone();
        let settings = PlaybackSettings::DESPAWN.with_volume(Volume::Linear(loudness));
        commands.spawn((AudioPlayer(clip), settings, Voice));
    }
}

impl Decodable for Clip {
    type Decoder = Reader;

    fn decoder(&self) -> Reader {
        Reader { samples: self.0.clone(), next: 0 }
    }
}

/// Reads a clip once.
struct Reader {
    samples: Arc<[f32]>,
    next: usize,
}

impl Iterator for Reader {
    type Item = Sample;

    fn next(&mut self) -> Option<Sample> {
        let sample = self.samples.get(self.next).copied();
        self.next += 1;
        sample
    }
}

impl Source for Reader {
    fn current_span_len(&self) -> Option<usize> {
        None
    }

    fn channels(&self) -> ChannelCount {
        NonZero::<u16>::MIN
    }

    fn sample_rate(&self) -> SampleRate {
        NonZero::new(RATE).unwrap_or(NonZero::<u32>::MIN)
    }

    fn total_duration(&self) -> Option<Duration> {
        Some(Duration::from_secs_f64(self.samples.len() as f64 / f64::from(RATE)))
    }
}
