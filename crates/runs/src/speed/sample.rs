//! Repetitions of a measurement, and workers on threads.

use std::time::Instant;

/// One repetition.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Agent-steps.
    pub steps: u64,
    /// Processor time of all threads, s.
    pub cpu: f64,
    /// Wall time, s.
    pub wall: f64,
}

impl Sample {
    /// Processor time per agent-step, s.
    pub fn cpu_per_step(&self) -> f64 {
        self.cpu / self.steps as f64
    }

    /// Wall time per agent-step, s.
    pub fn wall_per_step(&self) -> f64 {
        self.wall / self.steps as f64
    }
}

/// The median repetition by processor time per step. There must be at least one.
pub fn median(samples: &[Sample]) -> Sample {
    let mut sorted = samples.to_vec();
    sorted.sort_by(|a, b| a.cpu_per_step().total_cmp(&b.cpu_per_step()));
    sorted[sorted.len() / 2]
}

/// Processor time of the slowest repetition divided by that of the fastest, minus one.
pub fn spread(samples: &[Sample]) -> f64 {
    let costs = samples.iter().map(Sample::cpu_per_step);
    let (fast, slow) = costs.fold((f64::INFINITY, 0.0_f64), |(fast, slow), x| (fast.min(x), slow.max(x)));
    slow / fast - 1.0
}

/// Processor time of this thread, s.
pub fn thread_cpu() -> f64 {
    cpu_time::ThreadTime::try_now().map_or(0.0, |t| t.as_duration().as_secs_f64())
}

/// Runs `work` on every worker, each on its own thread (a single worker on this thread). Returns the results in the order of
/// the workers, and the wall time in s.
pub fn on_threads<W: Send, R: Send>(workers: &mut [W], work: impl Fn(usize, &mut W) -> R + Sync) -> (Vec<R>, f64) {
    let start = Instant::now();
    let results = match workers {
        [one] => vec![work(0, one)],
        many => std::thread::scope(|scope| {
            let work = &work;
            let handles: Vec<_> =
                many.iter_mut().enumerate().map(|(i, worker)| scope.spawn(move || work(i, worker))).collect();
            handles.into_iter().map(|h| h.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
        }),
    };
    (results, start.elapsed().as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_by_processor_time() {
        let sample = |cpu: f64, wall: f64| Sample { steps: 1000, cpu, wall };
        let samples = [sample(3.0, 1.0), sample(1.0, 9.0), sample(2.0, 4.0)];
        assert_eq!((median(&samples).cpu, median(&samples).wall, spread(&samples)), (2.0, 4.0, 2.0));
    }

    #[test]
    fn workers_keep_their_order() {
        let (sums, _) = on_threads(&mut [10, 20, 30], |i, x| *x + i);
        assert_eq!(sums, [10, 21, 32]);
        assert_eq!(on_threads(&mut [5], |i, x| *x + i).0, [5]);
    }
}
