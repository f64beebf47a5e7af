//! Synthesis of short sounds: filtered noise for steps, damped sines for impacts, and many of both for a crowd.
//!
//! Filters are the band-pass of Robert Bristow-Johnson's Audio EQ Cookbook (constant peak gain). Impacts are modal: sines that
//! decay exponentially, after a burst of noise as long as the contact.

use std::f32::consts::{PI, TAU};

/// Samples per second.
pub const RATE: u32 = 44_100;

/// A sound that the game plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Sound {
    /// A foot touches the ground.
    Step,
    /// A body hits the ground: after a jump, or in a fall.
    Landing,
    /// A ball is thrown.
    Throw,
    /// A ball hits a body or the ground.
    Impact,
    /// A crowd cheers.
    Crowd,
}

impl Sound {
    /// All sounds.
    pub const ALL: [Sound; 5] = [Sound::Step, Sound::Landing, Sound::Throw, Sound::Impact, Sound::Crowd];

    /// Number of variants: the same sound twice in a row is heard as a machine.
    pub fn variants(self) -> usize {
        match self {
            Sound::Step => 12,
            Sound::Landing | Sound::Impact => 6,
            Sound::Throw => 3,
            Sound::Crowd => 1,
        }
    }

    /// Samples of a variant, from -1 to 1. The same variant always has the same samples.
    pub fn samples(self, variant: usize) -> Vec<f32> {
        let mut noise = Noise::new(self as u64 * 1000 + variant as u64);
        // each variant has its own pitch, within 6 %
        let pitch = 1.0 + 0.06 * noise.next();
        let samples = match self {
            Sound::Step => step(&mut noise, pitch),
            Sound::Landing => landing(&mut noise, pitch),
            Sound::Throw => throw(&mut noise, pitch),
            Sound::Impact => impact(&mut noise, pitch),
            Sound::Crowd => crowd(&mut noise),
        };
        normalized(samples)
    }
}

/// White noise from -1 to 1: xorshift64* of Vigna (2016).
struct Noise(u64);

impl Noise {
    fn new(seed: u64) -> Self {
        Noise((seed + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15))
    }

    fn next(&mut self) -> f32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 40;
        bits as f32 / (1_u32 << 23) as f32 - 1.0
    }

    /// A number from one to another.
    fn within(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * 0.5 * (self.next() + 1.0)
    }
}

/// A band-pass filter of second order.
struct Band {
    /// Gains of the input (now, and two samples ago with the other sign) and of both last outputs.
    gains: [f32; 3],
    inputs: [f32; 2],
    outputs: [f32; 2],
}

impl Band {
    /// Lets frequencies between `low` and `high` pass, Hz.
    fn new(low: f32, high: f32) -> Self {
        let middle = (low * high).sqrt();
        let angle = TAU * middle / RATE as f32;
        let alpha = angle.sin() * (high - low) / (2.0 * middle);
        let norm = 1.0 + alpha;
        let gains = [alpha / norm, -2.0 * angle.cos() / norm, (1.0 - alpha) / norm];
        Band { gains, inputs: [0.0; 2], outputs: [0.0; 2] }
    }

    fn next(&mut self, input: f32) -> f32 {
        let [b, a1, a2] = self.gains;
        let out = b * (input - self.inputs[1]) - a1 * self.outputs[0] - a2 * self.outputs[1];
        self.inputs = [input, self.inputs[0]];
        self.outputs = [out, self.outputs[0]];
        out
    }
}

/// Samples of a function of time, s.
fn bake(seconds: f32, mut at: impl FnMut(f32) -> f32) -> Vec<f32> {
    (0..(seconds * RATE as f32) as usize).map(|i| at(i as f32 / RATE as f32)).collect()
}

/// Rises linearly for `attack` seconds, then falls to a third every `decay` seconds.
fn envelope(t: f32, attack: f32, decay: f32) -> f32 {
    if t < attack { t / attack } else { ((attack - t) / decay).exp() }
}

/// Heel and sole: a thud of noise from 150 to 400 Hz, then the scuff of the sole from 1 to 4 kHz (after Farnell).
fn step(noise: &mut Noise, pitch: f32) -> Vec<f32> {
    let (mut thud, mut scuff) = (Band::new(150.0 * pitch, 400.0 * pitch), Band::new(1000.0 * pitch, 4000.0 * pitch));
    let (decay, late) = (noise.within(0.022, 0.036), noise.within(0.012, 0.03));
    let share = noise.within(0.05, 0.13);
    bake(0.22, |t| {
        let white = noise.next();
        let sole = envelope((t - late).max(0.0), 0.012, 0.03);
        3.0 * thud.next(white) * envelope(t, 0.005, decay) + share * scuff.next(white) * sole
    })
}

/// A heavy, soft body: modes at 70, 130 and 210 Hz.
fn landing(noise: &mut Noise, pitch: f32) -> Vec<f32> {
    let modes = [(70.0, 1.0), (130.0, 0.5), (210.0, 0.25)].map(|(f, gain)| (f * pitch, gain * noise.within(0.8, 1.2)));
    let mut slap = Band::new(250.0, 1200.0);
    bake(0.45, |t| {
        let ring: f32 = modes.iter().map(|(f, gain)| gain * (TAU * f * t).sin()).sum();
        ring * envelope(t, 0.004, 0.06) + 0.5 * slap.next(noise.next()) * envelope(t, 0.003, 0.03)
    })
}

/// Air around a ball: noise whose loudness rises and falls.
fn throw(noise: &mut Noise, pitch: f32) -> Vec<f32> {
    let (mut low, mut high) = (Band::new(300.0 * pitch, 800.0 * pitch), Band::new(900.0 * pitch, 2200.0 * pitch));
    const SECONDS: f32 = 0.28;
    bake(SECONDS, |t| {
        let white = noise.next();
        let rise = (PI * t / SECONDS).sin().powi(2);
        rise * (low.next(white) + (t / SECONDS) * high.next(white))
    })
}

/// A rubber ball: a tone that glides from 160 down to 90 Hz, after the click of the contact.
fn impact(noise: &mut Noise, pitch: f32) -> Vec<f32> {
    let mut click = Band::new(400.0, 2500.0);
    let mut phase = 0.0;
    bake(0.25, |t| {
        let frequency = pitch * (90.0 + 70.0 * (-t / 0.05).exp());
        phase += TAU * frequency / RATE as f32;
        phase.sin() * envelope(t, 0.002, 0.05) + 0.6 * click.next(noise.next()) * envelope(t, 0.001, 0.008)
    })
}

/// Voices in the band of vowels that swell and ebb, and hands that clap.
fn crowd(noise: &mut Noise) -> Vec<f32> {
    const SECONDS: f32 = 3.2;
    const CLAPS: usize = 140;
    let mut vowels = [Band::new(350.0, 650.0), Band::new(800.0, 1300.0), Band::new(2200.0, 3000.0)];
    let loud = |t: f32| (t / 0.25).min(1.0) * ((SECONDS - t) / 1.6).clamp(0.0, 1.0);
    let mut samples = bake(SECONDS, |t| {
        let white = noise.next();
        let swell = 0.75 + 0.25 * (TAU * 1.3 * t).sin();
        let voices: f32 = vowels.iter_mut().zip([1.0, 0.8, 0.25]).map(|(band, gain)| gain * band.next(white)).sum();
        loud(t) * swell * voices
    });
    let mut hand = Band::new(900.0, 2600.0);
    for _ in 0..CLAPS {
        let start = noise.within(0.0, SECONDS - 0.1);
        let gain = noise.within(0.3, 1.0) * loud(start);
        for (i, sample) in samples.iter_mut().skip((start * RATE as f32) as usize).take(RATE as usize / 20).enumerate()
        {
            *sample += gain * hand.next(noise.next()) * envelope(i as f32 / RATE as f32, 0.001, 0.008);
        }
    }
    samples
}

/// Scales to a peak of 0.9, and fades the end out so that it does not click.
fn normalized(mut samples: Vec<f32>) -> Vec<f32> {
    let peak = samples.iter().fold(1e-6_f32, |peak, x| peak.max(x.abs()));
    let fade = RATE as usize / 200;
    let length = samples.len();
    for (i, sample) in samples.iter_mut().enumerate() {
        *sample *= 0.9 / peak * ((length - i) as f32 / fade as f32).min(1.0);
    }
    samples
}
