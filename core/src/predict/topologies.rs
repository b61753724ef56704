//! Mesh topologies shared by every scene and thread: they depend on counts alone and are made once.

use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use crate::mesh::wall::{WallDivision, WallError, WallTopology};

static TOPOLOGIES: LazyLock<Mutex<HashMap<WallDivision, Arc<WallTopology>>>> = LazyLock::new(Mutex::default);

/// The topology of `division`, made on first use. Layer counts are bounded, so the map is too.
///
/// # Errors
/// If the sparsity pattern cannot be analysed.
pub fn shared_topology(division: WallDivision) -> Result<Arc<WallTopology>, WallError> {
    let mut topologies = TOPOLOGIES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(topology) = topologies.get(&division) {
        return Ok(topology.clone());
    }
    let topology = Arc::new(WallTopology::new(division.clone())?);
    topologies.insert(division, topology.clone());
    Ok(topology)
}
