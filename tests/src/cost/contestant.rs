//! Contestants: the levels, level `network` with networks of other widths, and level `coarse` with one knob turned.

use std::sync::Arc;

use retina_core::equilibrium::ContactSettings;
use retina_core::predict::finite_element::{COARSE, REFERENCE, Resolution};
use retina_core::predict::networks::Networks;
use retina_core::predict::{EffectChoice, Level, PredictError, Prediction, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;

/// One way to answer a request.
#[derive(Clone)]
pub struct Contestant {
    /// Its name in reports.
    pub name: String,
    /// Which knob is turned; `level` for the levels as they are.
    pub knob: &'static str,
    level: Level,
    /// In place of the level's own, where a knob of the mesh or the solver is turned.
    resolution: Option<Resolution>,
    /// In place of those that ship.
    networks: Option<Arc<Networks>>,
    effects: EffectChoice,
}

impl Contestant {
    /// A level as the service has it.
    pub fn level(level: Level) -> Self {
        Self {
            name: level.name().to_owned(),
            knob: "level",
            level,
            resolution: None,
            networks: None,
            effects: EffectChoice::Auto,
        }
    }

    /// The scene that it answers on, where that is not the one asked about.
    pub fn scene(&self, asked: &PreparedScene) -> Option<PreparedScene> {
        self.networks.as_ref().map(|networks| asked.with_networks(networks.clone()))
    }

    /// Its answer on [`Contestant::scene`].
    ///
    /// # Errors
    /// What the level refuses or fails.
    pub fn answer(
        &self,
        scene: &PreparedScene,
        request: &Request,
        workspace: &mut Workspace,
    ) -> Result<Prediction, PredictError> {
        let request = Request { level: self.level, effects: self.effects.clone(), ..request.clone() };
        match &self.resolution {
            Some(resolution) => scene.predict_at(&request, resolution, workspace, &mut Silent),
            None => scene.predict(&request, workspace, &mut Silent),
        }
    }
}

/// Coarse meshes by cells of the core, rings around it, and elements through the retina; the last two have the reference's sclera and contact.
const MESHES: [(usize, usize, usize, bool); 6] =
    [(1, 2, 1, false), (1, 3, 1, false), (1, 6, 1, false), (2, 6, 2, false), (2, 6, 2, true), (2, 8, 3, true)];
/// Residuals at which Newton's method stops, relative to the force.
const TOLERANCES: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-5];
/// Contact stiffnesses over that of `coarse`.
const STIFFNESSES: [f64; 3] = [0.03, 0.3, 3.0];

/// Networks trained as the one that ships (160 wide), but for their width.
const WIDTHS: [(usize, &[u8]); 2] = [
    (24, include_bytes!("../../../models/weights/contact-24.safetensors")),
    (64, include_bytes!("../../../models/weights/contact-64.safetensors")),
];

/// Everybody but the reference: the levels, networks of other widths, then the knobs of level `coarse`.
pub fn contestants() -> Vec<Contestant> {
    let levels = Level::ALL.into_iter().filter(|&level| level != Level::Reference).map(Contestant::level);
    levels.chain(WIDTHS.map(width)).chain(knobs()).collect()
}

fn width((width, weights): (usize, &[u8])) -> Contestant {
    Contestant {
        name: format!("width {width}"),
        knob: "width",
        networks: Some(Arc::new(Networks::read(weights, &[]))),
        ..Contestant::level(Level::Network)
    }
}

fn knobs() -> Vec<Contestant> {
    let turned = |name: String, knob, resolution| Contestant {
        name,
        knob,
        resolution: Some(resolution),
        ..Contestant::level(Level::Coarse)
    };
    let meshes = MESHES.into_iter().map(|(core_cells, rings, retina_elements, fine)| {
        let base = if fine { REFERENCE } else { COARSE };
        let name = format!("mesh {core_cells}·{rings}·{retina_elements}");
        turned(name, "mesh", Resolution { core_cells, rings, retina_elements, ..base })
    });
    let tolerances = TOLERANCES.into_iter().map(|tolerance| {
        let contact = ContactSettings { tolerance, ..COARSE.contact };
        turned(format!("tolerance {tolerance:e}"), "tolerance", Resolution { contact, ..COARSE })
    });
    let stiffnesses = STIFFNESSES.into_iter().map(|factor| {
        let stiffness_kpa_per_mm = factor * COARSE.contact.stiffness_kpa_per_mm;
        let contact = ContactSettings { stiffness_kpa_per_mm, ..COARSE.contact };
        turned(format!("contact × {factor}"), "contact", Resolution { contact, ..COARSE })
    });
    let small_strain = ["elasticity", "contact"].map(str::to_owned).to_vec();
    let effects = [
        Contestant {
            name: "small strain".to_owned(),
            knob: "effects",
            effects: EffectChoice::Named(small_strain),
            ..Contestant::level(Level::Coarse)
        },
        Contestant {
            name: "all effects".to_owned(),
            knob: "effects",
            effects: EffectChoice::All,
            ..Contestant::level(Level::Coarse)
        },
    ];
    meshes.chain(tolerances).chain(stiffnesses).chain(effects).collect()
}
