//! Closed forms and published or independently computed values.

mod linear_layer;
