//! MuJoCo's line search (`PrimalSearch` in its `engine_solver.c`) as a state machine: it returns the point where it
//! needs the cost, and continues with the answer. This way each agent runs its own search while the costs are evaluated
//! in lanes.

/// Smallest curvature, and smallest length of a direction (`mjMINVAL`).
pub(super) const LEAST: f64 = 1e-15;

/// The cost along the direction, relative to its start, with its derivatives.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Point {
    /// Fraction of the step.
    pub alpha: f64,
    pub cost: f64,
    pub slope: f64,
    pub curvature: f64,
}

impl Point {
    /// The next point of Newton's method in one dimension.
    fn newton(&self) -> f64 {
        self.alpha - self.slope / self.curvature
    }
}

/// The evaluation that the search needs next.
#[derive(Clone, Copy, Debug)]
enum Phase {
    Start,
    First,
    OneSided,
    FirstBeyond,
    Middle,
    NextOfFirst,
    NextOfSecond,
}

/// A line search that needs the cost at [`LineSearch::wanted`].
#[derive(Clone, Debug)]
pub(super) struct LineSearch {
    phase: Phase,
    wanted: f64,
    /// Rounds to the precision in which the cost is evaluated.
    round: fn(f64) -> f64,
    /// Slope below which a point counts as the minimum.
    enough: f64,
    most: usize,
    evaluations: usize,
    start: Point,
    /// Sign of the negative slope at the first Newton point.
    sign: f64,
    /// Ends of the bracket, the next Newton point from each, and the middle.
    ends: [Point; 2],
    next: [Point; 2],
    middle: Point,
    /// Candidates of the current round, and whether the first end has moved in it.
    candidates: [Point; 3],
    first_moved: bool,
}

/// Result of a search: the fraction of the step, and the decrease of the cost.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    pub alpha: f64,
    pub improvement: f64,
}

impl LineSearch {
    /// A search that treats slopes below `enough` as zero. It evaluates the cost about `most` times, at fractions
    /// rounded by `round`.
    pub fn new(enough: f64, most: usize, round: fn(f64) -> f64) -> Self {
        let p = Point::default();
        LineSearch {
            phase: Phase::Start,
            wanted: 0.0,
            round,
            enough,
            most,
            evaluations: 0,
            start: p,
            sign: 1.0,
            ends: [p; 2],
            next: [p; 2],
            middle: p,
            candidates: [p; 3],
            first_moved: false,
        }
    }

    /// The point where the search needs the cost next.
    pub fn wanted(&self) -> f64 {
        self.wanted
    }

    /// Continues with the cost, slope and curvature at [`LineSearch::wanted`], until the search needs another point or
    /// has ended.
    pub fn feed(&mut self, [cost, slope, curvature]: [f64; 3]) -> Option<Found> {
        self.evaluations += 1;
        let curvature = if curvature <= 0.0 { LEAST } else { curvature };
        let point = Point { alpha: self.wanted, cost, slope, curvature };
        match self.phase {
            Phase::Start => {
                self.start = point;
                self.ask(Phase::First, point.newton())
            }
            Phase::First => {
                self.ends = [point, self.start];
                self.sign = if point.slope < 0.0 { 1.0 } else { -1.0 };
                if point.slope.abs() < self.enough && (point.alpha == 0.0 || point.cost < 0.0) {
                    return found(&point);
                }
                self.one_sided()
            }
            Phase::OneSided => {
                self.ends[0] = point;
                if point.slope.abs() < self.enough && point.cost < 0.0 {
                    return found(&point);
                }
                self.one_sided()
            }
            Phase::FirstBeyond => {
                self.next[0] = point;
                self.bracketed()
            }
            Phase::Middle => {
                self.middle = point;
                self.candidates = [self.next[0], self.next[1], point];
                let mut best: Option<&Point> = None;
                for c in &self.candidates {
                    if c.slope.abs() < self.enough && best.is_none_or(|b| c.cost < b.cost) {
                        best = Some(c);
                    }
                }
                if let Some(best) = best {
                    return found(best);
                }
                self.first_moved = narrow(&mut self.ends[0], &self.candidates);
                if self.first_moved { self.ask(Phase::NextOfFirst, self.ends[0].newton()) } else { self.second() }
            }
            Phase::NextOfFirst => {
                self.next[0] = point;
                self.second()
            }
            Phase::NextOfSecond => {
                self.next[1] = point;
                self.bracketed()
            }
        }
    }

    fn ask(&mut self, phase: Phase, alpha: f64) -> Option<Found> {
        self.phase = phase;
        self.wanted = (self.round)(alpha);
        None
    }

    /// Newton's method until it passes the minimum.
    fn one_sided(&mut self) -> Option<Found> {
        let first = self.ends[0];
        if self.sign * first.slope <= -self.enough && self.evaluations < self.most {
            // a search that does not move gets the same answers until the cap
            if (self.round)(first.newton()) == first.alpha {
                return found(&first);
            }
            self.ends[1] = first;
            return self.ask(Phase::OneSided, first.newton());
        }
        if self.evaluations >= self.most {
            return found(&first);
        }
        self.next[1] = first;
        self.ask(Phase::FirstBeyond, first.newton())
    }

    /// Starts the next round within the bracket, or ends at the better end.
    fn bracketed(&mut self) -> Option<Found> {
        let [a, b] = self.ends;
        if self.evaluations < self.most {
            return self.ask(Phase::Middle, 0.5 * (a.alpha + b.alpha));
        }
        if a.cost <= b.cost && a.cost < 0.0 {
            found(&a)
        } else if b.cost <= a.cost && b.cost < 0.0 {
            found(&b)
        } else {
            Some(Found::default())
        }
    }

    /// Continues with the second end.
    fn second(&mut self) -> Option<Found> {
        if narrow(&mut self.ends[1], &self.candidates) {
            return self.ask(Phase::NextOfSecond, self.ends[1].newton());
        }
        // neither end can move: the result is as accurate as the precision allows
        if self.first_moved { self.bracketed() } else { found(&self.middle) }
    }
}

fn found(point: &Point) -> Option<Found> {
    Some(Found { alpha: point.alpha, improvement: -point.cost })
}

/// Moves an end of the bracket to candidates on its side that are closer to the minimum.
fn narrow(end: &mut Point, candidates: &[Point; 3]) -> bool {
    let mut moved = false;
    for c in candidates {
        let below = end.slope < 0.0 && c.slope < 0.0 && end.slope < c.slope;
        let above = end.slope > 0.0 && c.slope > 0.0 && end.slope > c.slope;
        if below || above {
            *end = *c;
            moved = true;
        }
    }
    moved
}
