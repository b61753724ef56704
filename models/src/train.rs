//! What every training shares: products, parameters, Adam, checkpoints and the record of a run.
//!
//! The backward passes are written by hand on faer's products. A framework was weighed against it with measured figures: for the paper's network of
//! a million parameters one training step takes 24–32 ms a sample with burn's CPU backend and 32–176 ms with candle, and 7.5–15 ms with
//! PyTorch, while three forward passes by hand take 6–9 ms; the frameworks add 180 to 200 crates and five to 25 minutes to a cold build. Two networks of
//! a few fixed layers need no graph of operations, and every derivative is checked against differences by a test.

pub mod adam;
pub mod card;
pub mod checkpoint;
pub mod export;
pub mod layers;
pub mod matrix;
pub mod parameters;
pub mod record;
pub mod run;
pub mod score;
