//! The response to a step of the commanded speed.

use super::trial::Track;
use serde::Serialize;

/// Response of agents to a sudden change of the commanded speed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Response {
    /// Commanded speed before, m/s.
    pub from: f64,
    /// Commanded speed after, m/s.
    pub to: f64,
    /// Agents that had not fallen before.
    pub agents: u64,
    /// Number of agents that fell after the change.
    pub falls: u64,
    /// Median time to 63 % of the change, s. `None` if fewer than half of the agents reached it.
    pub to_63: Option<f64>,
    /// Median time to 90 % of the change, s.
    pub to_90: Option<f64>,
    /// Largest overshoot of the median speed, m/s.
    pub overshoot: f64,
    /// Mean distance from the new speed in the second half of the time, m/s. `None` if all agents fell.
    pub error: Option<f64>,
    /// Median speed at each decision, m/s.
    pub speeds: Vec<f64>,
}

impl Response {
    /// Computes the response of agents whose commanded speed changes at the start of their tracks.
    pub(super) fn of(tracks: &[Track], dt: f64, [from, to]: [f64; 2]) -> Self {
        let speeds: Vec<Vec<f64>> =
            tracks.iter().map(|track| track.moments.iter().map(|moment| moment.speed).collect()).collect();
        let falls = tracks.iter().filter(|track| track.fallen).count() as u64;
        Self::of_speeds(&speeds, dt, [from, to], falls)
    }

    fn of_speeds(speeds: &[Vec<f64>], dt: f64, [from, to]: [f64; 2], falls: u64) -> Self {
        let made = |speed: f64| (speed - from) / (to - from);
        let reach = |share: f64| {
            let time = |speeds: &Vec<f64>| {
                let first = speeds.iter().position(|speed| made(*speed) >= share);
                first.map_or(f64::INFINITY, |i| (i + 1) as f64 * dt)
            };
            median_time(speeds.iter().map(time).collect())
        };
        let longest = speeds.iter().map(Vec::len).max().unwrap_or(0);
        let middle: Vec<f64> = (0..longest)
            .filter_map(|i| median(speeds.iter().filter_map(|speeds| speeds.get(i).copied()).collect()))
            .collect();
        let late: Vec<f64> = speeds.iter().flat_map(|speeds| speeds.iter().skip(longest / 2)).copied().collect();
        let beyond = |speed: &f64| (speed - to) * (to - from).signum();
        Response {
            from,
            to,
            agents: speeds.len() as u64,
            falls,
            to_63: reach(0.63),
            to_90: reach(0.9),
            overshoot: middle.iter().map(beyond).fold(0.0, f64::max),
            error: (!late.is_empty())
                .then(|| late.iter().map(|speed| (speed - to).abs()).sum::<f64>() / late.len() as f64),
            speeds: middle,
        }
    }
}

/// The median. Of two middle numbers, the lower one. `None` without numbers.
pub fn median(mut numbers: Vec<f64>) -> Option<f64> {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len().saturating_sub(1) / 2).copied()
}

/// The median time, where infinity stands for "never". `None` if fewer than half are finite.
pub fn median_time(times: Vec<f64>) -> Option<f64> {
    median(times).filter(|time| time.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A first-order lag with a time constant of 0.4 s makes 63.2 % of a change in 0.4 s and 90 % in 0.92 s.
    #[test]
    fn a_lag_is_told_by_its_times() {
        let lag = |i: i32| 2.0 - 3.0 * (-f64::from(i) * 0.01 / 0.4).exp();
        let speeds: Vec<f64> = (1..=400).map(lag).collect();
        let got = Response::of_speeds(&[speeds.clone(), speeds], 0.01, [-1.0, 2.0], 0);
        assert!((got.to_63.unwrap() - 0.4).abs() < 0.011 && (got.to_90.unwrap() - 0.93).abs() < 0.011, "{got:?}");
        assert!(got.overshoot == 0.0 && got.error.unwrap() < 0.01 && got.agents == 2);
    }

    #[test]
    fn what_half_of_them_do_not_reach_has_no_time() {
        let (able, unable) = (vec![1.0, 2.2, 2.0], vec![0.1, 0.2, 0.1]);
        let some = Response::of_speeds(&[able.clone(), able.clone(), unable.clone()], 0.5, [0.0, 2.0], 1);
        assert_eq!((some.to_63, some.to_90, some.falls), (Some(1.0), Some(1.0), 1));
        assert!((some.overshoot - 0.2).abs() < 1e-12);
        let few = Response::of_speeds(&[able, unable.clone(), unable], 0.5, [0.0, 2.0], 0);
        assert_eq!((few.to_63, few.to_90), (None, None));
        assert_eq!(Response::of_speeds(&[], 0.5, [0.0, 2.0], 0).speeds, Vec::<f64>::new());
    }

    #[test]
    fn a_step_down_is_the_mirror_of_a_step_up() {
        let up = vec![0.5, 1.5, 2.5, 2.1];
        let down: Vec<f64> = up.iter().map(|speed| 2.0 - speed).collect();
        let (up, down) =
            (Response::of_speeds(&[up], 0.1, [0.0, 2.0], 0), Response::of_speeds(&[down], 0.1, [2.0, 0.0], 0));
        assert_eq!((up.to_63, up.to_90), (down.to_63, down.to_90));
        assert!((up.overshoot - 0.5).abs() < 1e-12 && (down.overshoot - 0.5).abs() < 1e-12);
    }
}
