//! The equilibrium of one contact on one mesh: needle, wall and force in; positions, travel and reaction out.
//!
//! Patch frame throughout. [`Wall`] is the meshed problem; [`Wall::solve`] finds its equilibrium from a start, directly if it can, by load
//! steps if it must. Read on in `load` (what is asked and answered), `guide` (how the tip is held), `attempts` (ways to an equilibrium), `error` (why there is none), `light` (forces too small to move the tissue), `rounding` (how well a balance can be known), `friction` (its repetition), `grip` (what it remembers),
//! `bleb` (fluid under the retina), `reading` (what is read
//! off), `settled` (the wall under pressure alone). Not here: how fine a mesh a level uses, where the mesh is centred.

mod attempts;
pub mod bleb;
pub mod error;
pub mod friction;
pub mod grip;
mod guide;
mod light;
mod load;
mod reading;
mod rounding;
pub mod settled;

use nalgebra::{Point3, Unit, Vector3};

use crate::effect::{Effect, Local};
use crate::effects::contact::{Contact, ContactFaces};
use crate::effects::elasticity::Elasticity;
use crate::effects::finite_strain::{FiniteStrain, Lame, NeoHookean};
use crate::mesh::wall::{LayerThickness, WallError, WallGeometry, WallTopology};
use crate::surface::Surface;
use crate::tissue::{LayerKind, Tissue};
pub use load::{Addition, ContactSettings, ContactSummary, Equilibrium, Load, MeshSize, Motion, Solid, Strains, Tool};
use settled::Settled;

/// A meshed wall under a needle.
pub struct Wall<'a> {
    topology: &'a WallTopology,
    /// Rest geometry.
    pub geometry: WallGeometry,
    materials: Vec<Lame>,
    faces: ContactFaces,
    solid: Solid,
    contact: ContactSettings,
    tool: Tool<'a>,
    /// Radius of the rim (mm).
    rim_mm: f64,
    /// Largest stiffness λ + 2µ of a layer over its thickness.
    stiffest_kpa_per_mm: f64,
    /// Positions without the needle's contact, where they are not those at rest.
    settled: Option<Vec<f64>>,
    /// Force of the pressure on the whole surface (mN).
    pressure_force_mn: f64,
    /// |principal stretch − 1| that the tissue bears.
    bears_strain: f64,
}

/// Iterations that bring the needle to first contact.
const TOUCH_ITERATIONS: usize = 20;

impl<'a> Wall<'a> {
    /// Meshes the wall under `surface`.
    ///
    /// # Errors
    /// If the wall cannot be meshed there.
    pub fn new(
        topology: &'a WallTopology,
        surface: &Surface,
        tissue: &Tissue,
        mesh: &MeshSize,
        solid: Solid,
        contact: ContactSettings,
        tool: Tool<'a>,
    ) -> Result<Self, WallError> {
        let layers = tissue.layers();
        let thicknesses: Vec<LayerThickness> = layers
            .iter()
            .map(|named| LayerThickness {
                thickness_mm: named.layer.thickness_mm,
                thins: matches!(named.kind, LayerKind::Retina(_)),
                first_element_mm: match named.kind {
                    LayerKind::Retina(0) => mesh.first_element_mm,
                    _ => f64::INFINITY,
                },
            })
            .collect();
        let geometry = WallGeometry::new(topology, &mesh.disc, &thicknesses, |x, y| surface.column(x, y))?;
        let lame = |layer: usize| Lame {
            mu: layers[layer].layer.shear_modulus_kpa(),
            lambda: layers[layer].layer.first_lame_kpa(),
        };
        let materials = topology.element_layer.iter().map(|&layer| lame(layer)).collect();
        let stiffness = |layer: usize| (lame(layer).lambda + 2.0 * lame(layer).mu) / layers[layer].layer.thickness_mm;
        let stiffest_kpa_per_mm = (0..layers.len()).map(stiffness).fold(0.0, f64::max);
        let faces = ContactFaces::new(&topology.faces, &geometry.rest, contact.points_per_edge);
        let rim_mm = mesh.disc.radii.last().copied().unwrap_or_default();
        Ok(Wall {
            topology,
            geometry,
            materials,
            faces,
            solid,
            contact,
            tool,
            rim_mm,
            stiffest_kpa_per_mm,
            settled: None,
            pressure_force_mn: 0.0,
            bears_strain: f64::INFINITY,
        })
    }

    /// The mesh's topology.
    pub fn topology(&self) -> &WallTopology {
        self.topology
    }

    /// The inner surface's faces at rest.
    pub fn faces(&self) -> &ContactFaces {
        &self.faces
    }

    /// Lets the tissue puncture at this |principal stretch − 1|: where it is beyond and not at rest, no further way to an equilibrium is tried.
    pub fn puncture_at(&mut self, strain: f64) {
        self.bears_strain = strain;
    }

    /// Lets the wall begin, and its rim stand, where every point has sunk along its column under `pressure_kpa`.
    pub fn settle(&mut self, surface: &Surface, settled: &Settled, pressure_kpa: f64) {
        let area: f64 = (0..self.topology.faces.len()).flat_map(|face| self.faces.areas(face)).sum();
        self.pressure_force_mn = pressure_kpa.abs() * area;
        let mut positions = self.geometry.rest.clone();
        for (vertex, &(point, _)) in self.topology.vertices.iter().enumerate() {
            let [x, y] = self.geometry.parameters[point];
            let column = surface.column(x, y);
            let sink = column.inward.into_inner() * settled.sink_mm(&column, self.geometry.layer_coordinates[vertex]);
            for k in 0..3 {
                positions[3 * vertex + k] += sink[k];
            }
        }
        self.settled = Some(positions);
    }

    /// Positions without contact, with the needle's tip at its given pose.
    pub fn start(&self) -> Vec<f64> {
        let mut positions = self.settled.as_ref().unwrap_or(&self.geometry.rest).clone();
        self.place_tip(&mut positions, &Vector3::zeros());
        positions
    }

    /// Positions without contact displaced by `field` (patch parameters and depth in layers in, displacement out), the needle's tip at its given
    /// pose. Fixed vertices stay.
    pub fn displaced(&self, field: &dyn Fn([f64; 2], f64) -> Vector3<f64>) -> Vec<f64> {
        let mut positions = self.start();
        for (vertex, &(point, _)) in self.topology.vertices.iter().enumerate() {
            if self.topology.dofs.index(vertex, 0).is_none() {
                continue;
            }
            let moved = field(self.geometry.parameters[point], self.geometry.layer_coordinates[vertex]);
            for k in 0..3 {
                positions[3 * vertex + k] += moved[k];
            }
        }
        positions
    }

    /// Puts the needle's tip at `offset` from its given pose.
    pub fn place_tip(&self, positions: &mut [f64], offset: &Vector3<f64>) {
        let tip = self.tool.patch_from_needle.translation.vector + offset;
        positions[3 * self.topology.needle()..].copy_from_slice(tip.as_slice());
    }

    fn contact(&self) -> Contact<'_> {
        self.contact_with(&self.contact)
    }

    fn contact_with(&self, settings: &ContactSettings) -> Contact<'_> {
        Contact {
            faces: &self.faces,
            shape: self.tool.body,
            frame_from_needle: self.tool.patch_from_needle.rotation.to_rotation_matrix(),
            stiffness_kpa_per_mm: settings.stiffness_kpa_per_mm,
            smoothing_mm: settings.smoothing_mm,
        }
    }

    fn solid(&self) -> Box<dyn Effect + '_> {
        let (geometry, materials) = (&self.geometry.solid, &self.materials[..]);
        match self.solid {
            Solid::Elasticity => Box::new(Elasticity { geometry, materials }),
            Solid::FiniteStrain => Box::new(FiniteStrain { geometry, materials, law: NeoHookean::Logarithmic }),
        }
    }

    /// The travel along `direction` at which the needle first touches the rest surface, from the guess `travel_mm`; `None` if
    /// the line misses the mesh.
    pub fn touch(&self, direction: &Unit<Vector3<f64>>, mut travel_mm: f64) -> Option<f64> {
        let contact = self.contact();
        let mut positions = self.start();
        let stencils = &self.topology.faces;
        let mut local = vec![0.0; 3 * stencils.group_size];
        for _ in 0..TOUCH_ITERATIONS {
            self.place_tip(&mut positions, &(direction.into_inner() * travel_mm));
            let mut nearest = (f64::INFINITY, Point3::origin());
            for group in 0..stencils.len() {
                stencils.gather(group, &positions, &mut local);
                let local = Local { current: &local, group, predicted: &[] };
                for point in contact.contact_points(&local) {
                    if point.gap_mm < nearest.0 {
                        nearest = (point.gap_mm, point.position);
                    }
                }
            }
            let mut pose = self.tool.patch_from_needle;
            pose.translation.vector += direction.into_inner() * travel_mm;
            let (_, gradient) = self.tool.body.distance_and_gradient(&pose.inverse_transform_point(&nearest.1));
            let closing = (pose.rotation * gradient).dot(direction);
            if closing < 1e-3 {
                return None;
            }
            let step = nearest.0 / closing;
            travel_mm += step;
            if step.abs() < 0.1 * self.contact.smoothing_mm {
                return Some(travel_mm);
            }
        }
        None
    }
}
