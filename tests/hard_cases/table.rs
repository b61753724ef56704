//! The list of hard cases, and what is done with each line of it.
//!
//! A case is a name, a scene, a request and what must come of it; a new one is one line in the list of its theme. An answer must obey every law
//! of [`retina_tests::laws`] and take no more Newton iterations than its line says: what it took when the line was written and a quarter more, at least two, for another
//! machine's rounding takes another path. Each theme says why its cases take what they take. A refusal must name its cause.

use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use retina_core::needle::{Needle, NeedleShape};
use retina_core::predict::{Control, EffectChoice, Level, PredictError, Prediction, PreparedScene, Request, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::tissue::Tissue;
use retina_tests::laws::{broken, cause};

/// What must come of a case.
#[derive(Clone, Copy)]
pub enum Expect {
    /// An answer after at most so many Newton iterations.
    Answer(usize),
    /// An answer after at most so many iterations, with a warning that holds this word.
    Warned(usize, &'static str),
    /// A refusal whose text holds this.
    Refusal(&'static str),
    /// An answer after at most so many iterations, or a refusal whose text holds this: which of them, rounding decides.
    Either(usize, &'static str),
}

/// Level `coarse` unless the request says otherwise; every case is asked at `linear` too, where it must be answered or refused.
pub struct Case {
    /// What is hard about it.
    pub name: &'static str,
    /// What is pressed.
    pub scene: fn() -> Scene,
    /// What is asked.
    pub request: fn() -> Request,
    /// What must come of it.
    pub expect: Expect,
}

/// One line of the list.
pub const fn case(name: &'static str, scene: fn() -> Scene, request: fn() -> Request, expect: Expect) -> Case {
    Case { name, scene, request, expect }
}

/// Asks every case and fails with all that do not come out as their line says.
pub fn run(theme: &str, cases: &[Case]) {
    let mut wrong = Vec::new();
    let (mut answered, mut refused, mut most) = (0, 0, 0);
    for case in cases {
        let request = (case.request)();
        let scene = (case.scene)();
        let prepared = PreparedScene::new(scene);
        let linear = Request { level: Level::Linear, ..request.clone() };
        for problem in laws_at(&prepared, &linear).1 {
            wrong.push(format!("{}, level linear: {problem}", case.name));
        }
        let (found, problems) = laws_at(&prepared, &request);
        wrong.extend(problems.iter().map(|problem| format!("{}: {problem}", case.name)));
        let line = match &found {
            Ok(answer) => format!(
                "{} iterations, {:.3} µm",
                answer.solver.iterations,
                answer.displacement_um.iter().copied().fold(0.0, f64::max)
            ),
            Err(error) => error.clone(),
        };
        println!("| {theme} | {} | {line} |", case.name);
        match (&found, case.expect) {
            (Ok(answer), Expect::Answer(limit) | Expect::Warned(limit, _) | Expect::Either(limit, _)) => {
                answered += 1;
                most = most.max(answer.solver.iterations);
                if answer.solver.iterations > limit {
                    wrong.push(format!(
                        "{}: {} iterations, at most {limit} are expected",
                        case.name, answer.solver.iterations
                    ));
                }
                if let Expect::Warned(_, word) = case.expect
                    && !answer.warnings.iter().any(|warning| warning.contains(word))
                {
                    wrong.push(format!("{}: no warning of `{word}` in {:?}", case.name, answer.warnings));
                }
            }
            (Err(error), Expect::Refusal(word) | Expect::Either(_, word)) if error.contains(word) => refused += 1,
            (found, _) => {
                let found = found.as_ref().map(|answer| answer.contact).map_err(Clone::clone);
                wrong.push(format!("{}: came to {found:?}", case.name));
            }
        }
    }
    println!(
        "theme {theme}: {} cases, {answered} answered in at most {most} iterations, {refused} refused by name",
        cases.len()
    );
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// The answer or the refusal's text, and the laws that the answer breaks.
fn laws_at(
    prepared: &Result<PreparedScene, PredictError>,
    request: &Request,
) -> (Result<Prediction, String>, Vec<String>) {
    let named = |error: &PredictError| format!("{}: {error}", cause(error).1);
    let prepared = match prepared {
        Ok(prepared) => prepared,
        Err(error) => return (Err(named(error)), Vec::new()),
    };
    match prepared.predict(request, &mut Workspace::default(), &mut Silent) {
        Ok(answer) => {
            let problems = broken(prepared.scene(), request, &answer);
            (Ok(answer), problems)
        }
        Err(error) => (Err(named(&error)), Vec::new()),
    }
}

/// The flat scene.
pub fn flat() -> Scene {
    built_in("flat")
}

/// A built-in scene.
pub fn built_in(name: &str) -> Scene {
    Scene::built_in(name).expect("a built-in scene")
}

/// The flat scene with other tissue.
pub fn tissue(change: impl FnOnce(&mut Tissue)) -> Scene {
    let mut scene = flat();
    change(&mut scene.tissue);
    scene
}

/// A needle that touches the patch's centre and points straight down, pushed with a force straight down (mN).
pub fn push(shape: NeedleShape, force_mn: f64) -> Request {
    lean(shape, 0.0, 0.0, force_mn)
}

/// A needle over the patch's centre that leans by so many degrees towards x, pushed with a force that leans by so many (mN).
pub fn lean(shape: NeedleShape, needle_deg: f64, force_deg: f64, force_mn: f64) -> Request {
    Request {
        needle: Needle::pointing(shape, Point3::new(0.0, 0.0, 0.1), &leaning(needle_deg)),
        control: Control::Force(leaning(force_deg).into_inner() * force_mn),
        level: Level::Coarse,
        effects: EffectChoice::Auto,
    }
}

/// The direction that leans so many degrees from straight down towards x.
pub fn leaning(degrees: f64) -> Unit<Vector3<f64>> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Unit::new_normalize(Vector3::new(sin, 0.0, -cos))
}

/// The request with the needle's tip elsewhere (mm).
pub fn at(request: Request, x: f64, y: f64, z: f64) -> Request {
    Request { needle: Needle { tip_mm: Point3::new(x, y, z), ..request.needle }, ..request }
}

/// The request with the needle turned about its shaft (degrees).
pub fn rolled(mut request: Request, degrees: f64) -> Request {
    request.needle.orientation *= UnitQuaternion::from_axis_angle(&Vector3::z_axis(), degrees.to_radians());
    request
}

/// The request with the needle held where it stands.
pub fn held(request: Request) -> Request {
    Request { control: Control::Pose, ..request }
}

/// The request with every effect.
pub fn all(request: Request) -> Request {
    Request { effects: EffectChoice::All, ..request }
}

/// The request with these effects.
pub fn with(request: Request, names: &[&str]) -> Request {
    Request { effects: EffectChoice::Named(names.iter().map(|name| (*name).to_owned()).collect()), ..request }
}
