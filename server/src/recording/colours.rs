//! Numbers as colours: two maps, their round scales, and the bar that explains them.
//!
//! Contract: a scale runs from zero to the first of 1, 2, 5, 10, … that holds every value, so that bars read well and two surfaces of
//! one sample share theirs. Units: µm for values, mm for the bar's place.

use rerun::{Color, Mesh3D, Points3D};
use retina_core::patch::{NODES_PER_SIDE, SPACING_MM};

/// Smallest top of a scale (µm): below it nothing is worth a colour.
const SMALLEST_TOP_UM: f64 = 0.1;

/// Squares of the bar.
const SQUARES: usize = 32;

/// Half the length of the bar (mm): that of the patch.
const HALF_LENGTH_MM: f64 = 0.5 * SPACING_MM * (NODES_PER_SIDE - 1) as f64;

/// The bar lies in front of the patch, from this y to this y (mm).
const BAR_Y_MM: [f64; 2] = [-1.36, -1.26];

/// Height at which the bar lies (mm).
const BAR_Z_MM: f64 = 0.0;

/// Where the numbers stand (mm).
const LABEL_Y_MM: f64 = -1.5;

/// What a colour stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Map {
    /// Pale, green, dark blue: how far a node has moved.
    Displacement,
    /// Pale, orange, dark red: how far a node is off.
    Error,
}

impl Map {
    /// Colours at equal distances, sRGB.
    fn stops(self) -> &'static [[u8; 3]] {
        match self {
            Map::Displacement => {
                &[[240, 236, 220], [199, 233, 180], [127, 205, 187], [65, 182, 196], [34, 94, 168], [12, 30, 110]]
            }
            Map::Error => &[[225, 228, 230], [253, 219, 130], [250, 141, 60], [214, 47, 39], [110, 0, 20]],
        }
    }

    /// The colour at `share` of the scale (0 to 1).
    fn at(self, share: f64) -> Color {
        let stops = self.stops();
        let place = share.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
        let low = (place as usize).min(stops.len() - 2);
        let mix = |a: u8, b: u8| (f64::from(a) + (place - low as f64) * (f64::from(b) - f64::from(a))).round() as u8;
        let [red, green, blue] = [0, 1, 2].map(|k| mix(stops[low][k], stops[low + 1][k]));
        Color::from_rgb(red, green, blue)
    }
}

/// A map with its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    map: Map,
    top_um: f64,
}

impl Scale {
    /// The scale that holds all of `values_um`.
    pub fn holding<'a>(map: Map, values_um: impl IntoIterator<Item = &'a f64>) -> Self {
        let largest = values_um.into_iter().copied().fold(SMALLEST_TOP_UM, f64::max);
        let decade = 10f64.powf(largest.log10().floor());
        let top_um = [1.0, 2.0, 5.0].map(|step| step * decade).into_iter().find(|top| *top >= largest);
        Scale { map, top_um: top_um.unwrap_or(10.0 * decade) }
    }

    /// One colour for each value.
    pub fn colours(&self, values_um: &[f64]) -> Vec<Color> {
        values_um.iter().map(|value| self.map.at(value / self.top_um)).collect()
    }

    /// The bar as a mesh.
    pub fn bar(&self) -> Mesh3D {
        let columns = (0..=SQUARES).map(|column| column as f64 / SQUARES as f64);
        let x_mm = |share: f64| HALF_LENGTH_MM * (2.0 * share - 1.0);
        let corners = columns.clone().flat_map(|share| BAR_Y_MM.map(|y| [x_mm(share), y, BAR_Z_MM]));
        let colours = columns.flat_map(|share| [self.map.at(share); 2]);
        let squares = (0..SQUARES as u32).flat_map(|square| {
            let corner = 2 * square;
            [[corner, corner + 2, corner + 3], [corner, corner + 3, corner + 1]]
        });
        Mesh3D::new(corners)
            .with_triangle_indices(squares)
            .with_vertex_normals(vec![[0.0, 0.0, 1.0]; 2 * (SQUARES + 1)])
            .with_vertex_colors(colours)
    }

    /// The numbers at the bar's ends, and in its middle what they count.
    pub fn labels(&self, quantity: &str) -> Points3D {
        let places = [-HALF_LENGTH_MM, 0.0, HALF_LENGTH_MM].map(|x| [x, LABEL_Y_MM, BAR_Z_MM]);
        let texts = ["0".to_owned(), quantity.to_owned(), format!("{} µm", self.top_um)];
        Points3D::new(places)
            .with_radii([0.001])
            .with_colors([Color::from_rgb(230, 230, 230)])
            .with_labels(texts)
            .with_show_labels(true)
    }
}
