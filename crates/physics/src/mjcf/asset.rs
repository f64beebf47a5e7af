//! `<asset>`: height fields and meshes.

use super::compiler::Settings;
use super::defaults::Defaults;
use super::document::Element;
use super::error::MjcfError;
use super::file::ReadFile;
use super::math::EPS;
use super::mesh::{self, MeshAsset};
use super::names::Names;
use super::room::Room;
use super::settings::entries;
use super::value::{Attrs, numbers};
use crate::model::HField;

/// A grid with more points than this is a mistake in the file.
const MAX_POINTS: usize = 1 << 24;

/// Assets that geoms refer to.
pub(crate) struct Assets<'a> {
    /// Height fields in document order.
    pub hfields: Vec<HField>,
    /// Their names.
    pub hfield_names: Names<'a>,
    /// Meshes in document order.
    pub meshes: Vec<MeshAsset<'a>>,
    /// Their names.
    pub mesh_names: Names<'a>,
}

/// Reads all height fields, and all meshes that geoms refer to.
pub(crate) fn read<'a>(
    root: &'a Element,
    defaults: &'a Defaults<'a>,
    settings: &Settings,
    file: &ReadFile,
    room: &Room,
) -> Result<Assets<'a>, MjcfError> {
    let of_kind = |kind: &'static str| entries(root, "asset").filter(move |e| e.name == kind);
    let (mut hfields, mut hfield_names) = (Vec::new(), Names::new("height field"));
    for (i, element) in of_kind("hfield").enumerate() {
        let name = asset_name(element)?;
        hfield_names.add_as(name, element, i)?;
        hfields.push(hfield(element, name, settings, file, room)?);
    }
    let (mut meshes, mut mesh_names) = (Vec::new(), Names::new("mesh"));
    let used = mesh::used(root);
    for (i, element) in of_kind("mesh").enumerate() {
        let name = asset_name(element)?;
        mesh_names.add_as(name, element, i)?;
        let attrs = defaults.attrs(element, None)?;
        meshes.push(MeshAsset::read(&attrs, name, used.contains(name), settings, file, room)?);
    }
    Ok(Assets { hfields, hfield_names, meshes, mesh_names })
}

/// The name that an asset gives itself, else that of its file without folder and extension.
fn asset_name(element: &Element) -> Result<&str, MjcfError> {
    given_name(element).ok_or_else(|| element.invalid("the attribute 'name' is missing"))
}

/// The same, if there is one.
pub(crate) fn given_name(element: &Element) -> Option<&str> {
    let given = element.text("name").filter(|n| !n.is_empty());
    let stem = || {
        let file = element.text("file")?.rsplit(['/', '\\']).next()?;
        Some(file.rsplit_once('.').map_or(file, |(stem, _)| stem)).filter(|s| !s.is_empty())
    };
    given.or_else(stem)
}

/// A grid of elevations as it is written down: rows, columns, values.
struct Grid {
    nrow: usize,
    ncol: usize,
    values: Vec<f32>,
}

fn hfield(
    element: &Element,
    name: &str,
    settings: &Settings,
    read: &ReadFile,
    room: &Room,
) -> Result<HField, MjcfError> {
    let attrs = Attrs::plain(element);
    let Some(size) = attrs.array::<4>("size")? else {
        return Err(element.invalid("the attribute 'size' is missing"));
    };
    if size.iter().any(|s| !(*s > 0.0)) {
        return Err(element.invalid("the four numbers of 'size' must be greater than zero"));
    }
    let mut grid = match element.attr("file").filter(|a| !a.value.is_empty()) {
        Some(attr) => {
            let path = settings.of(element).asset_path(&attr.value);
            let failed = |reason: String| {
                let kind = super::error::MjcfErrorKind::Read(format!("height field file '{path}': {reason}"));
                attr.place.error(kind)
            };
            let bytes = read(&path).map_err(|e| failed(e.reason))?;
            let is_png = match element.text("content_type") {
                Some(kind) => kind == "image/png",
                None => attr.value.to_ascii_lowercase().ends_with(".png"),
            };
            let grid = if is_png { from_png(&bytes) } else { from_binary(&bytes) }.map_err(failed)?;
            room.take_for(element, grid.values.len(), size_of::<f32>())?;
            grid
        }
        None => from_attributes(element, &attrs, room)?,
    };
    if grid.nrow < 2 || grid.ncol < 2 {
        return Err(
            element.invalid(format!("a grid has at least 2 rows and columns, not {} x {}", grid.nrow, grid.ncol))
        );
    }
    normalize(&mut grid.values);
    Ok(HField { name: name.to_owned(), nrow: grid.nrow, ncol: grid.ncol, size, data: grid.values })
}

/// `nrow`, `ncol` and `elevation`, whose first row is the one with the largest y; flat without elevations.
fn from_attributes(element: &Element, attrs: &Attrs, room: &Room) -> Result<Grid, MjcfError> {
    let mut counts = [0; 2];
    for (name, count) in ["nrow", "ncol"].into_iter().zip(&mut counts) {
        *count = usize::try_from(attrs.integer_or(name, 0)?).unwrap_or(0);
        if *count == 0 {
            return Err(element.invalid(format!("'file' or a positive '{name}' is missing")));
        }
    }
    let [nrow, ncol] = counts;
    let points = nrow.checked_mul(ncol).filter(|n| *n <= MAX_POINTS);
    let points = points.ok_or_else(|| element.invalid(format!("a grid has at most {MAX_POINTS} points")))?;
    room.take_for(element, points, size_of::<f32>())?;
    let values = match element.attr("elevation") {
        Some(attr) => {
            let given = numbers(element, attr, points, points)?;
            given.chunks(ncol).rev().flatten().map(|x| *x as f32).collect()
        }
        None => vec![0.0; points],
    };
    if values.iter().any(|x: &f32| !x.is_finite()) {
        return Err(element.invalid("an elevation is too large"));
    }
    Ok(Grid { nrow, ncol, values })
}

/// MuJoCo's format: two 32-bit integers, rows and columns, then the elevations by rows as 32-bit floats, all little
/// endian. The first row is the one with the smallest y.
fn from_binary(bytes: &[u8]) -> Result<Grid, String> {
    let word = |i: usize| bytes.get(4 * i..4 * i + 4).and_then(|b| <[u8; 4]>::try_from(b).ok());
    let count = |i: usize| word(i).and_then(|b| usize::try_from(i32::from_le_bytes(b)).ok());
    let (Some(nrow), Some(ncol)) = (count(0), count(1)) else {
        return Err("it does not start with a number of rows and a number of columns".to_owned());
    };
    let points = nrow.checked_mul(ncol).filter(|n| *n <= MAX_POINTS);
    let points = points.ok_or_else(|| format!("a grid has at most {MAX_POINTS} points, not {nrow} x {ncol}"))?;
    let expected = 4 * (points + 2);
    if bytes.len() != expected {
        return Err(format!("{nrow} x {ncol} elevations take {expected} bytes, but there are {}", bytes.len()));
    }
    let values: Vec<f32> = (2..points + 2).filter_map(word).map(f32::from_le_bytes).collect();
    if values.iter().any(|x| !x.is_finite()) {
        return Err("an elevation is not a finite number".to_owned());
    }
    Ok(Grid { nrow, ncol, values })
}

/// The gray values, or the red ones of a colored image, at 8 bits. The first row is the one with the largest y.
fn from_png(bytes: &[u8]) -> Result<Grid, String> {
    let mut decoder = png::Decoder::new_with_limits(std::io::Cursor::new(bytes), png::Limits { bytes: 8 * MAX_POINTS });
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
    let mut reader = decoder.read_info().map_err(|e| e.to_string())?;
    let (ncol, nrow) = (reader.info().width as usize, reader.info().height as usize);
    if nrow.checked_mul(ncol).is_none_or(|n| n > MAX_POINTS) {
        return Err(format!("a grid has at most {MAX_POINTS} points, not {nrow} x {ncol}"));
    }
    let size = reader.output_buffer_size().ok_or("the image is too large")?;
    let mut pixels = vec![0; size];
    let frame = reader.next_frame(&mut pixels).map_err(|e| e.to_string())?;
    let channels = frame.color_type.samples();
    let rows = pixels[..frame.buffer_size()].chunks_exact(frame.line_size).rev();
    let values = rows.flat_map(|row| row.iter().step_by(channels)).map(|x| f32::from(*x)).collect();
    Ok(Grid { nrow, ncol, values })
}

/// Scales the elevations to 0..=1; a flat field becomes 0.
fn normalize(values: &mut [f32]) {
    let low = values.iter().copied().fold(f32::INFINITY, f32::min);
    let high = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let span = high - low;
    let scale = if f64::from(span) > EPS { span } else { 1.0 };
    for x in values {
        // halves keep the difference of very large numbers finite
        *x = if span.is_finite() { (*x - low) / scale } else { (*x / 2.0 - low / 2.0) / (high / 2.0 - low / 2.0) };
    }
}
