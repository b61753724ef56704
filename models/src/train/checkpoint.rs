//! Where a run stands, on disk: written whole or not at all, so that it can be stopped at any moment.

use std::collections::HashMap;
use std::path::Path;

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use thiserror::Error;

use super::adam::Adam;
use super::run::{Epoch, Learner, Settings, State};

/// Why a checkpoint was not read or written.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// The file system's word.
    #[error("{path}: {cause}")]
    Io {
        /// The file.
        path: String,
        /// The cause.
        cause: std::io::Error,
    },
    /// Not a checkpoint of this run.
    #[error("{path}: {cause}; another --out, or remove it")]
    Other {
        /// The file.
        path: String,
        /// What is wrong.
        cause: String,
    },
}

const FILE: &str = "checkpoint.safetensors";
const SETTINGS: &str = "settings";
const NETWORK: &str = "network";
const CURVE: &str = "curve";
const STEPS: &str = "steps";
const NORM: &str = "usual_norm";

/// Writes `bytes` to `path`, whole or not at all.
///
/// # Errors
/// The file system's.
pub fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let unfinished = path.with_extension("unfinished");
    std::fs::write(&unfinished, bytes)?;
    std::fs::rename(&unfinished, path)
}

/// Keeps `state` in `folder`.
///
/// # Errors
/// [`CheckpointError`].
pub fn write(folder: &Path, learner: &dyn Learner, settings: &Settings, state: &State) -> Result<(), CheckpointError> {
    let path = folder.join(FILE);
    let io = |cause| CheckpointError::Io { path: path.display().to_string(), cause };
    let other = |cause: String| CheckpointError::Other { path: path.display().to_string(), cause };
    std::fs::create_dir_all(folder).map_err(io)?;
    let text = |value: Result<String, serde_json::Error>| value.map_err(|cause| other(cause.to_string()));
    let metadata = HashMap::from([
        (NETWORK.to_owned(), learner.network().to_owned()),
        (SETTINGS.to_owned(), text(serde_json::to_string(settings))?),
        (CURVE.to_owned(), text(serde_json::to_string(&state.curve))?),
        (STEPS.to_owned(), state.adam.steps.to_string()),
        (NORM.to_owned(), state.adam.usual_norm.to_string()),
    ]);
    let bytes: Vec<(&str, Vec<u8>)> =
        [("parameters", &state.parameters), ("best", &state.best), ("m", &state.adam.m), ("v", &state.adam.v)]
            .map(|(name, numbers)| (name, numbers.iter().flat_map(|number| number.to_le_bytes()).collect()))
            .into();
    let views: Vec<(&str, TensorView)> = bytes
        .iter()
        .map(|(name, bytes)| Ok((*name, TensorView::new(Dtype::F32, vec![bytes.len() / 4], bytes)?)))
        .collect::<Result<_, safetensors::SafeTensorError>>()
        .map_err(|cause| other(cause.to_string()))?;
    let file = safetensors::serialize(views, Some(metadata)).map_err(|cause| other(cause.to_string()))?;
    write_whole(&path, &file).map_err(io)
}

/// The state kept in `folder`, if any.
///
/// # Errors
/// [`CheckpointError::Other`] where it belongs to another network or other settings.
pub fn read(folder: &Path, learner: &dyn Learner, settings: &Settings) -> Result<Option<State>, CheckpointError> {
    let path = folder.join(FILE);
    let other = |cause: &str| CheckpointError::Other { path: path.display().to_string(), cause: cause.to_owned() };
    let file = match std::fs::read(&path) {
        Ok(file) => file,
        Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(cause) => return Err(CheckpointError::Io { path: path.display().to_string(), cause }),
    };
    let damaged = || other("is damaged");
    let (_, header) = SafeTensors::read_metadata(&file).map_err(|_| damaged())?;
    let tensors = SafeTensors::deserialize(&file).map_err(|_| damaged())?;
    let metadata = header.metadata().as_ref().ok_or_else(damaged)?;
    let said = |key: &str| metadata.get(key).map(String::as_str).ok_or_else(damaged);
    let kept: Settings = serde_json::from_str(said(SETTINGS)?).map_err(|_| damaged())?;
    if said(NETWORK)? != learner.network() || kept != *settings {
        return Err(other(&format!("belongs to another run ({kept:?})")));
    }
    let curve: Vec<Epoch> = serde_json::from_str(said(CURVE)?).map_err(|_| damaged())?;
    let vector = |name: &str| -> Result<Vec<f32>, CheckpointError> {
        let bytes = tensors.tensor(name).map_err(|_| damaged())?.data();
        let numbers: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|four| f32::from_le_bytes(*four)).collect();
        if numbers.len() == learner.layout().len() {
            Ok(numbers)
        } else {
            Err(other("has another number of parameters"))
        }
    };
    let mut adam = Adam::new(0, settings.decay);
    adam.m = vector("m")?;
    adam.v = vector("v")?;
    adam.steps = said(STEPS)?.parse().map_err(|_| damaged())?;
    adam.usual_norm = said(NORM)?.parse().map_err(|_| damaged())?;
    Ok(Some(State { parameters: vector("parameters")?, adam, best: vector("best")?, curve }))
}
