//! What the test tiers and the measuring programs share. Sees every package, is seen by none.

pub mod audit;
pub mod cap;
pub mod cost;
pub mod fuzzed;
pub mod held_out;
pub mod held_out_samples;
pub mod http_load;
pub mod igtl_client;
pub mod laws;
pub mod local_service;
pub mod machine_time;
pub mod malformed;
pub mod overload;
pub mod paper_network;
pub mod promise;
pub mod random_scene;
pub mod search;
pub mod spawned;
pub mod stated_errors;
pub mod stream_client;
pub mod tolerance;
