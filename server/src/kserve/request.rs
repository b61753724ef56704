//! An inference request: from bytes to the rows of its batch.

use std::sync::Arc;

use retina_core::predict::budget::Budget;
use retina_core::predict::{EffectChoice, Level, Request};
use retina_core::scene::Scene;
use serde::Deserialize;
use serde_json::{Map, Value};

use super::models::{INPUTS, OUTPUTS};
use super::refusal::{Refusal, refused};
use super::tensor::{Elements, Input, input};
use crate::catalog;
use crate::understand::{self, DEFAULT_SCENE, Shared};
use crate::wire::batch::BatchPose;
use crate::wire::fixed::{Quaternion, Vector};
use crate::wire::request::{ControlName, NeedleSpec, SceneChoice, TipName, TipSpec};
use crate::wire::scene::{LayerSpec, RetinaSpec};

/// Parameter of a tensor that stands in the binary data.
const SIZE: &str = "binary_data_size";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InferRequest {
    id: Option<String>,
    #[serde(default)]
    parameters: Map<String, Value>,
    inputs: Vec<InputSpec>,
    #[serde(default)]
    outputs: Vec<OutputSpec>,
}

/// An input as it is announced.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputSpec {
    name: String,
    /// Its shape, the batch first.
    pub shape: Vec<usize>,
    /// Type of its elements.
    pub datatype: String,
    #[serde(default)]
    parameters: Map<String, Value>,
    /// Its elements, where they are not binary.
    pub data: Option<Value>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OutputSpec {
    name: String,
    #[serde(default)]
    parameters: Map<String, Value>,
}

/// A request that is understood.
pub struct Asked {
    /// To be repeated.
    pub id: Option<String>,
    /// The rows: what is asked, and of which scene.
    pub rows: Vec<(Request, Arc<SceneChoice>)>,
    /// Outputs wanted, by their place among all, and whether in binary.
    pub outputs: Vec<(usize, bool)>,
}

/// The request in `body`, whose first `json_bytes` are JSON where binary data follow.
pub fn read(body: &[u8], json_bytes: Option<usize>, level: Level, most_rows: usize) -> Result<Asked, Refusal> {
    let (json, mut binary) = body.split_at_checked(json_bytes.unwrap_or(body.len())).ok_or_else(|| {
        refused(format!("Inference-Header-Content-Length is more than the {} bytes of the body", body.len()))
    })?;
    let request: InferRequest = serde_json::from_slice(json)
        .map_err(|error| refused(format!("the request is not as the protocol has it: {error}")))?;
    let mut inputs: [Option<Input>; INPUTS.len()] = [const { None }; INPUTS.len()];
    for spec in &request.inputs {
        let at = INPUTS.iter().position(|known| known.name == spec.name).ok_or_else(|| {
            refused(format!(
                "there is no input {:?}; known are {}",
                spec.name,
                INPUTS.map(|known| known.name).join(", ")
            ))
        })?;
        let bytes = match spec.parameters.get(SIZE) {
            Some(size) => {
                let size = size.as_u64().and_then(|size| usize::try_from(size).ok());
                let (bytes, rest) = size.and_then(|size| binary.split_at_checked(size)).ok_or_else(|| {
                    refused(format!("the {SIZE} of input {} is beyond the end of the body", spec.name))
                })?;
                binary = rest;
                Some(bytes)
            }
            None => None,
        };
        if inputs[at].replace(input(&INPUTS[at], spec, bytes, most_rows)?).is_some() {
            return Err(refused(format!("input {} is given twice", spec.name)));
        }
    }
    if !binary.is_empty() {
        return Err(refused(format!("{} bytes of binary data belong to no input", binary.len())));
    }
    let outputs = outputs(&request)?;
    let scene = match request.parameters.get("scene") {
        None => DEFAULT_SCENE,
        Some(Value::String(name)) => name,
        Some(other) => return Err(refused(format!("parameter scene is {other}; it must be a name"))),
    };
    Ok(Asked { id: request.id, rows: rows(&inputs, level, scene)?, outputs })
}

fn outputs(request: &InferRequest) -> Result<Vec<(usize, bool)>, Refusal> {
    let flag = |parameters: &Map<String, Value>, name: &str, usual: bool| match parameters.get(name) {
        None => Ok(usual),
        Some(Value::Bool(flag)) => Ok(*flag),
        Some(other) => Err(refused(format!("parameter {name} is {other}; it must be true or false"))),
    };
    if let Some(name) = request.parameters.keys().find(|name| !["scene", "binary_data_output"].contains(&name.as_str()))
    {
        return Err(refused(format!("there is no parameter {name:?}; known are scene, binary_data_output")));
    }
    let usual = flag(&request.parameters, "binary_data_output", false)?;
    if request.outputs.is_empty() {
        return Ok((0..OUTPUTS.len()).map(|at| (at, usual)).collect());
    }
    let one = |wanted: &OutputSpec| {
        let at = OUTPUTS.iter().position(|known| known.tensor.name == wanted.name).ok_or_else(|| {
            let known = OUTPUTS.map(|known| known.tensor.name).join(", ");
            refused(format!("there is no output {:?}; known are {known}", wanted.name))
        })?;
        if let Some(name) = wanted.parameters.keys().find(|name| *name != "binary_data") {
            return Err(refused(format!("output {} has no parameter {name:?}; known is binary_data", wanted.name)));
        }
        Ok((at, flag(&wanted.parameters, "binary_data", usual)?))
    };
    request.outputs.iter().map(one).collect()
}

/// What each row asks.
fn rows(
    inputs: &[Option<Input>; INPUTS.len()],
    level: Level,
    scene: &str,
) -> Result<Vec<(Request, Arc<SceneChoice>)>, Refusal> {
    let named = |name: &str| INPUTS.iter().position(|known| known.name == name).and_then(|at| inputs[at].as_ref());
    let count = named("tip_mm").ok_or_else(|| refused("input tip_mm is missing"))?.rows;
    if let Some((known, other)) = INPUTS
        .iter()
        .zip(inputs)
        .find_map(|(known, input)| input.as_ref().filter(|input| input.rows != count).map(|input| (known, input)))
    {
        let name = known.name;
        return Err(refused(format!("input {name} has {} rows, and tip_mm has {count}", other.rows)));
    }
    let numbers = |name: &str, row: usize| match &named(name)?.elements {
        Elements::Numbers(numbers) => numbers.chunks_exact(numbers.len() / count).nth(row),
        Elements::Texts(_) => None,
    };
    let number = |name: &str, row: usize| numbers(name, row).map(|numbers| numbers[0]);
    let text = |name: &str, row: usize| match &named(name)?.elements {
        Elements::Texts(texts) => texts.get(row).cloned(),
        Elements::Numbers(_) => None,
    };
    let shared = Shared { budget: Budget { level: Some(level), ..Budget::default() }, effects: EffectChoice::Auto };
    let is_tissue = |name: &str| name.starts_with("retina_") || name.starts_with("choroid_");
    let has_tissue = INPUTS.iter().zip(inputs).any(|(known, input)| is_tissue(known.name) && input.is_some());
    let usual = Arc::new(SceneChoice::Name(scene.to_owned()));
    let row = |row: usize| -> Result<_, Refusal> {
        let triple = |name: &str| numbers(name, row).map(|numbers| Vector([numbers[0], numbers[1], numbers[2]]));
        let force_mn = triple("force_mn");
        let needle = NeedleSpec {
            tip_mm: triple("tip_mm").unwrap_or(Vector([0.0; 3])),
            orientation_xyzw: numbers("orientation_xyzw", row)
                .map(|xyzw| Quaternion([xyzw[0], xyzw[1], xyzw[2], xyzw[3]])),
            direction: None,
            gauge: text("gauge", row),
            radius_mm: number("radius_mm", row),
            stiffness_mn_per_mm: None,
            tip: text("tip", row).map(|name| tip(&name)).transpose()?,
        };
        let control = if force_mn.is_some() { ControlName::Force } else { ControlName::Pose };
        let mut request = understand::batched(&shared, &BatchPose { needle, force_mn, control })?;
        request.level = level;
        let scene = match has_tissue {
            false => Arc::clone(&usual),
            true => Arc::new(with_tissue(scene, |name| number(name, row))?),
        };
        Ok((request, scene))
    };
    (0..count).map(|at| row(at).map_err(|refusal| refusal.of_row(at))).collect()
}

fn tip(name: &str) -> Result<TipSpec, Refusal> {
    let known = [("hemispherical", TipName::Hemispherical), ("flat", TipName::Flat), ("bevelled", TipName::Bevelled)];
    let found = known.iter().find(|(known, _)| *known == name).map(|(_, tip)| TipSpec::Name(*tip));
    found.ok_or_else(|| {
        let shown: String = name.chars().take(60).collect();
        refused(format!("input tip has {shown:?}; known are {}", known.map(|(name, _)| name).join(", ")))
    })
}

/// A built-in scene with other numbers for its tissue.
fn with_tissue(scene: &str, number: impl Fn(&str) -> Option<f64>) -> Result<SceneChoice, Refusal> {
    let built_in = Scene::built_in(scene).ok_or_else(|| {
        let known = Scene::built_in_names().join(", ");
        refused(format!("tissue can be given for the scenes {known}, not for {scene:?}"))
    })?;
    let mut spec = catalog::spec(&built_in);
    let tissue = spec.tissue.get_or_insert_default();
    let change = |layer: &mut LayerSpec, prefix: &str| {
        for (name, place) in [
            ("thickness_mm", &mut layer.thickness_mm),
            ("youngs_modulus_kpa", &mut layer.youngs_modulus_kpa),
            ("poisson_ratio", &mut layer.poisson_ratio),
        ] {
            *place = number(&format!("{prefix}{name}")).or(*place);
        }
    };
    if let Some(RetinaSpec::Whole(layer)) = &mut tissue.retina {
        change(layer, "retina_");
    }
    change(tissue.choroid.get_or_insert_default(), "choroid_");
    Ok(SceneChoice::Inline(Box::new(spec)))
}
