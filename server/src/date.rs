//! The header `date` of every response, from the clock as it stands when the response leaves.
//!
//! hyper writes one where there is none, but keeps it until the clock has passed it: after a step backwards it tells of a time to come, for as long as the step was.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use axum::http::HeaderValue;
use httpdate::fmt_http_date;

/// First time that HTTP's form of a date cannot tell, the year 10 000, in seconds since 1970.
const YEAR_10_000_S: u64 = 253_402_300_800;

/// The time now as HTTP writes it.
pub fn now<T>(_: &T) -> Option<HeaderValue> {
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    text(since_1970)
}

/// `None` for a time that HTTP has no form for.
fn text(since_1970: Duration) -> Option<HeaderValue> {
    let can_be_told = since_1970.as_secs() < YEAR_10_000_S;
    can_be_told.then(|| fmt_http_date(UNIX_EPOCH + since_1970)).and_then(|text| HeaderValue::try_from(text).ok())
}
