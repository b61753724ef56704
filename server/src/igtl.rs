//! OpenIGTLink, the protocol of image-guided therapy (3D Slicer, PLUS): the needle comes as TRANSFORM, the surface goes as POINT and POLYDATA.
//!
//! Contract. What comes in:
//!
//! | message | what it says |
//! |---|---|
//! | TRANSFORM | the needle: takes its own frame (it points along its −z, the origin at its foremost point) to the world, mm. The device name of the first one is the needle's from then on. Each has one answer, or is overtaken by a newer one |
//! | SENSOR | the force along which the needle advances, for the poses after it: three numbers in newtons with a prefix, world axes |
//! | STRING | `wire::igtl::IgtlCommand` as JSON: `{"force_mn": [0, 0, -0.8]}`, `{"control": "pose"}` (no force: the needle is held), `{"open": {…}}` (scene, needle, accuracy, effects, axes), `{"token": "…"}` |
//! | GET_STATUS, GET_CAPABIL | asks for STATUS, CAPABILITY |
//!
//! A connection begins with the session of `{"open": {}}`. An answer repeats the time stamp of its TRANSFORM (and in version 2 its message
//! number) and is, by device name: POINT `Nodes` and POLYDATA `Surface` (with triangles, normals, and displacements in µm as scalars), TRANSFORM `NeedleTip` (the
//! needle at equilibrium), SENSOR `Reaction` (mN), `Travel` (mm) and, where it is known, `ExpectedError` (µm: median, 95 %), at last STRING `Answer` (`wire::igtl::IgtlAnswer`).
//! A problem is a STATUS with its cause and the STRING `Problem` with its document, the pose's `sequence` and how many were `dropped`, because some clients
//! read one of them only.
//!
//! Axes: OpenIGTLink says of no point which axes it is in, so the session does: `ras` (the default, 3D Slicer's own: the scene's axes are taken as
//! right, anterior, superior) or `lps` (x and y the other way round); see [`axes`].
//!
//! Headers of version 1 and 2 are read and answered in the version that the client used last; metadata are skipped. Damaged and unknown
//! messages are refused and the connection goes on; what can no longer be told apart ends it.
//!
//! Read `listen` (the connections), [`frame`] (bytes to messages), [`content`] and [`compose`] (what is in them), [`axes`], [`mod@unit`], `conversation` (what they
//! ask for), `answer` (what they are told). Pacing and sessions are `stream`'s.

mod answer;
pub mod axes;
pub mod compose;
pub mod content;
mod conversation;
pub mod crc;
pub mod frame;
mod listen;
pub mod unit;

pub use listen::listen;
