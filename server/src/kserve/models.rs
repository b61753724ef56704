//! What models there are, and their tensors.

use retina_core::patch::NODE_COUNT;
use retina_core::predict::{Level, Prediction};
use serde_json::{Value, json};

/// What the names of all models begin with; the level follows.
const PREFIX: &str = "retina-";

/// A tensor that a model takes or gives.
pub struct Tensor {
    /// Name.
    pub name: &'static str,
    /// Type of its elements, as the protocol calls it.
    pub datatype: &'static str,
    /// Its shape without the batch.
    pub row: &'static [usize],
}

const fn tensor(name: &'static str, datatype: &'static str, row: &'static [usize]) -> Tensor {
    Tensor { name, datatype, row }
}

/// Inputs, `tip_mm` alone required.
pub const INPUTS: [Tensor; 12] = [
    tensor("tip_mm", "FP32", &[3]),
    tensor("force_mn", "FP32", &[3]),
    tensor("orientation_xyzw", "FP32", &[4]),
    tensor("radius_mm", "FP32", &[1]),
    tensor("gauge", "BYTES", &[1]),
    tensor("tip", "BYTES", &[1]),
    tensor("retina_thickness_mm", "FP32", &[1]),
    tensor("retina_youngs_modulus_kpa", "FP32", &[1]),
    tensor("retina_poisson_ratio", "FP32", &[1]),
    tensor("choroid_thickness_mm", "FP32", &[1]),
    tensor("choroid_youngs_modulus_kpa", "FP32", &[1]),
    tensor("choroid_poisson_ratio", "FP32", &[1]),
];

/// An output, and where it is in a prediction.
pub struct Output {
    /// The tensor.
    pub tensor: Tensor,
    /// Appends its row.
    pub append: fn(&Prediction, &mut Vec<f32>),
}

const fn output(
    name: &'static str,
    datatype: &'static str,
    row: &'static [usize],
    append: fn(&Prediction, &mut Vec<f32>),
) -> Output {
    Output { tensor: tensor(name, datatype, row), append }
}

/// Outputs.
pub const OUTPUTS: [Output; 11] = [
    output("vertices_mm", "FP32", &[NODE_COUNT, 3], |prediction, to| {
        prediction.vertices.iter().for_each(|vertex| extend(to, vertex.coords.as_slice()));
    }),
    output("normals", "FP32", &[NODE_COUNT, 3], |prediction, to| {
        prediction.normals.iter().for_each(|normal| extend(to, normal.as_slice()));
    }),
    output("displacement_um", "FP32", &[NODE_COUNT], |prediction, to| extend(to, &prediction.displacement_um)),
    output("needle_tip_mm", "FP32", &[3], |prediction, to| extend(to, prediction.needle.tip_mm.coords.as_slice())),
    output("travel_mm", "FP32", &[1], |prediction, to| extend(to, &[prediction.needle.travel_mm])),
    output("reaction_mn", "FP32", &[3], |prediction, to| extend(to, prediction.needle.reaction_mn.as_slice())),
    output("contact_area_mm2", "FP32", &[1], |prediction, to| extend(to, &[prediction.contact.area_mm2])),
    output("max_strain", "FP32", &[1], |prediction, to| extend(to, &[prediction.contact.max_strain])),
    output("puncture_share", "FP32", &[1], |prediction, to| extend(to, &[prediction.contact.puncture_share])),
    output("expected_error_um", "FP32", &[2], |prediction, to| {
        let expected = &prediction.expected_error;
        let known = expected.median_um.is_finite() && expected.p95_um.is_finite();
        extend(to, &if known { [expected.median_um, expected.p95_um] } else { [f64::NAN; 2] });
    }),
    output("calibrated", "BOOL", &[1], |prediction, to| {
        extend(to, &[f64::from(u8::from(prediction.expected_error.calibrated))]);
    }),
];

fn extend(to: &mut Vec<f32>, numbers: &[f64]) {
    to.extend(numbers.iter().map(|number| *number as f32));
}

/// The level of a model.
pub fn level(model: &str) -> Option<Level> {
    let name = model.strip_prefix(PREFIX)?;
    Level::ALL.into_iter().find(|level| level.name() == name)
}

/// Names of all models.
pub fn names() -> Vec<String> {
    Level::ALL.iter().map(|level| format!("{PREFIX}{}", level.name())).collect()
}

/// What a client is told of a model.
pub fn metadata(model: &str) -> Value {
    let shape = |row: &[usize]| [-1].into_iter().chain(row.iter().map(|size| *size as i64)).collect::<Vec<i64>>();
    let tell = |tensor: &Tensor| json!({"name": tensor.name, "datatype": tensor.datatype, "shape": shape(tensor.row)});
    json!({
        "name": model,
        "platform": env!("CARGO_PKG_NAME"),
        "inputs": INPUTS.iter().map(tell).collect::<Vec<_>>(),
        "outputs": OUTPUTS.iter().map(|output| tell(&output.tensor)).collect::<Vec<_>>(),
    })
}
