//! Every message that crosses the wire, and nothing else.
//!
//! Contract: field names carry their units; unknown fields, lists in place of objects and arrays of the wrong length are errors;
//! a field that is `null` counts as left out. The schemas of `/openapi.json` are generated from these types.
//!
//! Not here: what the numbers mean to the physics (`understand`), how errors are worded (`read`, `problem`).

pub mod batch;
pub mod catalog;
pub mod cost;
mod either;
pub mod fixed;
pub mod igtl;
pub mod object;
pub mod pose;
pub mod request;
pub mod response;
pub mod scene;
pub mod sequence;
pub mod stored;
pub mod stream;

pub use batch::{BatchRequest, BatchResponse};
pub use catalog::{About, GaugeList, LevelList, Readiness, SceneList};
pub use cost::CostTable;
pub use fixed::{Quaternion, Triangle, Vector};
pub use request::PredictRequest;
pub use response::PredictResponse;
pub use scene::SceneSpec;
pub use sequence::{SimulateLine, SimulateRequest};
pub use stored::{SceneForm, StoredScene};
