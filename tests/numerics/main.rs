//! Unit tests of the numerics, one file for each file or folder of `core/src`.
//!
//! Contract: every test can fail; a check of derivatives first makes sure that the derivative is not zero. Units: mm, kPa.
//!
//! Not here: laws of whole answers and closed forms of mechanics, which have tiers of their own.

mod budget;
mod dataset;
mod effects;
mod factor;
mod mesh;
mod mesh_file;
mod meshes;
mod needle;
mod network;
mod offset_disc;
mod patch;
mod scene;
mod shaft;
mod surface;
mod tissue;
