//! Who answers: the levels as they stand in the data, the networks through the core's own inference, the baselines.

use std::path::Path;

use nalgebra::Vector3;
use retina_core::network::contact::{ContactNetwork, Corrected, Memory, Start};
use retina_core::network::faithful::tag::Propagation;
use retina_core::network::faithful::{self, FaithfulNetwork};
use retina_core::network::graph::Graph;
use retina_core::network::input::{Answer, Field, Input};
use retina_core::network::weights::WeightsError;
use retina_core::patch::NODE_COUNT;

use crate::describe;
use crate::faithful::prepared::{Prepared, View};
use crate::sample::{NODES, Sample};

/// Answers with the displacement of each node (mm); `None` where it has no answer.
pub trait Predictor {
    /// Its name in tables.
    fn name(&self) -> String;
    /// The answer.
    fn displacement(&mut self, sample: &Sample, input: &Input) -> Option<Field>;
}

/// Nothing moves.
pub struct Still;

impl Predictor for Still {
    fn name(&self) -> String {
        "nothing moves".to_owned()
    }

    fn displacement(&mut self, _sample: &Sample, _input: &Input) -> Option<Field> {
        Some([Vector3::zeros(); NODES])
    }
}

/// Level `linear`.
pub struct Linear;

impl Predictor for Linear {
    fn name(&self) -> String {
        "`linear`".to_owned()
    }

    fn displacement(&mut self, _sample: &Sample, input: &Input) -> Option<Field> {
        Some(input.linear.displacement_mm)
    }
}

/// Level `coarse`.
pub struct Coarse;

impl Predictor for Coarse {
    fn name(&self) -> String {
        "`coarse`".to_owned()
    }

    fn displacement(&mut self, _sample: &Sample, input: &Input) -> Option<Field> {
        Some(input.coarse.as_ref()?.displacement_mm)
    }
}

/// Level `network` or `corrected`.
pub struct Contact {
    /// The network.
    pub network: ContactNetwork,
    graph: Graph,
    memory: Memory,
}

impl Contact {
    /// The network of a weight file's bytes.
    ///
    /// # Errors
    /// [`WeightsError`].
    pub fn new(start: Start, file: &[u8]) -> Result<Self, WeightsError> {
        let network = ContactNetwork::new(start, file)?;
        Ok(Contact { network, graph: describe::graph(), memory: Memory::default() })
    }

    /// Its name in tables.
    pub fn label(&self) -> String {
        match self.network.start() {
            Start::Linear => "`network`".to_owned(),
            Start::Coarse => "`corrected`".to_owned(),
        }
    }

    /// The answer of `coarse`, where it corrects that one.
    pub fn started_from<'a>(&self, input: &'a Input) -> Option<&'a Answer> {
        input.coarse.as_ref().filter(|_| self.network.start() == Start::Coarse)
    }

    /// All that it answers.
    pub fn answer(&mut self, input: &Input) -> Option<Corrected> {
        self.network.predict(input, &self.graph, &mut self.memory)
    }
}

impl Predictor for Contact {
    fn name(&self) -> String {
        self.label()
    }

    fn displacement(&mut self, _sample: &Sample, input: &Input) -> Option<Field> {
        Some(self.answer(input)?.answer.displacement_mm)
    }
}

/// The paper's network.
pub struct Faithful {
    network: FaithfulNetwork,
    mesh: Propagation,
    memory: faithful::Memory,
    view: View,
}

impl Faithful {
    /// The network of a weight file's bytes.
    ///
    /// # Errors
    /// [`WeightsError`].
    pub fn new(file: &[u8]) -> Result<Self, WeightsError> {
        let edges: Vec<(usize, usize)> = describe::graph().edges().collect();
        let mesh = Propagation::new(NODE_COUNT, &edges);
        let network = FaithfulNetwork::new(file)?;
        Ok(Faithful { network, mesh, memory: faithful::Memory::default(), view: View::default() })
    }
}

impl Predictor for Faithful {
    fn name(&self) -> String {
        "the paper's network".to_owned()
    }

    fn displacement(&mut self, sample: &Sample, input: &Input) -> Option<Field> {
        Prepared::new(sample).view(0, &mut self.view);
        let soft = self.network.encode_patch(&input.rest_mm, &self.mesh, &mut self.memory);
        Some(self.network.predict(&soft, &self.view.rigid, &mut self.memory))
    }
}

/// The networks whose weights lie in `folder`, and for each that cannot be used why.
pub fn networks(folder: &Path) -> (Vec<Contact>, Option<Faithful>, Vec<String>) {
    let mut refused = Vec::new();
    let mut bytes = |name: &str| {
        let path = folder.join(format!("{name}.safetensors"));
        std::fs::read(&path).map_err(|cause| refused.push(format!("{}: {cause}", path.display()))).ok()
    };
    let (contact, corrected, paper) = (bytes("contact"), bytes("corrected"), bytes(faithful::NAME));
    let mut used = Vec::new();
    for (start, file) in [(Start::Linear, contact), (Start::Coarse, corrected)] {
        match file.map(|file| Contact::new(start, &file)) {
            Some(Ok(network)) => used.push(network),
            Some(Err(cause)) => refused.push(format!("{}: {cause}", start.network())),
            None => {}
        }
    }
    let paper = match paper.map(|file| Faithful::new(&file)) {
        Some(Err(cause)) => {
            refused.push(format!("{}: {cause}", faithful::NAME));
            None
        }
        Some(Ok(network)) => Some(network),
        None => None,
    };
    (used, paper, refused)
}
