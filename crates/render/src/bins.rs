//! A uniform 2-D grid of lists: the solids that may matter at a point of the picture, the light's view or the ground.

/// An axis-aligned rectangle: lower corner, upper corner.
pub(crate) type Rect = [[f64; 2]; 2];

/// Item indices by cell, in compressed rows.
pub(crate) struct Bins {
    origin: [f64; 2],
    per_unit: [f64; 2],
    count: [usize; 2],
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Bins {
    /// Sorts `rects` into `count` cells over `area`. Items keep their order within a cell.
    pub fn new(rects: &[Rect], area: Rect, count: [usize; 2]) -> Self {
        let mut per_unit = [0.0; 2];
        for i in 0..2 {
            let side = area[1][i] - area[0][i];
            per_unit[i] = if side > 0.0 { count[i] as f64 / side } else { 0.0 };
        }
        let mut bins = Self { origin: area[0], per_unit, count, starts: Vec::new(), items: Vec::new() };

        let mut starts = vec![0_u32; count[0] * count[1] + 1];
        for rect in rects {
            bins.each_cell(rect, |cell| starts[cell + 1] += 1);
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts[starts.len() - 1] as usize];
        for (item, rect) in rects.iter().enumerate() {
            bins.each_cell(rect, |cell| {
                items[next[cell] as usize] = item as u32;
                next[cell] += 1;
            });
        }
        bins.starts = starts;
        bins.items = items;
        bins
    }

    /// Creates about square bins over the union of `rects`.
    pub fn covering(rects: &[Rect], most: usize) -> Self {
        let mut area = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for rect in rects {
            for i in 0..2 {
                area[0][i] = area[0][i].min(rect[0][i]);
                area[1][i] = area[1][i].max(rect[1][i]);
            }
        }
        if rects.is_empty() {
            area = [[0.0; 2]; 2];
        }
        let side = (area[1][0] - area[0][0]).max(area[1][1] - area[0][1]);
        let cells = |i: usize| {
            let share = if side > 0.0 { (area[1][i] - area[0][i]) / side } else { 0.0 };
            ((share * most as f64).ceil() as usize).clamp(1, most)
        };
        Self::new(rects, area, [cells(0), cells(1)])
    }

    /// The items whose rectangle may contain the point.
    #[inline]
    pub fn at(&self, x: f64, y: f64) -> &[u32] {
        let cx = (x - self.origin[0]) * self.per_unit[0];
        let cy = (y - self.origin[1]) * self.per_unit[1];
        if !(cx >= 0.0 && cy >= 0.0) || cx > self.count[0] as f64 || cy > self.count[1] as f64 {
            return &[];
        }
        let cell = (cy as usize).min(self.count[1] - 1) * self.count[0] + (cx as usize).min(self.count[0] - 1);
        &self.items[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    fn each_cell(&self, rect: &Rect, mut visit: impl FnMut(usize)) {
        let cell = |i: usize, value: f64| ((value - self.origin[i]) * self.per_unit[i]).floor();
        let mut span = [[0_usize; 2]; 2];
        for i in 0..2 {
            let (first, last) = (cell(i, rect[0][i]), cell(i, rect[1][i]));
            let most = (self.count[i] - 1) as f64;
            // a rectangle on the upper edge of the area belongs to the last cell
            if last < 0.0 || first > most + 1.0 || first.is_nan() || last.is_nan() {
                return;
            }
            span[i] = [first.clamp(0.0, most) as usize, last.clamp(0.0, most) as usize];
        }
        for y in span[1][0]..=span[1][1] {
            for x in span[0][0]..=span[0][1] {
                visit(y * self.count[0] + x);
            }
        }
    }
}
