"""The messages of the service, as `/openapi.json` has them. Written by `generate_messages.py`: change nothing here."""

from __future__ import annotations

from typing import Any, Dict, List, Literal, Optional, TypedDict, Union


class _AboutRequired(TypedDict):
    effects: List[str]
    """Names of the effects; their order is that of the bits in a binary answer."""
    features: List[str]
    """Cargo features that it was built with."""
    levels: List[str]
    """Names of the levels, cheapest first."""
    limits: "AboutLimits"
    """What it allows."""
    name: str
    """Name of the program."""
    version: str
    """Its version."""
    weights: List["WeightsEntry"]
    """The weights of the learned levels."""


class About(_AboutRequired, total=False):
    """`GET /v1/about`."""
    commit: Optional[str]
    """The commit that it was built from, where the build was told by the variable `RETINA_COMMIT`."""


class _AboutLimitsRequired(TypedDict):
    batch_poses: int
    """Poses of a batch."""
    body_bytes: int
    """Largest body of a request, bytes."""
    queue: int
    """Jobs that may wait for one."""
    simulation_steps: int
    """Steps of a simulation."""
    simulation_time_limit_ms: int
    """How long a simulation or a batch may take, ms."""
    stream_idle_ms: int
    """How long a stream's client may be silent, ms."""
    stream_memories: int
    """Sessions with memory at once."""
    stream_message_bytes: int
    """Longest message of a stream, bytes."""
    streams: int
    """Streams at once."""
    threads: int
    """Numerical threads."""
    time_limit_ms: int
    """How long the work on a prediction may take, ms."""


class AboutLimits(_AboutLimitsRequired, total=False):
    """What a service allows."""
    max_wait_ms: Optional[int]
    """How long a prediction may wait for a thread, ms; left out where the queue alone bounds it."""


class AccuracyAnswer(TypedDict):
    """How accurate the answer is."""
    calibrated: bool
    """Whether that was measured on requests like this one (tissue, needle, pose)."""
    expected_error_um: "ExpectedErrorAnswer"
    """How far the worst node of the patch is likely to be from the truth."""
    level: str
    """The level that answered."""


class AccuracySpec(TypedDict, total=False):
    """How accurate, and at what cost."""
    level: Optional[str]
    """The level that answers, see `GET /v1/levels`; `coarse` when neither this nor a promise is given."""
    max_error_um: Optional[float]
    """Largest error of the worst node of the patch that is accepted, kept in 95 of 100 requests, µm: the cheapest
    level that keeps it answers.
    """
    max_time_ms: Optional[float]
    """Longest time from the arrival of the request to its answer that is accepted, ms, by the service's clock
    (header `Server-Timing` of the answer): with `max_error_um` it bounds the choice, alone it asks for the most
    accurate level in time.
    """
    strict: bool
    """Whether a promise that no level is expected to keep is refused; otherwise the best there is answers, with a
    warning.
    """


class _AnswerMessageRequired(TypedDict):
    dropped: int
    """Poses since the last answer that were overtaken by a newer one and have none."""
    prediction: "PoseAnswer"
    """What the surface looks like."""
    sequence: int
    """The pose's number."""
    time_us: "StreamTimes"
    """The server's times."""


class AnswerMessage(_AnswerMessageRequired, total=False):
    """The answer to a pose."""
    client_time_us: Optional[float]
    """The client's number, as it was given."""
    time_s: Optional[float]
    """The pose's time, in a session with memory, s."""


class BatchAnswerPrediction(TypedDict):
    """What the surface looks like."""
    prediction: "PoseAnswer"
    """What the surface looks like."""


class BatchAnswerProblem(TypedDict):
    """Why there is none; fields are told from `poses[i]` on."""
    problem: "ProblemDocument"
    """Why there is none; fields are told from `poses[i]` on."""


BatchAnswer = Union["BatchAnswerPrediction", "BatchAnswerProblem"]
"""The answer to one pose."""


class _BatchPoseRequired(TypedDict):
    needle: "NeedleSpec"
    """The needle before it moves."""


class BatchPose(_BatchPoseRequired, total=False):
    """A needle and its force, as in a prediction."""
    control: "ControlName"
    """What is given about the needle's motion; `force` when left out."""
    force_mn: Optional["Vector"]


class _BatchRequestRequired(TypedDict):
    poses: List["BatchPose"]
    """The poses; the service says at `GET /v1/about` how many there may be."""


class BatchRequest(_BatchRequestRequired, total=False):
    """Many poses and what they are pressed into."""
    accuracy: Optional["AccuracySpec"]
    effects: Optional["EffectsSpec"]
    scene: Optional["SceneChoice"]


class BatchResponse(TypedDict):
    """The answers."""
    answers: List["BatchAnswer"]
    """One for each pose, in their order."""
    total_us: float
    """From the arrival of the request until the last answer, µs."""
    triangles: List["Triangle"]
    """Triangles between the nodes of every surface, counter-clockwise seen from the vitreous; empty for a mesh,
    whose answers bring their own.
    """


class BeginLine(TypedDict):
    """What holds for all steps."""
    effects: List["EffectAnswer"]
    """Every effect, simulated or not, and why."""
    level: str
    """The level that answers."""
    steps: int
    """Steps that will be computed."""
    triangles: List["Triangle"]
    """Triangles between the nodes of every surface, counter-clockwise seen from the vitreous."""


class BevelledTip(TypedDict, total=False):
    """A plane oblique to the shaft with a rounded edge."""
    angle_deg: Optional[float]
    """Angle between plane and shaft, degrees; 30 when left out."""
    edge_radius_mm: Optional[float]
    """Radius of the rounded edge, mm; a tenth of the needle's radius when left out."""


class BlebAnswer(TypedDict):
    """Fluid under the retina at equilibrium."""
    pressure_kpa: float
    """Its pressure above that in the eye, kPa."""
    pressure_mmhg: float
    """The same in mmHg."""
    volume_mm3: float
    """Its volume, mm³ (the same number in µl)."""


class BlebSpec(TypedDict, total=False):
    """Fluid between retina and choroid, where the retina is detached. Displacements are those from the surface
    without it.
    """
    center_mm: Optional["Vector"]
    pressure_kpa: Optional[float]
    """Pressure above that in the eye, kPa, 0 to 8; the volume is then part of the answer."""
    radius_mm: Optional[float]
    """Radius of the detached disc, mm, 0.2 to 1; 0.5 when left out."""
    volume_mm3: Optional[float]
    """Volume, mm³ (the same number in µl), 0 to 0.5; the pressure is then part of the answer. It or `pressure_kpa`
    must be given.
    """


class BondSpec(TypedDict, total=False):
    """How the retina holds on to the pigment epithelium under it; a number left out is the default."""
    fracture_energy_mn_per_mm: Optional[float]
    """Energy that letting go costs, mN/mm (the same number in N/m), 0.06 to 0.6; 0.14 when left out."""
    rate_exponent: Optional[float]
    """Power with which both grow with the speed of opening, 0 to 0.6; 0 (they do not) when left out. Read by `POST
    /v1/simulate` alone.
    """
    reference_speed_mm_per_s: Optional[float]
    """Speed of opening from about which on they grow, mm/s, 1e-6 to 100; 0.01 when left out."""
    strength_kpa: Optional[float]
    """Largest traction, kPa, 1 to 100; 40 when left out."""


class _ContactAnswerRequired(TypedDict):
    area_mm2: float
    """Contact area, measured on the surface at rest, mm²."""
    max_penetration_um: float
    """Deepest penetration of the needle that the contact law left, µm."""
    max_pressure_kpa: float
    """Largest contact pressure, kPa."""
    max_strain: float
    """Largest principal stretch minus one, in magnitude, anywhere in the tissue."""
    puncture_share: float
    """Force under the needle and strain over the limits of `scene.puncture`, the larger of the two: above 1 the
    tissue counts as punctured.
    """
    state: "ContactWord"
    """Whether needle and retina touch."""


class ContactAnswer(_ContactAnswerRequired, total=False):
    """The contact at equilibrium."""
    bleb: Optional["BlebAnswer"]
    bond_damage: Optional[float]
    """Largest share of the strength that the retina's bond has lost anywhere, 0 intact to 1 parted; told where
    `adhesion` is simulated.
    """
    slipping_share: Optional[float]
    """Share of the normal force that acts where the tissue slides along the needle, 0 to 1; told where `friction` is
    simulated.
    """


ContactWord = Literal["clear", "touching", "slipping", "punctured"]
"""Whether needle and retina touch."""


ControlName = Literal["force", "pose"]
"""What is given about the needle's motion."""


class CostCircumstances(TypedDict):
    """What a measurement was made with."""
    commit: str
    """Commit of the program."""
    processor: str
    """The processor, of which one core was used."""
    requests: int
    """Requests of each panel."""
    seed: int
    """Seed of the requests."""
    version: str
    """Version of the program."""


class CostPanel(TypedDict):
    """Requests of one kind."""
    caption: str
    """What the requests have in common."""
    floor_um: float
    """Error of the truth itself: what refining it once more may move, µm, in the median."""
    panel: str
    """`default`, `hard` or `outside`."""
    reference: "CostStanding"
    """Level `reference`, its error being the floor."""
    requests: int
    """Requests that `reference` answered and the others were held against."""
    standings: List["CostStanding"]
    """The other levels and the settings that were tried."""


class CostStanding(TypedDict):
    """What the errors and times of a level or a setting come to. Errors are those of a request's worst node."""
    failed: int
    """Requests without an answer."""
    knob: str
    """`level`, or what was turned: `mesh`, `tolerance`, `contact`, `effects`."""
    median_ms: float
    """Time on one core: median over the requests, ms."""
    median_um: float
    """Error: median over the requests, µm."""
    name: str
    """The level or the setting."""
    p99_ms: float
    """Time on one core: 99 % of the requests take no longer, ms."""
    p99_um: float
    """Error: 99 % of the requests are no further off, µm."""


class CostTable(TypedDict):
    """`GET /v1/accuracy`: errors and times of levels and settings, over requests of three kinds."""
    circumstances: "CostCircumstances"
    """What the measurement was made with."""
    panels: List["CostPanel"]
    """One panel a kind of request."""


class _EffectAnswerRequired(TypedDict):
    name: str
    """Name of the effect."""
    reason: str
    """Why, in words."""
    simulated: bool
    """Whether it was simulated."""


class EffectAnswer(_EffectAnswerRequired, total=False):
    """One effect: simulated or not, and why."""
    threshold: Optional[float]
    """What it was compared with."""
    value: Optional[float]
    """The number decided on, if there was one."""


EffectsSpec = Union[str, List[str]]
"""Which effects to simulate."""


class EndLine(TypedDict):
    """Every step was computed."""
    steps: int
    """Steps computed."""


class ErrorLine(TypedDict):
    """A step without an answer; the steps after it have nothing to start from."""
    problem: "ProblemDocument"
    """Why."""
    step: int
    """Index of the step, from 0."""
    time_s: float
    """Its time, s."""


class ExpectedErrorAnswer(TypedDict, total=False):
    """The error of the worst node of the patch, over requests like this one, µm; left out where too few were
    measured to say.
    """
    median: Optional[float]
    """Half of them err less."""
    p95: Optional[float]
    """95 of 100 err less."""


class _FieldErrorRequired(TypedDict):
    allowed: str
    """What is allowed in its place."""
    field: str
    """Path of the field in the request; empty for the whole body."""


class FieldError(_FieldErrorRequired, total=False):
    """A field at fault."""
    value: Any
    """The value that was refused, as far as it is a number, a word or something short."""


class FillingSpec(TypedDict, total=False):
    """How much fluid there is on the scene's detached disc: one of the two."""
    pressure_kpa: Optional[float]
    """Pressure above that in the eye, kPa, 0 to 8; the volume is then part of the answer."""
    volume_mm3: Optional[float]
    """Volume, mm³ (the same number in µl), 0 to 0.5; the pressure is then part of the answer. At 0 the detached
    retina lies on what is below.
    """


class FlatTip(TypedDict, total=False):
    """A plane across the shaft with a rounded edge."""
    edge_radius_mm: Optional[float]
    """Radius of the rounded edge, mm; a tenth of the needle's radius when left out."""


Format = Literal["json", "binary"]
"""Form of a session's answers."""


class GaugeEntry(TypedDict):
    """A needle size sold under a name."""
    name: str
    """The name."""
    outer_diameter_mm: float
    """Outer diameter, mm."""
    source: str
    """Where the diameter comes from."""
    stiffness_mn_per_mm: float
    """Force across the shaft that moves the tip by 1 mm, mN/mm: the value of `needle.stiffness_mn_per_mm` when left
    out.
    """


class GaugeList(TypedDict):
    """`GET /v1/gauges`."""
    default: str
    """The gauge of a request that gives neither gauge nor radius."""
    gauges: List["GaugeEntry"]
    """The gauges, thin to thick."""


class LayerSpec(TypedDict, total=False):
    """One homogeneous, isotropic elastic layer; a number left out is that of the layer's default."""
    poisson_ratio: Optional[float]
    """Poisson's ratio, 0 to 0.4999."""
    thickness_mm: Optional[float]
    """Thickness along the inward normal, mm."""
    youngs_modulus_kpa: Optional[float]
    """Young's modulus at small strain, kPa."""


class LevelEntry(TypedDict):
    """A level."""
    cost: str
    """The order of its cost on one core."""
    name: str
    """Its name."""
    what: str
    """What it is."""


class LevelList(TypedDict):
    """`GET /v1/levels`."""
    default: str
    """The level of a request that names none."""
    levels: List["LevelEntry"]
    """The levels, cheapest first."""


class MemoryOpened(TypedDict):
    """What holds for all poses of a session with memory."""
    effects: List["EffectAnswer"]
    """Every effect, simulated or not, and why."""
    level: str
    """The level that answers."""


class MemorySpec(TypedDict):
    """What a session that remembers is planned from, since it does not know the next pose."""
    rehearsal: List["StepSpec"]
    """Steps that span what the session will do: the deepest press, the farthest reach, the fastest change. They are
    planned like those of `POST /v1/simulate` (which effects, one mesh around all contacts) and not simulated. The
    first has a `tip_mm`: there the needle is at time 0.
    """


class _NeedleAnswerRequired(TypedDict):
    reaction_mn: "Vector"
    """Force of the tissue on the needle, scene frame, mN."""
    tip_mm: "Vector"
    """Foremost point, scene frame, mm; the deflection is in it."""
    travel_mm: float
    """Advance along the force from where the needle was given, mm; zero under pose control."""


class NeedleAnswer(_NeedleAnswerRequired, total=False):
    """The needle at equilibrium."""
    deflection_mm: Optional["Vector"]


class _NeedleSpecRequired(TypedDict):
    tip_mm: "Vector"
    """Foremost point of the needle, scene frame, mm."""


class NeedleSpec(_NeedleSpecRequired, total=False):
    """A needle: where it is, where it points, how thick it is and how it ends."""
    direction: Optional["Vector"]
    gauge: Optional[str]
    """Size by name, see `GET /v1/gauges`; `25G` when neither this nor `radius_mm` is given."""
    orientation_xyzw: Optional["Quaternion"]
    radius_mm: Optional[float]
    """Radius of the shaft in place of a gauge, mm."""
    stiffness_mn_per_mm: Optional[float]
    """Force across the shaft that moves the tip by 1 mm, where the shaft bends, mN/mm, 1 to 1000000 (rigid); that of
    the gauge (see `GET /v1/gauges`) or of the radius when left out.
    """
    tip: Optional["TipSpec"]


class OpenSpec(TypedDict, total=False):
    """What holds for every pose of a session."""
    accuracy: Optional["AccuracySpec"]
    effects: Optional["EffectsSpec"]
    format: "Format"
    """Form of the answers; `json` when left out."""
    memory: Optional["MemorySpec"]
    needle: Optional["ShapeSpec"]
    scene: Optional["SceneChoice"]


class _OpenedMessageRequired(TypedDict):
    format: "Format"
    """Form of the answers."""
    protocol: int
    """Version of the messages."""
    triangles: List["Triangle"]
    """Triangles between the nodes of every surface, counter-clockwise seen from the vitreous; empty for a mesh,
    whose answers bring their own.
    """


class OpenedMessage(_OpenedMessageRequired, total=False):
    """The session has begun."""
    memory: Optional["MemoryOpened"]


class ParameterEntry(TypedDict):
    """A parameter with its default and the values allowed for it."""
    default: float
    """The value when left out."""
    field: str
    """Where the parameter stands in a request."""
    max: float
    """Largest allowed value, included."""
    min: float
    """Smallest allowed value, included."""
    name: str
    """What it is."""
    source: str
    """Where default and bounds come from; `[unverified]` marks what no source was found for."""
    unit: str
    """Unit of the numbers; `1` for a pure number."""


class PatchEntry(TypedDict):
    """The nodes that are reported."""
    nodes_per_side: int
    """Nodes along each side of the grid."""
    size_mm: float
    """Side of the grid, mm."""
    spacing_mm: float
    """Distance between neighbours of the grid in x and y, mm."""


class PoseAnswer(TypedDict):
    """What the surface looks like under this pose."""
    accuracy: "AccuracyAnswer"
    """How accurate the answer is."""
    contact: "ContactAnswer"
    """The contact at equilibrium."""
    effects: List[str]
    """Names of the effects that were simulated; `POST /v1/predict` gives the reasons."""
    needle: "NeedleAnswer"
    """The needle at equilibrium."""
    surface: "PoseSurface"
    """The deformed surface."""
    warnings: List[str]
    """What the caller should know besides."""


class PoseSpec(TypedDict, total=False):
    """Where the patch of an analytic surface stands in the scene."""
    orientation_xyzw: Optional["Quaternion"]
    position_mm: Optional["Vector"]


class _PoseSurfaceRequired(TypedDict):
    displacement_um: List[float]
    """Length of each node's displacement from rest, µm."""
    normals: List["Vector"]
    """Unit normals of the deformed surface at the nodes, out of the tissue."""
    vertices_mm: List["Vector"]
    """Deformed nodes, mm."""


class PoseSurface(_PoseSurfaceRequired, total=False):
    """The deformed surface, scene frame, in the order of a prediction's."""
    source_indices: Optional[List[int]]
    """For a patch cut from a mesh: the mesh's index of each node."""
    triangles: Optional[List["Triangle"]]
    """For a patch cut from a mesh: the triangles between its nodes, counter-clockwise seen from the vitreous."""


class _PredictRequestRequired(TypedDict):
    needle: "NeedleSpec"
    """The needle before it moves."""


class PredictRequest(_PredictRequestRequired, total=False):
    """A needle, a force and what they are pressed into."""
    accuracy: Optional["AccuracySpec"]
    control: "ControlName"
    """What is given about the needle's motion; `force` when left out."""
    effects: Optional["EffectsSpec"]
    force_mn: Optional["Vector"]
    scene: Optional["SceneChoice"]


class PredictResponse(TypedDict):
    """What the surface looks like now, where the needle is and what the answer cost."""
    accuracy: "AccuracyAnswer"
    """How accurate the answer is."""
    contact: "ContactAnswer"
    """The contact at equilibrium."""
    effects: List["EffectAnswer"]
    """Every effect, simulated or not, and why."""
    needle: "NeedleAnswer"
    """The needle at equilibrium."""
    solver: "SolverAnswer"
    """What the solution cost, in units that do not depend on the machine."""
    surface: "SurfaceAnswer"
    """The deformed surface."""
    time_us: "TimeAnswer"
    """What the answer cost on this machine."""
    warnings: List[str]
    """What the caller should know besides."""


class _ProblemDocumentRequired(TypedDict):
    detail: str
    """What happened this time."""
    status: int
    """The status of the response."""
    title: str
    """What it is, in a few words that never change."""
    type: str
    """Address of a page that explains the kind of problem."""


class ProblemDocument(_ProblemDocumentRequired, total=False):
    """A problem document, RFC 9457."""
    errors: List["FieldError"]
    """The fields at fault."""


class _ProblemMessageRequired(TypedDict):
    dropped: int
    """Poses since the last answer that were overtaken."""
    problem: "ProblemDocument"
    """What it is."""


class ProblemMessage(_ProblemMessageRequired, total=False):
    """What is wrong with a message."""
    client_time_us: Optional[float]
    """The client's number, as it was given."""
    sequence: Optional[int]
    """Number of the pose, where the message was one."""


class PronyTermSpec(TypedDict):
    """One term of a Prony series."""
    relaxation_time_s: float
    """Relaxation time, s."""
    share: float
    """Share of the instantaneous shear modulus that relaxes with it; all shares together leave the lasting one."""


class PunctureSpec(TypedDict, total=False):
    """Where the tissue punctures: an answer beyond a limit says so, by its contact's state. A number left out is the
    default.
    """
    max_force_mn: Optional[float]
    """Force under the needle, mN, 0.001 to 100; in place of `pressure_per_modulus`."""
    max_strain: Optional[float]
    """Largest principal stretch less one, in magnitude, 0.01 to 5; 1 when left out."""
    pressure_per_modulus: Optional[float]
    """Force over the needle's cross-section, in Young's moduli of the softest retina, 0.005 to 0.75; 0.75 when left
    out.
    """


Quaternion = List[float]
"""an array of 4 numbers: x, y, z, w"""


class RateSpec(TypedDict, total=False):
    """What of the tissue depends on time; a number left out is its default."""
    density_kg_per_mm3: Optional[float]
    """Density of every layer, kg/mm³."""
    retina_relaxation: Optional[List["PronyTermSpec"]]
    """Prony series of the retina's shear modulus above the lasting one, which is that of the layer; seven terms when
    left out, none for `[]`.
    """
    vitreous_drag_kpa_s_per_mm: Optional[float]
    """Pressure of the vitreous on the surface for its velocity, kPa·s/mm."""


class Readiness(TypedDict):
    """`GET /healthz` and `GET /readyz`."""
    status: str
    """`ok` or `ready`."""


RetinaSpec = Union["LayerSpec", List["LayerSpec"]]
"""The retina as one layer or as several."""


SceneChoice = Union[str, "SceneSpec"]
"""A built-in scene by name, or a scene written out."""


class SceneEntry(TypedDict):
    """A built-in scene, written out as a request may write one."""
    name: str
    """Its name."""
    scene: "SceneSpec"
    """What it is."""


class _SceneFormRequired(TypedDict):
    mesh: str
    """The bytes of a PLY, OBJ or STL file in mm; its name ends in .ply, .obj or .stl, or its media type says what it
    is.
    """


class SceneForm(_SceneFormRequired, total=False):
    """A scene as a form, for meshes as they lie on a disk."""
    scene: Optional["SceneSpec"]


class SceneList(TypedDict):
    """`GET /v1/scenes`."""
    default: str
    """The scene of a request that names none."""
    parameters: List["ParameterEntry"]
    """Every number of a scene with its default, its range and their source."""
    patch: "PatchEntry"
    """The patch that every scene reports."""
    scenes: List["SceneEntry"]
    """The built-in scenes."""
    store: "StoreEntry"
    """Where those are kept."""
    stored: List["StoredScene"]
    """Scenes of one's own, by id; see `POST /v1/scenes`."""


class SceneProgress(TypedDict):
    """How far the preparation is."""
    done: int
    """Steps that are done."""
    of: int
    """Steps in all."""
    step: str
    """What is being done: `waiting`, `read`, `linear` or `coarse`."""


class SceneSpec(TypedDict, total=False):
    """A scene written out."""
    bleb: Optional["BlebSpec"]
    friction_coefficient: Optional[float]
    """Coulomb's coefficient of friction between needle and retina, 0 to 2; 0 when left out."""
    pose: Optional["PoseSpec"]
    pressure_kpa: Optional[float]
    """Pressure in the eye, kPa (1 mmHg is 0.1333 kPa), 0 to 8; 2.07 when left out."""
    puncture: Optional["PunctureSpec"]
    rest_pressure_kpa: Optional[float]
    """Pressure in the eye when the surface was measured, kPa, 0 to 8; 2.07 when left out. The difference of the two
    presses on the surface.
    """
    surface: Optional["SurfaceSpec"]
    tissue: Optional["TissueSpec"]


SceneState = Literal["preparing", "ready", "failed", "corrupt"]
"""How far a stored scene is."""


class ShapeSpec(TypedDict, total=False):
    """A needle without its place."""
    gauge: Optional[str]
    """Size by name, see `GET /v1/gauges`; `25G` when neither this nor `radius_mm` is given."""
    radius_mm: Optional[float]
    """Radius of the shaft in place of a gauge, mm."""
    tip: Optional["TipSpec"]


class SimulateLineBegin(TypedDict):
    """The first line: every step has been checked."""
    begin: "BeginLine"
    """The first line: every step has been checked."""


class SimulateLineStep(TypedDict):
    """A step."""
    step: "StepLine"
    """A step."""


class SimulateLineEnd(TypedDict):
    """The last line."""
    end: "EndLine"
    """The last line."""


class SimulateLineError(TypedDict):
    """The last line where a step has no answer."""
    error: "ErrorLine"
    """The last line where a step has no answer."""


SimulateLine = Union["SimulateLineBegin", "SimulateLineStep", "SimulateLineEnd", "SimulateLineError"]
"""One line of the answer."""


class _SimulateRequestRequired(TypedDict):
    needle: "NeedleSpec"
    """The needle before the first step."""
    steps: List["StepSpec"]
    """What is done, in order of time. The tissue is at rest at time 0."""


class SimulateRequest(_SimulateRequestRequired, total=False):
    """A needle, a timed list of what is done with it, and what it is pressed into."""
    accuracy: Optional["AccuracySpec"]
    effects: Optional["EffectsSpec"]
    scene: Optional["SceneChoice"]


class SolverAnswer(TypedDict):
    """What the solution cost, in units that do not depend on the machine."""
    iterations: int
    """Newton iterations over all meshes and load steps."""
    load_steps: int
    """Load steps."""
    residual_mn: float
    """Residual force at the end, mN."""
    unknowns: int
    """Unknowns of the last mesh."""


class StepLine(TypedDict):
    """The end of one step."""
    contact: "ContactAnswer"
    """The contact."""
    index: int
    """Index of the step, from 0."""
    mesh_laid: bool
    """Whether a mesh was laid for this step, which then did not start from the step before."""
    needle: "NeedleAnswer"
    """The needle at the end of the step; its travel is that of this step."""
    solver: "SolverAnswer"
    """What the solution cost, in units that do not depend on the machine."""
    surface: "StepSurface"
    """The deformed surface."""
    time_s: float
    """Its time, s."""
    time_us: "TimeAnswer"
    """What the step cost on this machine."""
    warnings: List[str]
    """What the caller should know besides."""


class _StepSpecRequired(TypedDict):
    time_s: float
    """When the step's load is reached, s: 1e-6 to 1000 after the step before, or after 0."""


class StepSpec(_StepSpecRequired, total=False):
    """One step. What is left out of the needle's pose is where the step before left it."""
    bleb: Optional["FillingSpec"]
    direction: Optional["Vector"]
    force_mn: Optional["Vector"]
    orientation_xyzw: Optional["Quaternion"]
    tip_mm: Optional["Vector"]


class StepSurface(TypedDict):
    """The deformed surface, scene frame, in the order of a prediction's."""
    displacement_um: List[float]
    """Length of each node's displacement from rest, µm."""
    normals: List["Vector"]
    """Unit normals of the deformed surface at the nodes, out of the tissue."""
    vertices_mm: List["Vector"]
    """Deformed nodes, mm."""


class _StoreEntryRequired(TypedDict):
    bytes: int
    """What they take."""
    durable: bool
    """Whether they are still there when the service has ended and begun again; without `--scene-store` they are kept
    in memory alone.
    """
    most_bytes: int
    """What they may take together."""
    most_bytes_each: int
    """What one may take."""
    most_scenes: int
    """How many there may be."""
    scenes: int
    """How many there are."""


class StoreEntry(_StoreEntryRequired, total=False):
    """Where stored scenes are kept, and what room there is."""
    unavailable: Optional[str]
    """Why the place could not be asked just now; then the list is what was known before."""


class _StoredSceneRequired(TypedDict):
    bytes: int
    """Size of what is stored; 0 for a built-in one."""
    durable: bool
    """Whether it is still there when the service has ended and begun again."""
    id: str
    """What a request writes as its `scene`: the SHA-256 of the scene with every number written out, or the name of a
    built-in one.
    """
    state: "SceneState"
    """How far it is. A scene that is being prepared can be used already; the first answers wait for it."""


class StoredScene(_StoredSceneRequired, total=False):
    """A scene that can be named, and how far it is."""
    cause: Optional[str]
    """`failed`, `corrupt`: why."""
    progress: Optional["SceneProgress"]
    surface: Optional["SurfaceSummary"]
    touch: Optional["TouchSpec"]


class StreamCommand(TypedDict, total=False):
    """A message of the client: exactly one of the fields."""
    open: Optional["OpenSpec"]
    pose: Optional["StreamPose"]


class StreamMessageOpened(TypedDict):
    """The session has begun."""
    opened: "OpenedMessage"
    """The session has begun."""


class StreamMessageAnswer(TypedDict):
    """The answer to a pose."""
    answer: "AnswerMessage"
    """The answer to a pose."""


class StreamMessageProblem(TypedDict):
    """What is wrong with a message. The stream goes on."""
    problem: "ProblemMessage"
    """What is wrong with a message. The stream goes on."""


StreamMessage = Union["StreamMessageOpened", "StreamMessageAnswer", "StreamMessageProblem"]
"""A message of the server."""


class _StreamPoseRequired(TypedDict):
    sequence: int
    """Number of the pose, larger than that of the one before; the answer repeats it."""


class StreamPose(_StreamPoseRequired, total=False):
    """Where the needle is, and how it pushes."""
    bleb: Optional["FillingSpec"]
    client_time_us: Optional[float]
    """The client's clock, µs, or any other number that the answer is to repeat."""
    direction: Optional["Vector"]
    force_mn: Optional["Vector"]
    orientation_xyzw: Optional["Quaternion"]
    time_s: Optional[float]
    """In a session with memory: when the load of this pose is reached, s after the tissue was at rest, 1e-6 to 1000
    after the last pose answered; the time since the session was asked for when left out. Not in a session without
    memory.
    """
    tip_mm: Optional["Vector"]


class StreamTimes(TypedDict):
    """The server's times of an answer, µs."""
    computed: float
    """From then until the surface was there."""
    received: float
    """When the pose arrived, on a clock that began with the connection."""
    waited: float
    """From then until work on it began."""


class _SurfaceAnswerRequired(TypedDict):
    displacement_um: List[float]
    """Length of each node's displacement, µm."""
    normals: List["Vector"]
    """Unit normals of the deformed surface at the nodes, out of the tissue."""
    triangles: List["Triangle"]
    """Triangles between nodes, counter-clockwise seen from the vitreous."""
    vertices_mm: List["Vector"]
    """Deformed nodes, mm."""


class SurfaceAnswer(_SurfaceAnswerRequired, total=False):
    """The deformed surface, scene frame. A grid patch has 64 vertices row by row (x fastest) and 98 triangles."""
    source_indices: Optional[List[int]]
    """For a patch cut from a mesh: the mesh's index of each node."""


SurfaceKind = Literal["flat", "sphere", "foveal_pit", "mesh"]
"""What a surface is."""


class _SurfaceSpecRequired(TypedDict):
    kind: "SurfaceKind"
    """What it is."""


class SurfaceSpec(_SurfaceSpecRequired, total=False):
    """The inner surface of the retina at rest. A field that does not belong to the kind is refused."""
    depth_mm: Optional[float]
    """`foveal_pit`: how much thinner the retina is at the floor of the pit, mm; 0.13 when left out."""
    obj: Optional[str]
    """`mesh`: the text of an OBJ file in mm, in place of `vertices_mm` and `triangles`."""
    ply: Optional[str]
    """`mesh`: the text of an ASCII PLY file in mm, in place of `vertices_mm` and `triangles`."""
    radius_mm: Optional[float]
    """`sphere`, `foveal_pit`: radius of the eye at the inner surface, mm; 12 when left out."""
    sigma_mm: Optional[float]
    """`foveal_pit`: standard deviation of the pit's bell, mm; 0.25 when left out."""
    stl: Optional[str]
    """`mesh`: the text of an ASCII STL file in mm, in place of `vertices_mm` and `triangles`."""
    triangles: Optional[List["Triangle"]]
    """`mesh`: triangles, counter-clockwise seen from the vitreous."""
    vertices_mm: Optional[List["Vector"]]
    """`mesh`: vertices, scene frame, mm; together with `triangles`."""


class _SurfaceSummaryRequired(TypedDict):
    kind: "SurfaceKind"
    """The kind."""


class SurfaceSummary(_SurfaceSummaryRequired, total=False):
    """What a surface is, in short."""
    triangles: Optional[int]
    """`mesh`: its triangles."""
    vertices: Optional[int]
    """`mesh`: its vertices."""


class TimeAnswer(TypedDict):
    """What the answer cost on this machine, from the arrival of the body to the start of the answer's text."""
    stages: Dict[str, float]
    """By stage, µs: `queue` (the wait for a thread), `read` (the body), `prepare` (finding the scene, or making it)
    and then those of the level.
    """
    total: float
    """All stages together, µs."""


TipName = Literal["hemispherical", "flat", "bevelled"]
"""A tip by name."""


class TipShape(TypedDict, total=False):
    """A tip with its numbers: exactly one of the fields."""
    bevelled: Optional["BevelledTip"]
    flat: Optional["FlatTip"]


TipSpec = Union["TipName", "TipShape"]
"""How a needle ends."""


class TissueSpec(TypedDict, total=False):
    """The layers of the eye wall, from the vitreous outwards."""
    bond: Optional["BondSpec"]
    choroid: Optional["LayerSpec"]
    inner_limiting_membrane: Optional["LayerSpec"]
    rate: Optional["RateSpec"]
    retina: Optional["RetinaSpec"]
    sclera: Optional["LayerSpec"]


class TouchNeedle(TypedDict):
    """A needle of the usual size."""
    direction: "Vector"
    """The way it points, scene frame."""
    tip_mm: "Vector"
    """Foremost point of the needle, scene frame, mm."""


class TouchSpec(TypedDict):
    """The part of a request that says where a needle presses."""
    force_mn: "Vector"
    """Its force on the tissue, scene frame, mN."""
    needle: "TouchNeedle"
    """The needle."""


Triangle = List[int]
"""an array of 3 vertex indices from 0"""


Vector = List[float]
"""an array of 3 numbers: x, y, z"""


class WeightsEntry(TypedDict):
    """The weights of a learned level."""
    level: str
    """The level."""
    sha256: str
    """SHA-256 of the file."""
    usable: bool
    """Whether they were read; without, the level has no answer."""
