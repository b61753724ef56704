//! What the test tiers and the measuring programs share. Sees every package, is seen by none.

pub mod audit;
pub mod cap;
pub mod cost;
pub mod held_out;
pub mod http_load;
pub mod igtl_client;
pub mod laws;
pub mod malformed;
pub mod overload;
pub mod paper_network;
pub mod random_scene;
pub mod search;
pub mod stated_errors;
pub mod stream_client;
pub mod tolerance;
