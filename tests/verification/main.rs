//! Closed forms and published or independently computed values.

mod finite_element;
mod linear_layer;
mod rates;
