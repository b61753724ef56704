//! The run: threads take blocks, the caller's thread keeps them in order, fills the shards and shows how far it is.
//!
//! A data set is a folder with `manifest.json`, the shards `SPLIT-NNN.safetensors` and the folder `blocks` from which a run goes on: the same command again
//! computes only what is missing. A path follows from the seed and its number alone, so threads change nothing.

use std::path::Path as FilePath;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};

use indicatif::{ProgressBar, ProgressStyle};
use retina_core::predict::PreparedScene;
use retina_core::predict::finite_element::Resolution;
use retina_core::scene::Scene;

use super::blocks::{BlockRecord, Blocks, PATHS_PER_BLOCK};
use super::draw::{Depths, Tips, plan};
use super::error::DatasetError;
use super::manifest::{Counts, FILE, Manifest, Settings};
use super::part::Part;
use super::path::{Cause, Path, PathMemory, PathOutcome, before_limit_point};
use super::shards::Shards;
use super::truth;

/// The folder of finished work below a data set's.
pub const BLOCKS: &str = "blocks";
/// Blocks after which growing shards and manifest are written again.
const BLOCKS_PER_FLUSH: u32 = 2;

/// What to make.
#[derive(Debug, Clone)]
pub struct Order {
    /// The scene's name, or `all`.
    pub scene: String,
    /// How many paths.
    pub paths: u32,
    /// How deep they go.
    pub depths: Depths,
    /// Which tips they have.
    pub tips: Tips,
    /// The seed.
    pub seed: u64,
    /// Threads.
    pub threads: usize,
    /// How fine the truth is: [`truth::TRUTH`], but for tests that cannot wait.
    pub resolution: Resolution,
}

impl Order {
    /// `paths` deep paths on `scene` from `seed` with `threads` threads.
    pub fn new(scene: &str, paths: u32, seed: u64, threads: usize) -> Self {
        Order {
            scene: scene.to_owned(),
            paths,
            depths: Depths::Deep,
            tips: Tips::All,
            seed,
            threads,
            resolution: truth::TRUTH,
        }
    }

    /// Indices of the scenes among the built-in names.
    fn scenes(&self) -> Result<Vec<u8>, DatasetError> {
        let names = Scene::built_in_names();
        let chosen: Vec<u8> =
            (0..names.len() as u8).filter(|&i| self.scene == "all" || self.scene == names[usize::from(i)]).collect();
        if chosen.is_empty() {
            let allowed = format!("{}, all", names.join(", "));
            return Err(DatasetError::Value { field: "scene", value: self.scene.clone(), allowed });
        }
        Ok(chosen)
    }
}

/// What a run did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Summary {
    /// What there is now.
    pub counts: Counts,
    /// Paths that were computed by this run and not found finished.
    pub computed: u32,
    /// Samples that they gave.
    pub new_samples: usize,
}

/// Makes what `order` asks for in `folder`, going on from what is finished there.
///
/// # Errors
/// [`DatasetError`]; what was finished before it stays.
pub fn generate(order: &Order, folder: &FilePath, progress: &ProgressBar) -> Result<Summary, DatasetError> {
    let (scenes, settings, blocks) = begin(order, folder)?;
    let mut finished = Vec::new();
    for block in 0..order.paths.div_ceil(PATHS_PER_BLOCK) {
        let (from, to) = order.paths_of(block);
        finished.push(blocks.record(block, from, to)?);
    }
    let missing: Vec<u32> =
        finished.iter().enumerate().filter(|(_, r)| r.is_none()).map(|(block, _)| block as u32).collect();
    let work = Work::new(order, &scenes, &blocks, &missing)?;
    let mut collected = Collected { settings, folder, shards: Shards::new(folder), counts: Counts::default() };
    collected.counts.paths = order.paths;
    let mut summary = Summary { counts: Counts::default(), computed: 0, new_samples: 0 };
    show(progress, order.paths);
    std::thread::scope(|scope| -> Result<(), DatasetError> {
        let (done, news) = channel();
        for _ in 0..order.threads.min(missing.len()) {
            let done = done.clone();
            let work = &work;
            scope.spawn(move || work.labour(&done));
        }
        drop(done);
        let gathered = (0..finished.len() as u32).try_for_each(|block| {
            // What was finished before this run is in the shards already: those on disk are not made shorter for a while.
            let fresh = finished[block as usize].is_none();
            while finished[block as usize].is_none() {
                // A thread that is gone without its block has sent its error before.
                let Ok(message) = news.recv() else { return Err(DatasetError::malformed(folder, "a thread ended")) };
                let (block, record): (u32, BlockRecord) = message?;
                summary.computed += record.paths.len() as u32;
                summary.new_samples += record.paths.iter().map(|path| path.samples).sum::<usize>();
                finished[block as usize] = Some(record);
            }
            let record = finished[block as usize].as_ref().ok_or_else(|| DatasetError::malformed(folder, "lost"))?;
            collected.add(&blocks, block, record)?;
            progress.set_position(u64::from(collected.counts.finished));
            progress.set_message(format!("{} samples", collected.counts.all_samples()));
            if fresh && block % BLOCKS_PER_FLUSH == 0 { collected.flush() } else { Ok(()) }
        });
        work.stop.store(true, Ordering::Relaxed);
        gathered
    })?;
    collected.flush()?;
    progress.finish();
    Ok(Summary { counts: collected.counts, ..summary })
}

/// Computes the blocks of one part that are missing in `folder`, and leaves shards and manifest to a run without a part, which finds every block
/// finished. Runs of other parts may go on in the same folder at the same time. Returns the paths computed and the samples that they gave.
///
/// # Errors
/// [`DatasetError`]; what was finished before it stays.
pub fn generate_part(
    order: &Order,
    part: Part,
    folder: &FilePath,
    progress: &ProgressBar,
) -> Result<(u32, usize), DatasetError> {
    let (scenes, _, blocks) = begin(order, folder)?;
    let mut missing = Vec::new();
    for block in (0..order.paths.div_ceil(PATHS_PER_BLOCK)).filter(|block| part.has(*block)) {
        let (from, to) = order.paths_of(block);
        if blocks.record(block, from, to)?.is_none() {
            missing.push(block);
        }
    }
    let work = Work::new(order, &scenes, &blocks, &missing)?;
    show(progress, missing.iter().map(|block| order.paths_of(*block)).map(|(from, to)| to - from).sum());
    let (mut computed, mut new_samples) = (0, 0);
    std::thread::scope(|scope| -> Result<(), DatasetError> {
        let (done, news) = channel();
        for _ in 0..order.threads.min(missing.len()) {
            let (done, work) = (done.clone(), &work);
            scope.spawn(move || work.labour(&done));
        }
        drop(done);
        let counted = news.iter().try_for_each(|message| {
            let (_, record) = message?;
            computed += record.paths.len() as u32;
            new_samples += record.paths.iter().map(|path| path.samples).sum::<usize>();
            progress.set_position(u64::from(computed));
            progress.set_message(format!("{new_samples} samples"));
            Ok(())
        });
        work.stop.store(true, Ordering::Relaxed);
        counted
    })?;
    progress.finish();
    Ok((computed, new_samples))
}

/// Checks an order and opens its folder: the scenes, what the samples are drawn from, the blocks.
fn begin(order: &Order, folder: &FilePath) -> Result<(Vec<u8>, Settings, Blocks), DatasetError> {
    let scenes = order.scenes()?;
    for (field, value) in [("paths", order.paths as usize), ("threads", order.threads)] {
        if value == 0 {
            return Err(DatasetError::Value { field, value: value.to_string(), allowed: "1 or more".to_owned() });
        }
    }
    std::fs::create_dir_all(folder).map_err(DatasetError::io(folder))?;
    let settings = Settings::new(order.seed, &scenes, order.depths, order.tips);
    settings.check(folder)?;
    let manifest = folder.join(FILE);
    if !manifest.exists() {
        let counts = Counts { paths: order.paths, ..Counts::default() };
        let written = Manifest::new(settings.clone(), counts, Vec::new()).write(folder);
        // A run of another part may have written the same a moment before.
        written.or_else(|error| if manifest.exists() { settings.check(folder) } else { Err(error) })?;
    }
    Ok((scenes, settings, Blocks::open(&folder.join(BLOCKS))?))
}

fn show(progress: &ProgressBar, paths: u32) {
    progress.set_style(ProgressStyle::with_template(TEMPLATE).unwrap_or_else(|_| ProgressStyle::default_bar()));
    progress.set_length(u64::from(paths));
}

const TEMPLATE: &str = "{bar:40} {pos}/{len} paths, {msg}, {elapsed_precise} (still {eta_precise})";

impl Order {
    /// First path of a block, and the one after its last.
    fn paths_of(&self, block: u32) -> (u32, u32) {
        (block * PATHS_PER_BLOCK, ((block + 1) * PATHS_PER_BLOCK).min(self.paths))
    }
}

/// What the threads share.
struct Work<'a> {
    order: &'a Order,
    scenes: &'a [u8],
    blocks: &'a Blocks,
    missing: &'a [u32],
    next: AtomicUsize,
    stop: AtomicBool,
    /// The built-in scenes, prepared once for all paths on their own tissue.
    prepared: Vec<PreparedScene>,
}

impl<'a> Work<'a> {
    fn new(order: &'a Order, scenes: &'a [u8], blocks: &'a Blocks, missing: &'a [u32]) -> Result<Self, DatasetError> {
        let built_in = Scene::built_in_names().iter().filter_map(|name| Scene::built_in(name));
        let prepared = built_in.map(PreparedScene::new).collect::<Result<_, _>>()?;
        let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
        Ok(Work { order, scenes, blocks, missing, next, stop, prepared })
    }

    /// One thread's work: block after block until none is left.
    fn labour(&self, done: &Sender<Result<(u32, BlockRecord), DatasetError>>) {
        let mut memory = PathMemory::default();
        while let Some(&block) = self.missing.get(self.next.fetch_add(1, Ordering::Relaxed)) {
            let result = self.block(block, &mut memory);
            let Some(result) = result.transpose() else { return };
            let failed = result.is_err();
            if done.send(result).is_err() || failed {
                return;
            }
        }
    }

    /// Computes and keeps a block; `None` if the run is stopped.
    fn block(&self, block: u32, memory: &mut PathMemory) -> Result<Option<(u32, BlockRecord)>, DatasetError> {
        let (from, to) = self.order.paths_of(block);
        let mut outcomes = Vec::new();
        for path in from..to {
            if self.stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            outcomes.push((path, self.path(path, memory)?));
        }
        self.blocks.keep(block, &outcomes)?;
        let record = self.blocks.record(block, from, to)?;
        Ok(record.map(|record| (block, record)))
    }

    fn path(&self, path: u32, memory: &mut PathMemory) -> Result<PathOutcome, DatasetError> {
        let none = |cause| PathOutcome { samples: Vec::new(), ended_by: Some(cause), iterations: 0 };
        let Some(plan) = plan(self.order.seed, path, self.scenes, self.order.depths, self.order.tips) else {
            return Ok(none(Cause::NoStart));
        };
        let own;
        let prepared = match plan.default_tissue {
            true => &self.prepared[usize::from(plan.scene_index)],
            false => {
                own = PreparedScene::new(plan.scene.clone())?;
                &own
            }
        };
        Ok(match Path::new(&plan, prepared, self.order.resolution) {
            Ok(path) => path.run(memory),
            Err(cause) => none(cause),
        })
    }
}

/// What the finished blocks come to.
struct Collected<'a> {
    settings: Settings,
    folder: &'a FilePath,
    shards: Shards,
    counts: Counts,
}

impl Collected<'_> {
    /// Adds a finished block. What follows from its samples alone is decided here and not where they were computed, so that blocks outlast it: where a path
    /// passes a limit point, and the estimated error of the truth.
    fn add(&mut self, blocks: &Blocks, block: u32, record: &BlockRecord) -> Result<(), DatasetError> {
        let samples = blocks.samples(block, record)?;
        for path in &record.paths {
            let mut of: Vec<_> = samples.iter().filter(|sample| sample.path == path.path).copied().collect();
            let mut path = path.clone();
            let usable = before_limit_point(&of);
            if usable < of.len() {
                of.truncate(usable);
                path.samples = usable;
                path.ended_by = Some(Cause::LimitPoint.name().to_owned());
            }
            of.iter_mut().for_each(|sample| sample.truth_error_mm = truth::error_mm(sample));
            self.shards.add(&of)?;
            self.counts.add(&path, of.first().map(|sample| sample.split));
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), DatasetError> {
        let shards = self.shards.flush()?;
        Manifest::new(self.settings.clone(), self.counts.clone(), shards).write(self.folder)
    }
}
