//! Files of weights: what is not one is refused. A header that names a hash gets the right one, or nothing would come past it.

#![no_main]

use libfuzzer_sys::fuzz_target;
use retina_core::network::contact::{ContactNetwork, Start};
use retina_core::network::faithful::FaithfulNetwork;
use retina_core::network::weights::{HASH, hash};

/// Bytes of the length of the header.
const LENGTH_BYTES: usize = 8;

/// The file with the hash of its data in its header, where there is room for one.
fn with_hash(file: &[u8]) -> Option<Vec<u8>> {
    let length = u64::from_le_bytes(file.get(..LENGTH_BYTES)?.try_into().ok()?);
    let end = LENGTH_BYTES.checked_add(usize::try_from(length).ok()?)?;
    let hash = hash(file.get(end..)?);
    let key = format!("\"{HASH}\":\"");
    let at = file[..end].windows(key.len()).position(|window| window == key.as_bytes())? + key.len();
    let mut whole = file.to_vec();
    whole.get_mut(at..at + hash.len())?.copy_from_slice(hash.as_bytes());
    Some(whole)
}

fuzz_target!(|file: &[u8]| {
    let whole = with_hash(file);
    let file = whole.as_deref().unwrap_or(file);
    for start in [Start::Linear, Start::Coarse] {
        let _ = ContactNetwork::new(start, file);
    }
    let _ = FaithfulNetwork::new(file);
});
