//! Samples on disk: one safetensors file a shard, one tensor a quantity, samples along the first axis.
//!
//! In Python: `from safetensors.numpy import load_file; shard = load_file("train-000.safetensors")`. Integer quantities are tensors of their
//! own type, all others f32, in the units of [`Sample`]. A level without an answer is zero, and `coarse.answered` says so.
//!
//! Not here: which samples go into which shard, the manifest beside them (`dataset`).

use std::collections::HashMap;
use std::path::Path;

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use thiserror::Error;

use crate::sample::{LevelAnswer, NODES, Sample, Split, TipShape, TissueNumbers};

/// Why a shard was not read or written.
#[derive(Debug, Error)]
pub enum ShardError {
    /// The file system's word.
    #[error("{path}: {cause}")]
    Io {
        /// The file.
        path: String,
        /// The cause.
        cause: std::io::Error,
    },
    /// Not a safetensors file, or not one of ours.
    #[error("{path}: {cause}")]
    Format {
        /// The file.
        path: String,
        /// What is wrong.
        cause: String,
    },
}

/// The f32 quantities of a sample: name, shape, numbers.
fn quantities(sample: &mut Sample) -> Vec<(&'static str, Vec<usize>, &mut [f32])> {
    fn one(number: &mut f32) -> &mut [f32] {
        std::slice::from_mut(number)
    }
    let field = || vec![NODES, 3];
    let Sample { rest_mm, rest_normal, tip, tip_mm, orientation_xyzw, direction, tissue, .. } = sample;
    let coarse = sample.coarse.get_or_insert(NO_ANSWER);
    vec![
        ("rest_mm", field(), rest_mm.as_flattened_mut()),
        ("rest_normal", field(), rest_normal.as_flattened_mut()),
        ("tip.radius_mm", vec![], one(&mut tip.radius_mm)),
        ("tip.edge_radius_mm", vec![], one(&mut tip.edge_radius_mm)),
        ("tip.bevel_deg", vec![], one(&mut tip.bevel_deg)),
        ("tip_mm", vec![3], tip_mm),
        ("orientation_xyzw", vec![4], orientation_xyzw),
        ("direction", vec![3], direction),
        ("force_mn", vec![], one(&mut sample.force_mn)),
        ("tissue.thickness_mm", vec![3], &mut tissue.thickness_mm),
        ("tissue.youngs_modulus_kpa", vec![3], &mut tissue.youngs_modulus_kpa),
        ("tissue.poisson_ratio", vec![3], &mut tissue.poisson_ratio),
        ("touch_mm", vec![3], &mut sample.touch_mm),
        ("inward", vec![3], &mut sample.inward),
        ("touch_travel_mm", vec![], one(&mut sample.touch_travel_mm)),
        ("linear_center_mm", vec![3], &mut sample.linear_center_mm),
        ("linear_depth_mm", vec![], one(&mut sample.linear_depth_mm)),
        ("linear_contact_radius_mm", vec![], one(&mut sample.linear_contact_radius_mm)),
        ("linear_pressure_kpa", vec![], one(&mut sample.linear_pressure_kpa)),
        ("linear.displacement_mm", field(), sample.linear.displacement_mm.as_flattened_mut()),
        ("linear.travel_mm", vec![], one(&mut sample.linear.travel_mm)),
        ("linear.reaction_mn", vec![3], &mut sample.linear.reaction_mn),
        ("coarse.displacement_mm", field(), coarse.displacement_mm.as_flattened_mut()),
        ("coarse.travel_mm", vec![], one(&mut coarse.travel_mm)),
        ("coarse.reaction_mn", vec![3], &mut coarse.reaction_mn),
        ("truth.displacement_mm", field(), sample.truth.displacement_mm.as_flattened_mut()),
        ("truth.travel_mm", vec![], one(&mut sample.truth.travel_mm)),
        ("truth.reaction_mn", vec![3], &mut sample.truth.reaction_mn),
        ("truth_error_mm", vec![], one(&mut sample.truth_error_mm)),
    ]
}

const PATH: &str = "path";
const STEP: &str = "step";
const SPLIT: &str = "split";
const SCENE: &str = "scene";
const TIP_KIND: &str = "tip.kind";
const COARSE_ANSWERED: &str = "coarse.answered";

const NO_ANSWER: LevelAnswer =
    LevelAnswer { displacement_mm: [[0.0; 3]; NODES], travel_mm: 0.0, reaction_mn: [0.0; 3] };

/// Writes `samples` to `path`, whole or not at all.
///
/// # Errors
/// [`ShardError`].
pub fn write(path: &Path, samples: &[Sample]) -> Result<(), ShardError> {
    let mut bytes: Vec<(&'static str, Dtype, Vec<usize>, Vec<u8>)> = Vec::new();
    let u32s = |of: fn(&Sample) -> u32| samples.iter().flat_map(|s| of(s).to_le_bytes()).collect::<Vec<u8>>();
    let u8s = |of: fn(&Sample) -> u8| samples.iter().map(of).collect::<Vec<u8>>();
    bytes.push((PATH, Dtype::U32, vec![samples.len()], u32s(|s| s.path)));
    bytes.push((STEP, Dtype::U32, vec![samples.len()], u32s(|s| s.step)));
    bytes.push((SPLIT, Dtype::U8, vec![samples.len()], u8s(|s| s.split as u8)));
    bytes.push((SCENE, Dtype::U8, vec![samples.len()], u8s(|s| s.scene)));
    bytes.push((TIP_KIND, Dtype::U8, vec![samples.len()], u8s(|s| s.tip.kind)));
    bytes.push((COARSE_ANSWERED, Dtype::U8, vec![samples.len()], u8s(|s| u8::from(s.coarse.is_some()))));
    let integers = bytes.len();
    for (index, sample) in samples.iter().enumerate() {
        let mut sample = *sample;
        for (at, (name, shape, numbers)) in quantities(&mut sample).into_iter().enumerate() {
            if index == 0 {
                let shape = std::iter::once(samples.len()).chain(shape).collect();
                bytes.push((name, Dtype::F32, shape, Vec::with_capacity(4 * samples.len() * numbers.len())));
            }
            bytes[integers + at].3.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        }
    }
    let format = |cause: safetensors::SafeTensorError| ShardError::Format {
        path: path.display().to_string(),
        cause: cause.to_string(),
    };
    let views: Vec<(&str, TensorView)> = bytes
        .iter()
        .map(|(name, dtype, shape, data)| Ok((*name, TensorView::new(*dtype, shape.clone(), data)?)))
        .collect::<Result<_, _>>()
        .map_err(format)?;
    let text = safetensors::serialize(views, None).map_err(format)?;
    let io = |cause| ShardError::Io { path: path.display().to_string(), cause };
    let unfinished = path.with_extension("unfinished");
    std::fs::write(&unfinished, text).map_err(io)?;
    std::fs::rename(&unfinished, path).map_err(io)
}

/// The samples of the shard at `path`.
///
/// # Errors
/// [`ShardError`], naming the tensor that is missing or has the wrong shape.
pub fn read(path: &Path) -> Result<Vec<Sample>, ShardError> {
    let io = |cause| ShardError::Io { path: path.display().to_string(), cause };
    let wrong = |cause: String| ShardError::Format { path: path.display().to_string(), cause };
    let text = std::fs::read(path).map_err(io)?;
    let tensors = SafeTensors::deserialize(&text).map_err(|cause| wrong(cause.to_string()))?;
    let tensor = |name: &str, dtype: Dtype, shape: &[usize]| -> Result<&[u8], ShardError> {
        let view = tensors.tensor(name).map_err(|cause| wrong(format!("`{name}`: {cause}")))?;
        if view.dtype() != dtype || view.shape() != shape {
            let (dtype_is, shape_is) = (view.dtype(), view.shape());
            return Err(wrong(format!("`{name}` is {dtype_is:?} {shape_is:?}, not {dtype:?} {shape:?}")));
        }
        Ok(view.data())
    };
    let count = tensors.tensor(SPLIT).map_err(|cause| wrong(format!("`{SPLIT}`: {cause}")))?.data().len();
    let u32s = |name| -> Result<Vec<u32>, ShardError> {
        let chunks = tensor(name, Dtype::U32, &[count])?.as_chunks::<4>().0;
        Ok(chunks.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect())
    };
    let u8s = |name| tensor(name, Dtype::U8, &[count]);
    let (paths, steps) = (u32s(PATH)?, u32s(STEP)?);
    let (splits, scenes, kinds, answered) = (u8s(SPLIT)?, u8s(SCENE)?, u8s(TIP_KIND)?, u8s(COARSE_ANSWERED)?);
    let mut samples = vec![EMPTY; count];
    let mut data: HashMap<&str, &[[u8; 4]]> = HashMap::new();
    for (name, shape, _) in quantities(&mut EMPTY.clone()) {
        let shape: Vec<usize> = std::iter::once(count).chain(shape).collect();
        data.insert(name, tensor(name, Dtype::F32, &shape)?.as_chunks::<4>().0);
    }
    for (index, sample) in samples.iter_mut().enumerate() {
        for (name, _, numbers) in quantities(sample) {
            let source = &data[name][index * numbers.len()..];
            for (number, bytes) in numbers.iter_mut().zip(source) {
                *number = f32::from_le_bytes(*bytes);
            }
        }
        sample.path = paths[index];
        sample.step = steps[index];
        sample.scene = scenes[index];
        sample.tip.kind = kinds[index];
        let split = Split::ALL.get(usize::from(splits[index]));
        sample.split = *split.ok_or_else(|| wrong(format!("`{SPLIT}`: there is no split {}", splits[index])))?;
        if answered[index] == 0 {
            sample.coarse = None;
        }
    }
    Ok(samples)
}

/// A sample of zeros, to be filled.
const EMPTY: Sample = Sample {
    path: 0,
    step: 0,
    split: Split::Train,
    scene: 0,
    rest_mm: [[0.0; 3]; NODES],
    rest_normal: [[0.0; 3]; NODES],
    tip: TipShape { kind: 0, radius_mm: 0.0, edge_radius_mm: 0.0, bevel_deg: 0.0 },
    tip_mm: [0.0; 3],
    orientation_xyzw: [0.0; 4],
    direction: [0.0; 3],
    force_mn: 0.0,
    tissue: TissueNumbers { thickness_mm: [0.0; 3], youngs_modulus_kpa: [0.0; 3], poisson_ratio: [0.0; 3] },
    touch_mm: [0.0; 3],
    inward: [0.0; 3],
    touch_travel_mm: 0.0,
    linear_center_mm: [0.0; 3],
    linear_depth_mm: 0.0,
    linear_contact_radius_mm: 0.0,
    linear_pressure_kpa: 0.0,
    linear: NO_ANSWER,
    coarse: None,
    truth: NO_ANSWER,
    truth_error_mm: 0.0,
};
