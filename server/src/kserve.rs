//! The Open Inference Protocol (version 2 of KServe, Triton, OpenVINO) over the levels: tensors in, tensors out.
//!
//! Contract: every level is a model, `retina-linear` to `retina-reference`; `retina-network` is the trained network. The first dimension of every tensor
//! is the batch. Inputs, all but `tip_mm` optional, FP32 or FP64 (a column of one number may be left out of the shape):
//!
//! | input | shape | what it is |
//! |---|---|---|
//! | `tip_mm` | N × 3 | foremost point of the needle before it moves, scene frame |
//! | `force_mn` | N × 3 | force along which it advances; left out: the needle is held and the reaction is the answer |
//! | `orientation_xyzw` | N × 4 | rotation from the needle's frame (it points along its −z); straight down when left out |
//! | `radius_mm` | N × 1 | radius of the shaft |
//! | `gauge` | N × 1, BYTES | size by name in place of `radius_mm`; `25G` when neither is given |
//! | `tip` | N × 1, BYTES | `hemispherical` (when left out), `flat` or `bevelled` |
//! | `retina_thickness_mm`, `retina_youngs_modulus_kpa`, `retina_poisson_ratio`, and the same of `choroid_` | N × 1 | tissue in place of the scene's |
//!
//! Outputs, FP32 but for one: `vertices_mm` (N × 64 × 3), `normals` (N × 64 × 3), `displacement_um` (N × 64), `needle_tip_mm` (N × 3), `travel_mm` (N × 1), `reaction_mn` (N × 3),
//! `contact_area_mm2`, `max_strain`, `puncture_share` (N × 1), `expected_error_um` (N × 2: median and 95 % of the worst node; unknown is NaN, in JSON `null`), `calibrated`
//! (N × 1, BOOL: whether that was measured on requests like this one). What else an answer warns of stands in the response's parameter `warnings`.
//!
//! The request's parameters are `scene` (a name) and `binary_data_output`. One row that has no answer is an error of the request and names the
//! row. Numbers are those of `POST /v1/predict` in 32 bits. Sources: `specification/protocol/inference_rest.md` of the protocol, and Triton's extension `binary_tensor_data`.
//!
//! Read `handlers`, `models` (the tables), `request` and `tensor` (bytes to rows), `infer` (rows on the numerical threads), `respond` (to bytes), `refusal`.

pub mod handlers;
mod infer;
mod models;
mod refusal;
mod request;
mod respond;
mod tensor;
