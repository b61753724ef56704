//! `train`: a network from a folder of shards to weights with their card.

use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::contact::learn::ContactLearner;
use crate::contact::network::Form;
use retina_core::network::weights::hash;

use crate::data::Data;
use crate::faithful::learn::FaithfulLearner;
use crate::faithful::variant::Variant;
use crate::sample::{Sample, Split};
use crate::shard;
use crate::train::card::{self, Card, Parity};
use crate::train::checkpoint::write_whole;
use crate::train::export::{self, Named};
use crate::train::record::{self, Record};
use crate::train::run::{self, Learner, Settings, State};

/// Which network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Which {
    /// Corrects the linear answer.
    Contact,
    /// Corrects level `coarse`.
    Corrected,
    /// The paper's.
    Faithful,
}

/// Arguments of `train`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// Which network.
    #[arg(long, value_enum)]
    network: Which,
    /// Folder with the shards of a data set; several may be given.
    #[arg(long, required = true)]
    data: Vec<PathBuf>,
    /// Folder for checkpoint, weights, card and record; a run found there goes on.
    #[arg(long)]
    out: PathBuf,
    /// How long it may take; the number of epochs is found by timing some batches.
    #[arg(long, default_value_t = 20.0)]
    minutes: f64,
    /// Number of epochs, in place of `--minutes`: the same number gives the same weights.
    #[arg(long)]
    epochs: Option<usize>,
    /// Everything random follows from it.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Samples a step: 64, or the paper's 4.
    #[arg(long)]
    batch: Option<usize>,
    /// Largest step of Adam: 2e-3, or the paper's 4e-4.
    #[arg(long)]
    rate: Option<f32>,
    /// Weight decay per unit of step: 0.5, or the paper's none.
    #[arg(long)]
    decay: Option<f32>,
    /// Epochs without a better validation after which it ends.
    #[arg(long, default_value_t = 100)]
    patience: usize,
    /// Width of the trunk.
    #[arg(long, default_value_t = 128)]
    width: usize,
    /// Blocks of the trunk.
    #[arg(long, default_value_t = 4)]
    blocks: usize,
    /// How many of them hear their neighbours.
    #[arg(long, default_value_t = 0)]
    messages: usize,
}

/// Hidden width of the heads.
const HIDDEN: usize = 64;
/// How a network is trained unless told.
pub(super) struct Defaults {
    pub(super) batch: usize,
    /// Samples whose gradient is computed at once.
    pub(super) chunk: usize,
    pub(super) rate: f32,
    pub(super) decay: f32,
}
/// The contact networks.
const CONTACT: Defaults = Defaults { batch: 64, chunk: 16, rate: 2e-3, decay: 0.5 };
/// The paper's: its public configuration.
pub(super) const FAITHFUL: Defaults = Defaults { batch: 4, chunk: 1, rate: 4e-4, decay: 0.0 };
/// File of the settings that a run began with.
const SETTINGS: &str = "settings.json";

/// Trains.
///
/// # Errors
/// What reading, training or writing said.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let data = Data::read(&arguments.data)?;
    if arguments.network == Which::Faithful {
        let learner = FaithfulLearner::new(&data.samples, Variant::PAPER);
        let state = train(arguments, &learner, &FAITHFUL)?;
        return finish(arguments, &learner, &data, &state, learner.tensors(&state.best), None);
    }
    let Arguments { width, blocks, messages, .. } = *arguments;
    let form = Form { coarse: arguments.network == Which::Corrected, width, blocks, messages, hidden: HIDDEN };
    let learner = ContactLearner::new(form, &data.samples);
    let state = train(arguments, &learner, &CONTACT)?;
    let checked = |sample: &&Sample| sample.split == Split::Validation && (!form.coarse || sample.coarse.is_some());
    if let Some(sample) = data.samples.iter().find(checked) {
        shard::write(&arguments.out.join(format!("{}.parity.safetensors", learner.network())), &[*sample])?;
    }
    finish(arguments, &learner, &data, &state, learner.tensors(&state.best), learner.parity(&state.best))
}

fn train(arguments: &Arguments, learner: &dyn Learner, defaults: &Defaults) -> Result<State, Box<dyn Error>> {
    let [train, validation] = learner.counts();
    if train == 0 || validation == 0 {
        return Err(format!("{train} samples to train on and {validation} to validate on are too few").into());
    }
    std::fs::create_dir_all(&arguments.out)?;
    let kept = arguments.out.join(SETTINGS);
    let mut settings = Settings {
        seed: arguments.seed,
        epochs: 0,
        batch: arguments.batch.unwrap_or(defaults.batch),
        chunk: defaults.chunk,
        rate: arguments.rate.unwrap_or(defaults.rate),
        decay: arguments.decay.unwrap_or(defaults.decay),
        patience: arguments.patience,
    };
    let begun: Option<Settings> = std::fs::read(&kept).ok().and_then(|text| serde_json::from_slice(&text).ok());
    settings.epochs = match (arguments.epochs, begun) {
        (Some(epochs), _) => epochs,
        // A run that goes on keeps the number that it began with: timing it again would change its schedule.
        (None, Some(begun)) => begun.epochs,
        (None, None) => run::epochs_within(learner, &settings, arguments.minutes),
    };
    write_whole(&kept, serde_json::to_string(&settings)?.as_bytes())?;
    eprintln!(
        "{}: {} parameters, {train} samples to train on, {validation} to validate on, {} epochs",
        learner.network(),
        learner.layout().len(),
        settings.epochs
    );
    Ok(run::train(learner, &settings, &arguments.out)?)
}

fn finish(
    arguments: &Arguments,
    learner: &dyn Learner,
    data: &Data,
    state: &State,
    tensors: Vec<Named>,
    parity: Option<Parity>,
) -> Result<(), Box<dyn Error>> {
    let settings = serde_json::from_slice(&std::fs::read(arguments.out.join(SETTINGS))?)?;
    let name = learner.network();
    let record = Record {
        network: name.to_owned(),
        parameters: learner.layout().len(),
        data_sha256: data.sha256.clone(),
        samples: learner.counts(),
        commit: record::commit(),
        settings,
        best_epoch: state.best_epoch().unwrap_or(0),
        curve: state.curve.clone(),
    };
    let about = [
        ("data_sha256", data.sha256.clone()),
        ("commit", record.commit.clone().unwrap_or_default()),
        ("seed", record.settings.seed.to_string()),
        ("epochs", record.settings.epochs.to_string()),
    ];
    let file = export::weights(name, &tensors, &about)?;
    write_whole(&arguments.out.join(format!("{name}.safetensors")), &file)?;
    let (what, limits) = match parity {
        Some(_) => (card::CONTACT, card::CONTACT_LIMITS),
        None => (card::FAITHFUL, card::FAITHFUL_LIMITS),
    };
    let card = Card {
        network: name.to_owned(),
        what: what.to_owned(),
        limits: limits.to_owned(),
        data_sha256: data.sha256.clone(),
        samples: learner.counts(),
        seed: record.settings.seed,
        epochs: [record.settings.epochs, record.best_epoch],
        parameters: record.parameters,
        weights_sha256: hash(&file),
        validation_node_um: state.curve.get(record.best_epoch).map_or(f64::NAN, |epoch| epoch.validation.node_um),
        parity,
    };
    write_whole(&arguments.out.join(format!("{name}.card.json")), serde_json::to_string_pretty(&card)?.as_bytes())?;
    write_whole(&arguments.out.join(format!("{name}.record.json")), serde_json::to_string(&record)?.as_bytes())?;
    let mut told = String::new();
    if let Some(best) = state.curve.get(record.best_epoch) {
        write!(told, "validation at epoch {}: nodes {:.3} µm", record.best_epoch + 1, best.validation.node_um)?;
        write!(told, ", travel {:.3} µm", best.validation.travel_um)?;
        write!(told, ", reaction {:.3} % of the force", 100.0 * best.validation.reaction)?;
    }
    println!("{told}; {} bytes of weights in {}", file.len(), arguments.out.display());
    Ok(())
}
