//! Hard cases: what breaks engines of this kind, one file a theme. Every case ends in a sound answer or in a refusal that names its cause.
//!
//! `cargo test --release -p retina-tests --test hard_cases -- --nocapture --test-threads 1` prints what each case came to.

mod blebs;
mod conditions;
mod materials;
mod meshes;
mod needles;
mod random;
mod sizes;
mod starts;
mod table;
mod time_steps;
mod volume;
