//! What the trainer computes for one sample, layer by layer, kept beside the weights so that the core's inference can be held against it.
//!
//! Of each layer one row in [`STRIDE`] is kept: a node of another row reaches it through the mesh and the attention, so a wrong layer shows, and the file stays small.

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensorError, SafeTensors};

/// One row in so many is kept; a layer of fewer rows keeps its first.
pub const STRIDE: usize = 8;

/// A layer: its name, how many numbers a row has, and all rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Its name, as the core's observer is told it, and its number after a point.
    pub name: String,
    /// Numbers of a row.
    pub width: usize,
    /// The rows.
    pub rows: Vec<f32>,
}

impl Layer {
    /// Layer `index` of `name`.
    pub fn new(name: &str, index: usize, width: usize, rows: &[f32]) -> Self {
        Layer { name: format!("{name}.{index}"), width, rows: rows.to_vec() }
    }

    /// The rows that are kept.
    pub fn kept(&self) -> Vec<f32> {
        self.rows.chunks_exact(self.width).step_by(STRIDE).flatten().copied().collect()
    }
}

/// The file of the rows that are kept.
///
/// # Errors
/// A width that does not divide a layer.
pub fn write(layers: &[Layer]) -> Result<Vec<u8>, SafeTensorError> {
    let kept: Vec<(usize, Vec<u8>)> =
        layers.iter().map(|layer| (layer.width, layer.kept().iter().flat_map(|x| x.to_le_bytes()).collect())).collect();
    let views: Vec<(&str, TensorView)> = layers
        .iter()
        .zip(&kept)
        .map(|(layer, (width, bytes))| {
            let shape = vec![bytes.len() / size_of::<f32>() / width, *width];
            Ok((layer.name.as_str(), TensorView::new(Dtype::F32, shape, bytes)?))
        })
        .collect::<Result<_, SafeTensorError>>()?;
    safetensors::serialize(views, None)
}

/// Name, width and kept rows of each layer of a file.
///
/// # Errors
/// Not such a file.
pub fn read(file: &[u8]) -> Result<Vec<(String, usize, Vec<f32>)>, SafeTensorError> {
    let layer = |(name, view): (String, TensorView)| {
        let rows = view.data().as_chunks::<4>().0.iter().map(|four| f32::from_le_bytes(*four)).collect();
        (name, view.shape().last().copied().unwrap_or(0), rows)
    };
    Ok(SafeTensors::deserialize(file)?.tensors().into_iter().map(layer).collect())
}
