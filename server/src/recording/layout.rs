//! What the viewer shows when a recording opens.
//!
//! Contract: names in the layout say what is seen and in which unit; paths are those of `entities`. The viewer's camera cannot be set
//! through the blueprint API of this version, so it is written into the same blueprint store (see [`Layout::send`]).

use rerun::blueprint::components::{BackgroundKind, PanelState, PlayState};
use rerun::blueprint::{
    Blueprint, BlueprintActivation, BlueprintPanel, ContainerLike, Horizontal, SelectionPanel, Spatial3DView, Tabs,
    TextDocumentView, TextLogView, TimePanel, TimeSeriesView, Vertical,
};
use rerun::external::re_log_types::{BlueprintActivationCommand, StoreId};
use rerun::external::re_sdk_types::blueprint::archetypes::{Background, EyeControls3D, LineGrid3D};
use rerun::log::{Chunk, LogMsg, RowId};
use rerun::{AsComponents, Color, RecordingStream, RecordingStreamBuilder, RecordingStreamResult, TimePoint, Timeline};

use super::entities::{self as at, ERROR_MAGNIFICATION};

/// Where the camera stands (mm): in front of the patch and above it, near enough to fill a third of a screen.
const EYE_MM: [f32; 3] = [0.0, -3.1, 2.1];

/// What the camera looks at (mm).
const TARGET_MM: [f32; 3] = [0.0, -0.3, 0.15];

/// Dark, so that pale colours stand out.
const BACKGROUND: [u8; 3] = [24, 27, 33];

/// The timeline of blueprints, which is rerun's.
const BLUEPRINT_TIMELINE: &str = "blueprint";

/// Which recording is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Predicted, ground truth and error side by side, plots below.
    Review,
    /// The latest answer with its request, plots and problems below.
    Service,
}

impl Layout {
    /// Makes `stream` open in this layout.
    ///
    /// # Errors
    /// If the layout cannot be written.
    pub fn send(self, stream: &RecordingStream, application: &'static str) -> RecordingStreamResult<()> {
        let mut cameras = Vec::new();
        let root = match self {
            Layout::Review => review(&mut cameras),
            Layout::Service => service(&mut cameras),
        };
        let (timeline, play) = match self {
            Layout::Review => (at::SAMPLE, PlayState::Paused),
            Layout::Service => (at::REQUEST_NUMBER, PlayState::Following),
        };
        let blueprint = Blueprint::new(root)
            .with_auto_views(false)
            .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Collapsed))
            .with_selection_panel(SelectionPanel::from_state(PanelState::Collapsed))
            .with_time_panel(
                TimePanel::new().with_state(PanelState::Collapsed).with_timeline(timeline).with_play_state(play),
            );
        let (memory, storage) = RecordingStreamBuilder::new(application).enabled(true).memory()?;
        blueprint.send(&memory, BlueprintActivation::default())?;
        let is_blueprint = |message: &LogMsg| message.store_id().is_blueprint();
        let mut messages: Vec<LogMsg> = storage.take().into_iter().filter(is_blueprint).collect();
        messages.retain(|message| !matches!(message, LogMsg::BlueprintActivationCommand(_)));
        let Some(store) = messages.first().map(|message| message.store_id().clone()) else { return Ok(()) };
        for view in &cameras {
            for (name, property) in view_properties() {
                messages.push(property_message(&store, &format!("{view}/{name}"), property.as_ref())?);
            }
        }
        let activation = BlueprintActivationCommand { blueprint_id: store, make_active: true, make_default: true };
        stream.send_blueprint(messages, activation);
        Ok(())
    }
}

/// Camera, background and no grid: the patch is its own.
fn view_properties() -> [(&'static str, Box<dyn AsComponents>); 3] {
    let [red, green, blue] = BACKGROUND;
    [
        (
            "EyeControls3D",
            Box::new(
                EyeControls3D::new().with_position(EYE_MM).with_look_target(TARGET_MM).with_eye_up([0.0, 0.0, 1.0]),
            ),
        ),
        (
            "Background",
            Box::new(Background::new(BackgroundKind::SolidColor).with_color(Color::from_rgb(red, green, blue))),
        ),
        ("LineGrid3D", Box::new(LineGrid3D::new().with_visible(false))),
    ]
}

fn property_message(store: &StoreId, path: &str, property: &dyn AsComponents) -> RecordingStreamResult<LogMsg> {
    let time = TimePoint::default().with(Timeline::new_sequence(BLUEPRINT_TIMELINE), 0);
    let chunk = Chunk::builder(path).with_archetype(RowId::new(), time, property).build()?;
    Ok(LogMsg::ArrowMsg(store.clone(), chunk.to_arrow_msg()?))
}

/// A 3-D view of these entities, whose place in the blueprint joins `cameras`.
fn space(name: &str, origin: &str, cameras: &mut Vec<String>) -> ContainerLike {
    let view: ContainerLike =
        Spatial3DView::new(name).with_origin(origin).with_contents(["$origin/**".to_owned()]).into();
    if let ContainerLike::View(view) = &view {
        cameras.push(view.blueprint_path().to_string());
    }
    view
}

fn plot(name: &str, origin: &str) -> ContainerLike {
    TimeSeriesView::new(name).with_origin(origin).into()
}

fn review(cameras: &mut Vec<String>) -> Vertical {
    let above = Horizontal::new([
        space("Predicted · displacement", at::PREDICTED, cameras),
        space("Ground truth · displacement", at::GROUND_TRUTH, cameras),
        space(&format!("Error of the prediction · arrows × {ERROR_MAGNIFICATION}"), at::ERROR, cameras),
    ]);
    let texts = Tabs::new([
        TextDocumentView::new("Sample").with_origin(at::REQUEST).into(),
        TextLogView::new("Failures").with_origin(at::FAILURES).into(),
    ]);
    let below = Horizontal::new([
        texts.into(),
        plot("Node error, µm", at::STATISTICS),
        plot("Displacement, µm", at::DISPLACEMENT),
        plot("Time", at::TIME),
        plot("Newton iterations", at::ITERATIONS),
    ])
    .with_column_shares(vec![1.8, 1.2, 1.0, 1.0, 1.0]);
    Vertical::new([above.into(), below.into()]).with_row_shares(vec![1.5, 1.0])
}

fn service(cameras: &mut Vec<String>) -> Vertical {
    let above = Horizontal::new([
        space("Answer · displacement", at::ANSWER, cameras),
        TextDocumentView::new("Asked and answered").with_origin(at::REQUEST).into(),
    ])
    .with_column_shares(vec![2.0, 1.0]);
    let below = Horizontal::new([
        plot("Displacement, µm", at::DISPLACEMENT),
        plot("Time, ms", at::TIME),
        plot("Newton iterations", at::ITERATIONS),
        plot("Missing in this recording", at::DROPPED),
        TextLogView::new("Problems").with_origin(at::FAILURES).into(),
    ]);
    Vertical::new([above.into(), below.into()]).with_row_shares(vec![1.5, 1.0])
}
