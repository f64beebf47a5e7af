//! A worker's part in an iteration: it collects rollouts and learns from them.

use super::*;

impl Shared {
    /// Worker `id`'s part in an iteration. None if the players have ended the run before it.
    pub(super) fn iterate(
        &self,
        id: usize,
        replica: &mut Replica,
        mut remote: Option<&mut Remote<'_>>,
    ) -> Option<Vec<Sums>> {
        let (cpu, mut cpu_elsewhere) = (clock::thread_cpu(), 0.0);
        let (mut seconds, mut sums) = (Seconds::default(), vec![Sums::default(); self.roles.len()]);
        // a run that was given up halfway goes on there
        let rollouts = self.config.run.rollouts as u64;
        let first = replica.progress.iteration % rollouts;
        for n in first..rollouts {
            let begin = clock::wall();
            let spent = self.collect(id, replica, remote.as_deref_mut());
            seconds.env += spent.env;
            cpu_elsewhere += spent.cpu_elsewhere;
            seconds.collect += clock::wall() - begin;
            self.barrier.wait();
            if self.stop.load(Ordering::Acquire) {
                if n == first {
                    return None;
                }
                break;
            }

            let begin = clock::wall();
            self.learn(id, replica, &mut sums);
            seconds.update += clock::wall() - begin;
            seconds.cpu = clock::thread_cpu() - cpu + cpu_elsewhere;
            *self.seconds[id].lock().expect("no worker has panicked") = seconds;
            self.barrier.wait();
        }
        Some(sums)
    }

    /// Learns from the rollouts of all workers, one role after the other, and adds up what they were.
    fn learn(&self, id: usize, replica: &mut Replica, sums: &mut [Sums]) {
        let Replica { roles, progress } = replica;
        let mut samples = 0;
        for ((crew, role), Sums { totals: all, updates }) in self.crews.iter().zip(roles).zip(sums) {
            let rollouts: Vec<_> = crew.rollouts.iter().map(|r| r.read().expect("no worker has panicked")).collect();
            let totals = Totals::new(&rollouts, self.config.run.horizon);
            let experience = Experience::new(rollouts.iter().map(|r| &**r).collect(), &totals, id);
            let now = Now { progress, statistics: &role.statistics };
            role.learner.update(&mut Worker::new(crew, id), &experience, now, updates);
            role.absorb(&totals);
            samples = totals.samples as u64;
            all.add(&totals);
        }
        progress.iteration += 1;
        progress.steps += samples;
    }

    /// Plays a horizon with the worker's agents. If others play, the first worker has them play all agents.
    fn collect(&self, id: usize, replica: &Replica, remote: Option<&mut Remote<'_>>) -> Spent {
        if self.elsewhere.load(Ordering::Acquire) {
            let Some(remote) = remote else { return Spent::default() };
            return remote.collect(self, replica).unwrap_or_else(|| {
                self.stop.store(true, Ordering::Release);
                Spent::default()
            });
        }
        let mut collector = self.collectors[id].lock().expect("no worker has panicked");
        let crews = self.crews.iter();
        let mut rollouts: Vec<_> =
            crews.map(|crew| crew.rollouts[id].write().expect("no worker has panicked")).collect();
        let env = collector.collect(&replica.collecting(), &mut rollouts, clock::wall);
        Spent { env, cpu_elsewhere: 0.0 }
    }
}
