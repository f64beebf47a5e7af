//! Rollouts in several processes of this program, each with a slice of the agents: `marathon train --processes N`.
//!
//! A worker process is the program with the argument `rollout-worker` ([`serve`]). It first reads a line of JSON with
//! its setup. For every rollout, it then reads two messages of the learner ([`Players::play`]) and answers with one.
//! Before each message stands its length, 8 bytes, little-endian. The process ends when its input ends. The policy has
//! the same bits as without processes. If a process is lost or does not answer in time, the run ends and can be
//! resumed.

use crate::error::RunError;
use crate::task_config::TaskConfig;
use marathon_learn::{Algorithm, Control, Deliver, Player, Players, TrainConfig};
use marathon_physics::lanes::Isa;
use serde::{Deserialize, Serialize};
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Setup of a worker process.
#[derive(Serialize, Deserialize)]
struct Part {
    task: TaskConfig,
    config: TrainConfig,
    slice: usize,
    slices: usize,
}

/// The worker processes of a run.
pub struct Processes {
    workers: Vec<Worker>,
    /// Time limit for a rollout.
    patience: Duration,
    /// Reason why the run could not continue.
    pub error: Option<RunError>,
}

struct Worker {
    child: Child,
    /// Both ends are closed to stop the process.
    pipes: Option<(ChildStdin, BufReader<ChildStdout>)>,
}

/// Time limit for a rollout. Without it, a suspended process would block the run forever.
const PATIENCE: Duration = Duration::from_secs(1800);
/// Time for processes to exit by themselves, and then to die.
const GRACE: Duration = Duration::from_millis(500);
/// Interval between two checks of an exiting process.
const LOOK: Duration = Duration::from_millis(2);

impl Processes {
    /// Refuses configurations that processes cannot play.
    ///
    /// # Errors
    /// If the algorithm is SAC.
    pub fn check(config: &TrainConfig, count: usize) -> Result<(), RunError> {
        match config.algorithm {
            Algorithm::Sac(_) if count > 0 => Err(RunError::option(
                "processes",
                format!(
                    "is {count}, expected 0 with sac, whose replay stays with its agents; ppo, a2c and acktr support it"
                ),
            )),
            _ => Ok(()),
        }
    }

    /// Starts `count` processes of a program for a run, at most one for every sixteen agents.
    ///
    /// # Errors
    /// If one cannot be started.
    pub fn start(program: &Path, task: &TaskConfig, config: &TrainConfig, count: usize) -> Result<Self, RunError> {
        Self::check(config, count)?;
        let slices = count.clamp(1, config.run.blocks());
        let failed = |e: &dyn std::fmt::Display| RunError::Process(format!("a process cannot be started: {e}"));
        // dropping it also stops the processes that have been started
        let mut all = Processes { workers: Vec::new(), patience: PATIENCE, error: None };
        for slice in 0..slices {
            let mut worker = Worker::start(Command::new(program).arg("rollout-worker")).map_err(|e| failed(&e))?;
            let part = Part { task: task.clone(), config: config.clone(), slice, slices };
            let part = serde_json::to_string(&part).map_err(|e| failed(&e))?;
            let told = worker.pipes.as_mut().map_or(Ok(()), |(requests, _)| writeln!(requests, "{part}"));
            all.workers.push(worker);
            told.map_err(|e| failed(&e))?;
        }
        Ok(all)
    }
}

impl Worker {
    fn start(command: &mut Command) -> io::Result<Self> {
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let pipes = child.stdin.take().zip(child.stdout.take().map(BufReader::new));
        Ok(Worker { child, pipes })
    }

    /// Waits until a moment for the process to end. Returns whether it has ended.
    fn ended_by(&mut self, moment: Instant) -> bool {
        loop {
            match self.child.try_wait() {
                Ok(None) if Instant::now() < moment => std::thread::sleep(LOOK),
                other => return !matches!(other, Ok(None)),
            }
        }
    }
}

impl Players for Processes {
    fn slices(&self) -> usize {
        self.workers.len()
    }

    fn play(&mut self, orders: &[u8], states: &[Vec<u8>], deliver: Deliver<'_>) -> Control {
        let count = self.workers.len();
        let parts = self.workers.iter_mut().map(|worker| (&mut worker.child, &mut worker.pipes));
        let (mut children, mut pipes): (Vec<_>, Vec<_>) = parts.unzip();
        let mut exchange = || -> Result<(), (usize, String)> {
            // a process reads everything before it answers, so none waits for another
            for (i, (pipes, state)) in pipes.iter_mut().zip(states).enumerate() {
                let Some((requests, _)) = pipes else { continue };
                send(requests, &[orders, state]).map_err(|e| (i, e.to_string()))?;
            }
            for (i, pipes) in pipes.iter_mut().enumerate() {
                let Some((_, answers)) = pipes else { continue };
                let answer = receive(answers).and_then(|a| a.ok_or(io::ErrorKind::UnexpectedEof.into()));
                let answer = answer.map_err(|e| (i, e.to_string()))?;
                deliver(i, &answer).map_err(|e| (i, e.to_string()))?;
            }
            Ok(())
        };
        let patience = self.patience;
        let (finished, wait) = channel::<()>();
        let (result, late) = std::thread::scope(|scope| {
            // reading a pipe has no time limit, but it ends with its process
            let watch = scope.spawn(move || {
                let late = wait.recv_timeout(patience) == Err(RecvTimeoutError::Timeout);
                if late {
                    children.iter_mut().for_each(|child| _ = child.kill());
                }
                late
            });
            let result = exchange();
            drop(finished);
            (result, watch.join().unwrap_or(false))
        });
        match result {
            Ok(()) => Control::Continue,
            Err((i, _)) if late => {
                let (which, seconds) = (i + 1, patience.as_secs_f64());
                self.error = Some(RunError::Process(format!(
                    "process {which} of {count}, which plays, did not answer within {seconds} s"
                )));
                Control::Stop
            }
            Err((i, why)) => {
                let which = i + 1;
                self.error =
                    Some(RunError::Process(format!("process {which} of {count}, which plays, has ended: {why}")));
                Control::Stop
            }
        }
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        // a process ends with its input; one that is writing ends with its reader
        self.workers.iter_mut().for_each(|worker| worker.pipes = None);
        let moment = Instant::now() + GRACE;
        for worker in &mut self.workers {
            if !worker.ended_by(moment) {
                // the process has no state to lose
                let _ = worker.child.kill();
            }
        }
        let moment = Instant::now() + GRACE;
        self.workers.iter_mut().for_each(|worker| _ = worker.ended_by(moment));
    }
}

/// Plays the rollouts that the learner requests over stdin, until stdin ends. The program ignores Ctrl-C: the learner
/// handles it and finishes its iteration.
///
/// # Errors
/// If a request is invalid.
pub fn serve() -> Result<(), RunError> {
    let broken = |e: io::Error| RunError::Process(format!("the connection to the learner failed: {e}"));
    let (mut requests, mut answers) = (io::stdin().lock(), io::stdout().lock());
    let mut line = String::new();
    requests.read_line(&mut line).map_err(broken)?;
    let part: Part = serde_json::from_str(&line)
        .map_err(|e| RunError::Process(format!("stdin: {e}; expected messages of a run with processes")))?;
    let factory = part.task.factory()?;
    let mut player = Player::new(&*factory, Isa::best(), &part.config, (part.slice, part.slices))?;
    while let Some(orders) = receive(&mut requests).map_err(broken)? {
        let state = receive(&mut requests).map_err(broken)?.unwrap_or_default();
        let answer = player.play(&orders, &state)?;
        send(&mut answers, &[&answer]).map_err(broken)?;
    }
    Ok(())
}

fn send(pipe: &mut impl Write, messages: &[&[u8]]) -> io::Result<()> {
    for message in messages {
        pipe.write_all(&(message.len() as u64).to_le_bytes())?;
        pipe.write_all(message)?;
    }
    pipe.flush()
}

/// The next message, or `None` at the end.
fn receive(pipe: &mut impl Read) -> io::Result<Option<Vec<u8>>> {
    let mut length = [0; 8];
    match pipe.read_exact(&mut length) {
        Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
        other => other?,
    }
    let length = u64::from_le_bytes(length);
    let mut message = Vec::new();
    // a false length does not allocate memory
    pipe.take(length).read_to_end(&mut message)?;
    if (message.len() as u64) < length { Err(io::ErrorKind::UnexpectedEof.into()) } else { Ok(Some(message)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Processes that ignore the end of input, or write without end, do not block the exit.
    #[cfg(unix)]
    #[test]
    fn a_process_that_does_not_leave_is_ended() {
        for program in ["yes", "trap '' PIPE TERM; while true; do echo y; done 2> /dev/null", "exec sleep 1000"] {
            let mut workers = Vec::new();
            for _ in 0..2 {
                workers.push(Worker::start(Command::new("sh").args(["-c", program])).unwrap());
            }
            let ids: Vec<u32> = workers.iter().map(|worker| worker.child.id()).collect();
            // until the pipe is full
            std::thread::sleep(Duration::from_millis(100));
            let (done, wait) = std::sync::mpsc::channel();
            std::thread::spawn(move || {
                drop(Processes { workers, patience: PATIENCE, error: None });
                done.send(())
            });
            let left = wait.recv_timeout(Duration::from_secs(5)).is_ok();
            for id in &ids {
                let _ = Command::new("sh").args(["-c", &format!("kill -KILL {id} 2> /dev/null")]).status();
            }
            assert!(left, "{program}");
        }
    }

    /// A suspended process ends the run in time, whether it was suspended before reading or before answering.
    #[cfg(unix)]
    #[test]
    fn a_process_that_does_not_answer_ends_the_run() {
        for orders in [10, 1_000_000] {
            let worker = Worker::start(Command::new("sh").args(["-c", "exec sleep 1000"])).unwrap();
            let patience = Duration::from_millis(300);
            let mut all = Processes { workers: vec![worker], patience, error: None };
            let begun = Instant::now();
            let control = all.play(&vec![0; orders], &[vec![0; 10]], &mut |_, _| Ok(()));
            assert!(matches!(control, Control::Stop) && begun.elapsed() < Duration::from_secs(20));
            let error = all.error.take().unwrap().to_string();
            assert!(error.contains("process 1 of 1, which plays, did not answer within 0.3 s"), "{error}");
        }
    }

    #[test]
    fn messages_arrive_whole_or_not_at_all() {
        let mut pipe = Vec::new();
        send(&mut pipe, &[b"orders", b""]).unwrap();
        let mut all = &pipe[..];
        assert_eq!(receive(&mut all).unwrap().as_deref(), Some(&b"orders"[..]));
        assert_eq!(receive(&mut all).unwrap().as_deref(), Some(&b""[..]));
        assert_eq!(receive(&mut all).unwrap(), None);
        assert!(receive(&mut &pipe[..10]).is_err());
        // a false length does not allocate memory
        assert!(receive(&mut &u64::MAX.to_le_bytes()[..]).is_err());
    }
}
