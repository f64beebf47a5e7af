//! Showing an environment in a browser while Python steps it.

use crate::error;
use marathon_envs::{Autoreset, VecEnv};
use marathon_physics::Model;
use marathon_viewer::{Frame, PAGE_VARIABLE, Poses, facts, find_page};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Most agents in the picture.
const MOST: usize = 16;
/// Shortest time between two frames. Faster ones would not be seen.
const PERIOD: Duration = Duration::from_micros(16_000);

type Shared = Arc<Mutex<Option<marathon_viewer::Viewer>>>;

/// A page on this computer that shows an environment. The environment does not wait for it.
#[pyclass(frozen, module = "marathon_rl")]
pub struct Viewer {
    shared: Shared,
    url: String,
}

#[pymethods]
impl Viewer {
    /// Address of the page. Only this computer can open it, and only with the token in the address.
    #[getter]
    fn url(&self) -> &str {
        &self.url
    }

    /// Whether a page is open.
    #[getter]
    fn watched(&self) -> bool {
        lock(&self.shared).as_ref().is_some_and(marathon_viewer::Viewer::is_watched)
    }

    /// Ends the server; pages say so.
    fn close(&self, py: Python<'_>) {
        let viewer = lock(&self.shared).take();
        py.detach(|| drop(viewer));
    }

    fn __repr__(&self) -> String {
        format!("Viewer({:?})", self.url)
    }

    /// The page itself, in a notebook.
    fn _repr_html_(&self) -> String {
        let url = self.url.replacen("/#/", "/?embed=1#/", 1);
        format!("<iframe src=\"{url}\" width=\"100%\" height=\"420\" style=\"border: 0\"></iframe>")
    }
}

fn lock(shared: &Shared) -> MutexGuard<'_, Option<marathon_viewer::Viewer>> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The state of an environment that is shown.
pub struct Shown {
    shared: Shared,
    model: Arc<Model>,
    agents: usize,
    poses: Poses,
    episodes: Vec<u32>,
    /// Agents that the next step puts at a new start.
    ended: Vec<bool>,
    autoreset: Autoreset,
    dt: f64,
    time: f64,
    last: Option<Instant>,
}

impl Shown {
    /// Starts a server for an environment.
    pub fn start(
        py: Python<'_>,
        env: &mut VecEnv,
        model: &Arc<Model>,
        autoreset: Autoreset,
        port: u16,
        page: Option<PathBuf>,
    ) -> PyResult<(Shown, Viewer)> {
        let page = page.or_else(|| packed_page(py));
        let viewer =
            py.detach(|| marathon_viewer::Viewer::start(&find_page(page.as_deref())?, port)).map_err(error::any)?;
        let (url, agents, dt) = (viewer.url(), env.agents().min(MOST), env.spec().dt);
        viewer.show(&env.spec().id, &facts(model), agents, dt.max(PERIOD.as_secs_f64()));
        let shared = Arc::new(Mutex::new(Some(viewer)));
        let mut shown = Shown {
            poses: Poses::new(model, agents),
            model: model.clone(),
            agents,
            episodes: vec![0; agents],
            ended: vec![false; agents],
            autoreset,
            dt,
            time: 0.0,
            last: None,
            shared: shared.clone(),
        };
        shown.reset(env)?;
        Ok((shown, Viewer { shared, url }))
    }

    /// Takes in that all agents may be somewhere else, and shows them at once.
    pub fn reset(&mut self, env: &mut VecEnv) -> PyResult<()> {
        self.restarted(env, |_| true)?;
        self.last = None;
        self.show(env)
    }

    /// Takes in that agents are at new starts.
    fn restarted(&mut self, env: &mut VecEnv, which: impl Fn(usize) -> bool) -> PyResult<()> {
        for agent in (0..self.agents).filter(|agent| which(*agent)) {
            self.episodes[agent] = self.episodes[agent].wrapping_add(1);
            self.ended[agent] = false;
            let shared = lock(&self.shared);
            let Some(viewer) = &*shared else { return Ok(()) };
            for field in 0..self.model.hfields.len() {
                viewer.ground(agent, field, &env.ground(agent, field).map_err(error::env)?);
            }
        }
        Ok(())
    }

    /// Takes in a step, after which some episodes have ended.
    pub fn stepped(&mut self, env: &mut VecEnv, ended: impl Fn(usize) -> bool) -> PyResult<()> {
        self.time += self.dt;
        match self.autoreset {
            Autoreset::SameStep => self.restarted(env, &ended)?,
            Autoreset::NextStep => {
                let before = self.ended.clone();
                self.restarted(env, |agent| before[agent])?;
                self.ended = (0..self.agents).map(ended).collect();
            }
            Autoreset::Disabled => {}
        }
        self.show(env)
    }

    /// Shows the present states if a page is open and the last frame was long enough ago.
    fn show(&mut self, env: &VecEnv) -> PyResult<()> {
        let now = Instant::now();
        if self.last.is_some_and(|last| now - last < PERIOD) {
            return Ok(());
        }
        let shared = lock(&self.shared);
        let Some(viewer) = &*shared else { return Ok(()) };
        // the first frame is for pages that open later
        if self.last.is_some() && !viewer.is_watched() {
            return Ok(());
        }
        self.last = Some(now);
        for agent in 0..self.agents {
            self.poses.set(&self.model, agent, &env.state(agent).map_err(error::env)?.qpos);
        }
        viewer.frame(&Frame { time: self.time, episodes: &self.episodes, poses: &self.poses });
        Ok(())
    }
}

/// Names the page of the package to the `marathon` command, unless the environment variable names another one.
pub fn offer_page(py: Python<'_>) -> PyResult<()> {
    if let Some(page) = packed_page(py) {
        py.import("os")?.getattr("environ")?.set_item(PAGE_VARIABLE, page.into_os_string())?;
    }
    Ok(())
}

/// The page that the package has brought along, unless the environment variable names another one.
fn packed_page(py: Python<'_>) -> Option<PathBuf> {
    if std::env::var_os(PAGE_VARIABLE).is_some() {
        return None;
    }
    let file: PathBuf = py.import("marathon_rl").ok()?.getattr("__file__").ok()?.extract().ok()?;
    Some(file.parent()?.join("page")).filter(|page| page.is_dir())
}
