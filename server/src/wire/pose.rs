//! The answer to one pose among many, as streams and batches give it: without what all poses share and without the reasons of effects.
//!
//! Contract: a patch that is the scene's own has the triangles that the session's or the batch's head lists; one that is cut from a mesh
//! around the contact brings its own.

use nalgebra::{Point3, Vector3};
use retina_core::predict::Prediction;
use serde::Serialize;
use utoipa::ToSchema;

use super::fixed::{Triangle, Vector};
use super::response::{AccuracyAnswer, ContactAnswer, NeedleAnswer, points, vectors};

/// What the surface looks like under this pose.
#[derive(Serialize, ToSchema)]
pub struct PoseAnswer<'a> {
    /// The deformed surface.
    pub surface: PoseSurface<'a>,
    /// The needle at equilibrium.
    pub needle: NeedleAnswer,
    /// The contact at equilibrium.
    pub contact: ContactAnswer,
    /// How accurate the answer is.
    pub accuracy: AccuracyAnswer,
    /// Names of the effects that were simulated; `POST /v1/predict` gives the reasons.
    pub effects: Vec<&'static str>,
    /// What the caller should know besides.
    pub warnings: &'a [String],
}

/// The deformed surface, scene frame, in the order of a prediction's.
#[derive(Serialize, ToSchema)]
pub struct PoseSurface<'a> {
    /// Deformed nodes, mm.
    #[serde(serialize_with = "points")]
    #[schema(value_type = Vec<Vector>)]
    pub vertices_mm: &'a [Point3<f64>],
    /// Unit normals of the deformed surface at the nodes, out of the tissue.
    #[serde(serialize_with = "vectors")]
    #[schema(value_type = Vec<Vector>)]
    pub normals: &'a [Vector3<f64>],
    /// Length of each node's displacement from rest, µm.
    #[schema(value_type = Vec<f64>)]
    pub displacement_um: &'a [f64],
    /// For a patch cut from a mesh: the triangles between its nodes, counter-clockwise seen from the vitreous.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<Triangle>>)]
    pub triangles: Option<&'a [[usize; 3]]>,
    /// For a patch cut from a mesh: the mesh's index of each node.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<usize>>)]
    pub source_indices: Option<&'a [usize]>,
}

impl<'a> From<&'a Prediction> for PoseAnswer<'a> {
    fn from(prediction: &'a Prediction) -> Self {
        let source_indices = prediction.source_indices.as_deref();
        Self {
            surface: PoseSurface {
                vertices_mm: &prediction.vertices,
                normals: &prediction.normals,
                displacement_um: &prediction.displacement_um,
                triangles: source_indices.map(|_| prediction.triangles.as_slice()),
                source_indices,
            },
            needle: NeedleAnswer::from(&prediction.needle),
            contact: ContactAnswer::from(&prediction.contact),
            accuracy: AccuracyAnswer::from(prediction),
            effects: prediction.effects.iter().filter(|effect| effect.simulated).map(|effect| effect.name).collect(),
            warnings: &prediction.warnings,
        }
    }
}
