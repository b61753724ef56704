//! An inference response: from the rows of the batch to bytes.

use retina_core::patch::NODE_COUNT;
use retina_core::predict::Prediction;
use serde_json::{Map, Value, json};

use super::models::OUTPUTS;
use super::request::Asked;
use crate::problem::Problem;

/// The tensors that are wanted, as far as they are computed.
#[derive(Default)]
pub struct Columns {
    rows: usize,
    /// In the order of what is wanted.
    values: Vec<Vec<f32>>,
    /// What the answers warn of, by row.
    warnings: Vec<(usize, String)>,
}

/// A body, and how much of it is JSON where binary data follow.
pub struct Written {
    /// The body.
    pub body: Vec<u8>,
    /// Bytes of JSON, where there is more.
    pub json_bytes: Option<usize>,
}

impl Columns {
    /// Adds a row.
    ///
    /// # Errors
    /// A patch of another number of nodes than the tensors have.
    pub fn push(&mut self, wanted: &[(usize, bool)], prediction: &Prediction) -> Result<(), Problem> {
        if prediction.vertices.len() != NODE_COUNT {
            return Err(Problem::internal(format!("a patch of {} nodes", prediction.vertices.len())));
        }
        self.values.resize_with(wanted.len(), Vec::new);
        for ((at, _), column) in wanted.iter().zip(&mut self.values) {
            (OUTPUTS[*at].append)(prediction, column);
        }
        self.warnings.extend(prediction.warnings.iter().map(|warning| (self.rows, warning.clone())));
        self.rows += 1;
        Ok(())
    }

    /// Adds the rows of the next piece.
    pub fn append(&mut self, next: Columns) {
        self.values.resize_with(next.values.len(), Vec::new);
        for (column, more) in self.values.iter_mut().zip(next.values) {
            column.extend(more);
        }
        let first = self.rows;
        self.warnings.extend(next.warnings.into_iter().map(|(row, warning)| (first + row, warning)));
        self.rows += next.rows;
    }
}

/// The response to `asked`.
///
/// # Errors
/// Never for numbers: those that JSON has not are `null`.
pub fn write(model: &str, asked: &Asked, columns: &Columns) -> Result<Written, Problem> {
    let mut binary = Vec::new();
    let mut outputs: Vec<String> = Vec::new();
    for ((at, is_binary), values) in asked.outputs.iter().zip(&columns.values) {
        let tensor = &OUTPUTS[*at].tensor;
        let shape: Vec<usize> = [columns.rows].iter().chain(tensor.row).copied().collect();
        let mut output = Map::new();
        output.insert("name".to_owned(), tensor.name.into());
        output.insert("datatype".to_owned(), tensor.datatype.into());
        output.insert("shape".to_owned(), shape.into());
        let is_bool = tensor.datatype == "BOOL";
        let mut text = serde_json::to_string(&output).map_err(Problem::internal)?;
        text.pop();
        if *is_binary {
            let before = binary.len();
            match is_bool {
                true => binary.extend(values.iter().map(|value| u8::from(*value != 0.0))),
                false => binary.extend(values.iter().flat_map(|value| value.to_le_bytes())),
            }
            text.push_str(&format!(r#","parameters":{{"binary_data_size":{}}}}}"#, binary.len() - before));
        } else {
            let data = match is_bool {
                true => serde_json::to_string(&values.iter().map(|value| *value != 0.0).collect::<Vec<_>>()),
                false => serde_json::to_string(values),
            };
            text.push_str(r#","data":"#);
            text.push_str(&data.map_err(Problem::internal)?);
            text.push('}');
        }
        outputs.push(text);
    }
    let mut head = Map::new();
    head.insert("model_name".to_owned(), model.into());
    if let Some(id) = &asked.id {
        head.insert("id".to_owned(), Value::from(id.as_str()));
    }
    if !columns.warnings.is_empty() {
        let lines: Vec<String> =
            columns.warnings.iter().map(|(row, warning)| format!("row {row}: {warning}")).collect();
        head.insert("parameters".to_owned(), json!({"warnings": lines.join("\n")}));
    }
    let mut body = serde_json::to_vec(&head).map_err(Problem::internal)?;
    body.pop();
    body.extend_from_slice(br#","outputs":["#);
    body.extend_from_slice(outputs.join(",").as_bytes());
    body.extend_from_slice(b"]}");
    let json_bytes = (!binary.is_empty()).then_some(body.len());
    body.extend(binary);
    Ok(Written { body, json_bytes })
}
